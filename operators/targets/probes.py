"""Light of probes, for what moves, as a JSON file and as volumes."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...addon.blender.read.light_probes import probe_places
from ...addon.blender.warn import Warnings
from ...addon.core.errors import Advice, BakeError
from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.output import atomic_path, check_place, file_name
from ...addon.receivers import ProbePlaces, Receivers
from ...addon.scene import Scene
from ...addon.settings.bake import BakeSettings
from ...addon.settings.probes import ProbeSettings
from ...addon.tracing import EmbreeTracer
from ..jobs.folders import check_folder, make_folder
from ..jobs.versions import own_version
from ..jobs.written import Written

if TYPE_CHECKING:
    from ...addon.gather import Irradiance, ProbeLight
    from ...addon.output.probes import LitProbes
    from ...addon.pipeline.solution import Solution

_LEAST_RAYS = 64
_BYTES_OF_PROBE = 1024
"""In all files, about."""


@dataclass(frozen=True)
class ProbeRequest:
    """Light of probes is wanted.

    Attributes
    ----------
    settings : ProbeSettings
    folder : Path
        For the files; made where it is missing.
    scene : str
        Name of the scene, for the files' names.
    """

    settings: ProbeSettings
    folder: Path
    scene: str

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "ProbeTarget":
        """See `Request.read`."""
        places = probe_places(depsgraph, names, self.settings, Warnings(warnings))
        stem = file_name(self.scene)
        path = self.folder / f"{stem}_probes.json"
        volumes = [
            {color: self.folder / f"{stem}_{file_name(grid.name)}_probes_{color}.exr" for color in "RGB"}
            for grid in places.grids
        ]
        if len({str(of_grid["R"]).lower() for of_grid in volumes}) < len(volumes):
            raise BakeError(
                "Light probe volumes have names that differ only in signs no file name may hold: rename one."
            )
        check_folder(self.folder, "the probes")
        for one in [path, *(one for of_grid in volumes for one in of_grid.values())]:
            check_place(one)
        return ProbeTarget(places, self.settings, path, volumes, scene.name)


@dataclass(frozen=True)
class ProbeTarget:
    """Probes, the file that tells of all of them, each grid's volumes by colour, and the scene's name."""

    places: ProbePlaces
    settings: ProbeSettings
    path: Path
    volumes: list[dict[str, Path]]
    scene: str

    @property
    def object_names(self) -> list[str]:
        """None: the light goes to files."""
        return []

    @property
    def sizes(self) -> dict[Path, int]:
        """See `Target.sizes`."""
        return {self.path: len(self.places) * _BYTES_OF_PROBE}

    def samples(self, scene: Scene, tracer: EmbreeTracer, workers: Workers, warnings: list[str]) -> "ProbeSamples":
        """See `Target.samples`."""
        return ProbeSamples(self)


@dataclass(frozen=True)
class ProbeSamples:
    """Probes that look around by themselves: nothing is gathered for them besides.

    Attributes
    ----------
    target : ProbeTarget
    light : ProbeLight or None
        None until it is lit, and where nothing gives light.
    settings : BakeSettings or None
        That it was lit with.
    """

    target: ProbeTarget
    light: "ProbeLight | None" = None
    settings: BakeSettings | None = None

    @property
    def receivers(self) -> Receivers:
        """None."""
        nothing = np.zeros((0, 3), np.float32)
        return Receivers(nothing, nothing, nothing[:, 0])

    @property
    def eyes(self) -> Receivers:
        """What looks around at the probes."""
        return self.target.places.eyes()

    def lit_by(self, solution: "Solution", workers: Workers) -> "ProbeSamples":
        """See `Samples.lit_by`."""
        from ...addon.pipeline.probe_bake import probe_light

        light = probe_light(solution, self.target.places.positions, self.target.settings.n_probe_rays, workers)
        return replace(self, light=light, settings=solution.settings)

    def share(self, n: int) -> "ProbeSamples":
        """The same with one of n shares of the rays."""
        settings = self.target.settings
        n_rays = max(_LEAST_RAYS, -(-settings.n_probe_rays // n))
        return replace(self, target=replace(self.target, settings=replace(settings, n_probe_rays=n_rays)))

    @staticmethod
    def over_time(shots: "Sequence[tuple[ProbeSamples, Irradiance]]") -> "tuple[ProbeSamples, Irradiance]":
        """See `Samples.over_time`: the mean light of each probe."""
        first, irradiance = shots[0]
        lights = [one.light for one, _ in shots if one.light is not None]
        return replace(first, light=reduce(lambda sum_, one: sum_.plus(one), lights).over(len(lights))), irradiance

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "ProbeFiles":
        """See `Samples.finish`."""
        light = self.light
        assert light is not None  # there is at least one probe
        if not (np.isfinite(light.sh).all() and np.isfinite(light.irradiance).all()):
            raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
        direct = self.settings is not None and self.settings.add_direct
        return ProbeFiles(light, self.target, direct)


@dataclass(frozen=True)
class ProbeFiles:
    """The light of probes, and whether direct light is in it."""

    light: "ProbeLight"
    target: ProbeTarget
    direct: bool

    def of_target(self, target: ProbeTarget) -> "ProbeFiles":
        """See `Output.of_target`."""
        return replace(self, target=target)

    @staticmethod
    def together(apart: "Mapping[str, ProbeFiles]") -> "ProbeFiles":
        """See `Output.together`; files have the light of all groups alone."""
        parts = list(apart.values())
        return replace(parts[0], light=reduce(lambda sum_, one: sum_.plus(one), (one.light for one in parts)))

    @cached_property
    def probes(self) -> "LitProbes":
        """The probes, of which those inside of solids have their neighbours' light."""
        from ...addon.output.probes import LitProbes, filled, in_axes

        inside, first = self.light.inside, 0
        sh, sides = self.light.sh.copy(), self.light.irradiance.copy()
        for grid in self.target.places.grids:
            here = slice(first, first := first + grid.n_probes)
            for values in (sh, sides):
                values[here] = filled(values[here], ~inside[here], grid.counts)
        lit = LitProbes(self.target.places, replace(self.light, sh=sh, irradiance=sides), ~inside)
        return in_axes(lit, self.target.settings.axes)

    @property
    def files(self) -> list[Path]:
        return [self.target.path, *(path for of_grid in self.target.volumes for path in of_grid.values())]

    @property
    def counts(self) -> dict[str, int]:
        valid = self.probes.valid
        return {"probes": len(valid), "probes_inside": int((~valid).sum())}

    @property
    def relative_noise(self) -> float:
        """Of the probes' irradiance."""
        return self.light.relative_noise

    def concerns(self) -> list[str]:
        """See `Output.concerns`."""
        inside = "All probes lie inside of solids: move them to where objects move."
        return [] if self.probes.valid.any() else [Advice(inside)]

    def write(self) -> Written:
        """See `Output.write`."""
        from ...addon.output.probes import write_probe_file

        target, settings = self.target, self.target.settings
        make_folder(target.path.parent)
        software = f"Photon Bake {own_version()}, Blender {bpy.app.version_string}"
        about = {"software": software, "scene": target.scene, "light": "all" if self.direct else "indirect"}
        names = [{color: path.name for color, path in of_grid.items()} for of_grid in target.volumes]
        try:
            with ExitStack() as stack:  # every file is written before the first takes its place
                place, first = {path: stack.enter_context(atomic_path(path)) for path in self.files}, 0
                for grid, paths in zip(target.places.grids, target.volumes, strict=True):
                    here = slice(first, first := first + grid.n_probes)
                    self._write_volumes(here, grid.counts, {c: place[path] for c, path in paths.items()}, about)
                of_all = settings.harmonics, settings.axes, names, about
                write_probe_file(place[target.path], self.probes, *of_all)
        except OSError as error:
            raise BakeError(f"The probes cannot be written to {target.path.parent} ({error.strerror}).") from error
        return Written(files=self.files, warnings=self.concerns())

    def _write_volumes(
        self, here: slice, counts: tuple[int, int, int], paths: dict[str, Path], about: dict[str, str]
    ) -> None:
        from ...addon.output.probes import VOLUME_COLORS, volume_channels, write_volume

        sizes = {"countX": str(counts[0]), "countY": str(counts[1]), "countZ": str(counts[2])}
        for i, color in enumerate(VOLUME_COLORS):
            channels = volume_channels(self.probes.light.sh[here, :, i], counts, self.target.settings.harmonics)
            write_volume(paths[color], channels, {**about, "color": color} | sizes)
