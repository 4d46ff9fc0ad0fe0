"""Light kept in files by what it is made of, so that nothing is solved twice: by bakes that go on, on many machines.

A file has the light that receivers of one frame got, before noise is taken out of it and it is fitted, and the name of
its content: a digest of the scene, the receivers and the settings, and of the versions that have a say in it. So light
of another scene, or of other settings, is never taken for this one's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...addon.core.errors import BakeError
from ...addon.output.archive import read_archive, write_archive
from .folders import check_folder, make_folder
from .versions import versions

if TYPE_CHECKING:
    from ...addon.pipeline.outputs import Exposure

_DECISIVE = ("photon_bake", "numpy", "scipy", "embreex", "numba", "llvmlite")
"""The versions that light may depend on."""


@dataclass(frozen=True)
class KeptLight:
    """An exposure without its samples, which are read anew.

    Attributes
    ----------
    total : Irradiance
    lights : list of Irradiance
        Of each light group.
    samples : list of list
        What `lit_by` gave the samples of each light group, see `Samples.kept`.
    dark : bool
    flush_emitters : list of list of str
    turned_away, inside_out : list of str
    """

    total: Any
    lights: list[Any]
    samples: list[list[Any]]
    dark: bool
    flush_emitters: list[list[str]]
    turned_away: list[str]
    inside_out: list[str]


class LightStore:
    """A folder of light.

    Parameters
    ----------
    folder : Path
        Made where it is missing.
    reads : bool
        Whether light is taken that is there already.
    solves : bool
        Whether light is solved that is not there.

    Attributes
    ----------
    frame : str
        Of which light is asked for, as messages call it.
    n_found : int
        How often light was there.
    """

    def __init__(self, folder: Path, reads: bool, solves: bool = True) -> None:
        self._folder, self._reads, self._solves = folder, reads, solves
        self._versions = {name: version for name, version in versions().items() if name in _DECISIVE}
        self.frame, self.n_found = "the current frame", 0
        check_folder(folder, "the state")

    def path_of(self, content: bytes) -> Path:
        """The file of the light of some content."""
        words = repr(sorted(self._versions.items())).encode()
        return self._folder / f"{blake2b(content + words, digest_size=16).hexdigest()}.npz"

    def find(self, content: bytes, samples: Sequence[Any]) -> "Exposure | None":
        """The light of some content at samples; None where it is to be solved.

        Raises
        ------
        BakeError
            If there is none and none may be solved, or the file is damaged.
        """
        from ...addon.gather import Irradiance
        from ...addon.gather.irradiance import OwnRays
        from ...addon.gather.rays.probe_light import ProbeLight
        from ...addon.pipeline.camera_pass import LightBeside
        from ...addon.pipeline.outputs import Exposure
        from ...addon.settings.bake import BakeSettings

        path = self.path_of(content)
        if not (self._reads and path.is_file()):
            if self._solves:
                return None
            raise BakeError(
                f"{self._folder} has no light of {self.frame} with these settings: bake the shard that it belongs to, "
                "with the same file, options and version."
            )
        kept, _ = read_archive(path, [KeptLight, Irradiance, OwnRays, LightBeside, ProbeLight, BakeSettings])
        self.n_found += 1
        of_groups = [[one.with_kept(own) for one, own in zip(samples, group, strict=True)] for group in kept.samples]
        pairs = [(first, second) for first, second in kept.flush_emitters]
        light = kept.total, kept.lights, of_groups, kept.dark
        return Exposure(*light, pairs, kept.turned_away, kept.inside_out)

    def keep(self, content: bytes, exposure: "Exposure") -> None:
        """Write light of some content to its file."""
        kept = KeptLight(
            exposure.total,
            exposure.lights,
            [[one.kept() for one in group] for group in exposure.samples],
            exposure.dark,
            [list(pair) for pair in exposure.flush_emitters],
            exposure.turned_away,
            exposure.inside_out,
        )
        make_folder(self._folder)
        write_archive(self.path_of(content), kept, self._versions)
