"""The bake that runs, or the last one, as the panel shows it. Never saved with the file."""

from collections.abc import Collection, Mapping
from time import perf_counter

from ..core.progress import Progress
from ..pipeline.warm_up import COMPILING
from ..settings.bake import Gather
from .outcomes import Outcome

STAGE_SHARES: dict[Gather, dict[str, float]] = {
    "final": {
        "Reading the scene": 2,
        "Tracing photons": 1,
        "Refining surfaces": 0.5,
        "Lighting surfaces": 2,
        "Refining light": 1,
        "Gathering light": 8,
        "Adding direct light": 1,
    },
    "density": {
        "Reading the scene": 1,
        "Tracing photons": 4,
        "Gathering photons": 5,
        "Adding direct light": 1,
    },
    "light_volume": {
        "Reading the scene": 2,
        "Tracing photons": 1,
        "Refining surfaces": 0.5,
        "Lighting surfaces": 1,
        "Refining light": 0.5,
        "Filling the volume": 3,
        "Looking between cells": 0.5,
        "Gathering in the volume": 1,
        "Reading the volume": 1,
        "Adding direct light": 1,
    },
    "photon_volumes": {
        "Reading the scene": 1,
        "Tracing photons": 4,
        "Measuring photons": 1,
        "Splatting photons": 6,
        "Looking for edges": 1,
        "Upsampling": 1,
        "Adding direct light": 1,
    },
}
"""How long each stage of a bake lasts beside the others in a typical scene; short ones are left out."""

LIGHTMAP_SHARES = {"Unwrapping": 1, "Packing": 1, "Placing texels": 1, "Denoising": 2, "Finishing lightmaps": 1}
"""The same for what lightmaps add to it."""

VERTEX_SHARES = {"Denoising vertices": 2, "Fitting vertices": 0.5}
"""The same for what vertices add to it."""

CAMERA_SHARES = {
    "Looking through the camera": 2,
    "Following gloss": 2,
    "Lighting mirrors": 0.5,
    "Denoising the pass": 2,
}
"""The same for what a camera's pass adds to it."""

PROBE_SHARES = {"Lighting probes": 4}
"""The same for what probes add to it."""

_OF_RECEIVERS = {"Gathering light", "Adding direct light"}

REFINE_SHARES = {"Refining meshes": 8, "Splitting edges": 1}
"""The same for refining meshes."""


class BakeState:
    """What the panel shows.

    Attributes
    ----------
    progress : Progress or None
        Of the bake that runs; None while none does.
    stage : str
    fraction : float
        Of the whole bake, in [0, 1]; never falls.
    scene : int
        The session id of the scene that is baked, or was.
    """

    def __init__(self) -> None:
        self.progress: Progress | None = None
        self._outcomes: dict[int, Outcome] = {}
        self._begin(0)

    def _begin(self, scene: int) -> None:
        self.stage, self.fraction = "", 0.0
        self._done: dict[str, float] = {}
        self.scene = scene
        self._outcomes.pop(scene, None)
        self._shares: dict[str, float] = {}
        self._started = perf_counter()
        self._n_times, self._n_done = 1, 0

    @property
    def outcome(self) -> Outcome:
        """Of the last bake; an empty one while it runs, or where it said nothing."""
        return self._outcomes.get(self.scene) or Outcome()

    @property
    def result(self) -> str:
        return self.outcome.result

    @property
    def error(self) -> str:
        return self.outcome.error

    @property
    def warnings(self) -> list[str]:
        return self.outcome.warnings

    def outcome_of(self, scene: int) -> Outcome | None:
        """How the last bake of a scene ended, by its session id; None where there was none."""
        return self._outcomes.get(scene)

    def forget(self) -> None:
        """Another file is open: its scenes were never baked."""
        self._outcomes.clear()

    @property
    def running(self) -> bool:
        return self.progress is not None

    def start(self, gather: Gather, targets: Collection[str] = (), scene: int = 0, n_times: int = 1) -> Progress:
        """Forget the last bake of a scene, and follow a new one through the progress returned.

        Its stages are gone through so many times.
        """
        self._begin(scene)
        self._n_times = n_times
        self._shares = shares_of(gather, targets)
        self.progress = Progress(self._listen)
        return self.progress

    def next_time(self) -> None:
        """The stages have been gone through, and begin anew."""
        self._done, self._n_done = {}, self._n_done + 1

    def stop(self, outcome: Outcome | None = None) -> None:
        """Say how the bake ended."""
        self.progress = None
        if outcome is not None:
            self._outcomes[self.scene] = outcome

    def cancel(self) -> None:
        """Ask the bake to stop, if one runs."""
        if self.progress is not None:
            self.progress.cancel()

    @property
    def seconds(self) -> float:
        """Since the bake began."""
        return perf_counter() - self._started

    @property
    def seconds_left(self) -> float | None:
        """Estimated from the time that the done part took; None while too little is done to tell."""
        if self.fraction < 0.03 or self.seconds < 0.5:
            return None
        return self.seconds * (1 / self.fraction - 1)

    @property
    def words(self) -> str:
        """The stage, and how long the rest may take."""
        left = None if self.stage == COMPILING else self.seconds_left
        return self.stage if left is None else f"{self.stage}: {duration(left)} left"

    def _listen(self, stage: str, fraction: float) -> None:
        self.stage = stage
        self._done[stage] = fraction
        done = (self._n_done + share_done(self._shares, self._done)) / self._n_times
        self.fraction = max(self.fraction, done)


def shares_of(gather: Gather, targets: Collection[str]) -> dict[str, float]:
    """The stages' shares of a bake to some targets."""
    shares = dict(STAGE_SHARES[gather])
    parts: dict[str, Mapping[str, float]] = {
        "vertex": VERTEX_SHARES,
        "lightmap": LIGHTMAP_SHARES,
        "camera": CAMERA_SHARES,
        "probes": PROBE_SHARES,
        "refine": REFINE_SHARES,
    }
    for target, added in parts.items():
        shares |= added if target in targets else {}
    if set(targets) == {"probes"}:  # they look around instead
        shares = {stage: share for stage, share in shares.items() if stage not in _OF_RECEIVERS}
    return shares


def share_done(shares: Mapping[str, float], done: Mapping[str, float]) -> float:
    """Fraction of the whole bake that is done, from its stages' shares and the fractions that they are done to."""
    return sum(share * done.get(stage, 0.0) for stage, share in shares.items()) / sum(shares.values())


def duration(seconds: float) -> str:
    """Seconds as people say them: ``0.4 s``, ``12 s``, ``3 min 20 s``, ``1 h 5 min``."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


bake_state = BakeState()
"""One bake runs at a time in a Blender, so there is one state."""
