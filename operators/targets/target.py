"""What light is baked to: what is requested, the target that is read, and the output that is written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.scene import Scene
from ...addon.tracing import EmbreeTracer
from ..jobs.written import Written
from .probes import ProbeFiles

if TYPE_CHECKING:
    from ...addon.gather import Irradiance
    from ...addon.pipeline.outputs import Samples


class Output(Protocol):
    """What a target makes of light, ready to be written.

    Attributes
    ----------
    files : list of Path
        That writing it writes, if nothing stands in the way.
    counts : dict of str to int
        For the report.
    """

    @property
    def files(self) -> list[Path]: ...

    @property
    def counts(self) -> dict[str, int]: ...

    def of_target(self, target: Any) -> "Output":
        """The same for a target that is the same but for its files."""

    @staticmethod
    def together(apart: "Mapping[str, Any]") -> "Output":
        """What has the light of all light groups, and that of each apart, from those of each by their names."""

    def concerns(self) -> list[str]:
        """What writing it now would have to warn of; for the main thread."""

    def write(self) -> Written:
        """Write to Blender's data and to files what can be written; for the main thread.

        Raises
        ------
        BakeError
            If nothing can be, and nothing was changed.
        """


class Target(Protocol):
    """Something that light is baked to, as it was read out of Blender's data.

    Attributes
    ----------
    object_names : list of str
        Objects that get light.
    """

    @property
    def object_names(self) -> list[str]: ...

    @property
    def sizes(self) -> dict[Path, int]:
        """How large the files that it goes to may become, bytes."""

    def samples(self, scene: Scene, tracer: EmbreeTracer, workers: Workers, warnings: list[str]) -> "Samples":
        """Where light is wanted, to be finished into an `Output`; touches none of Blender's data."""


class Request(Protocol):
    """A target that was asked for."""

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> Target:
        """Read it out of a graph of a Blender scene, for objects of some names or for all.

        Raises
        ------
        BakeError
            If nothing can be baked to, or an object asked for cannot take the light.
        """


@dataclass(frozen=True)
class Solved:
    """Light that is ready to be written.

    Attributes
    ----------
    irradiance : Irradiance
        Of all targets' receivers, one after the other; of vertices, as it is stored.
    outputs : list of Output
        One a target.
    content : bytes
        A digest of all that it is made of; empty where none was made.
    """

    irradiance: "Irradiance"
    outputs: list[Output]
    content: bytes = b""

    def of_targets(self, targets: Sequence[Target]) -> "Solved":
        """The same light for targets that are the same but for their files, as those of another frame are."""
        outputs = [output.of_target(target) for output, target in zip(self.outputs, targets, strict=True)]
        return replace(self, outputs=outputs)

    @property
    def files(self) -> list[Path]:
        """That writing the outputs writes."""
        return [path for output in self.outputs for path in output.files]

    @property
    def n_points(self) -> int:
        """Receivers and probes."""
        return len(self.irradiance.value) + self.counts.get("probes", 0)

    @property
    def relative_noise(self) -> float:
        """The receivers', and if there are none the probes'."""
        if len(self.irradiance.value):
            return self.irradiance.relative_noise
        return max((one.relative_noise for one in self.outputs if isinstance(one, ProbeFiles)), default=0.0)

    @property
    def counts(self) -> dict[str, int]:
        """What the bake counted, for its report."""
        counts = dict(self.irradiance.counts)
        for output in self.outputs:
            counts |= output.counts
        return counts
