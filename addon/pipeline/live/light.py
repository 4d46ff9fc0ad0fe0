"""What live light answers with."""

from dataclasses import dataclass

import numpy as np

from .surfaces import LiveSurfaces


@dataclass(frozen=True)
class LiveLight:
    """A snapshot of the light at the n vertices of surfaces; its arrays are never written again.

    Values are E/π, the mean radiance that arrives, as Cycles' bake type Diffuse without Color has it: times the base
    colour they are the radiance that a matte surface reflects, W/(m² sr).

    Attributes
    ----------
    version : int
        Higher for each newer snapshot.
    surfaces : LiveSurfaces
        Whose vertices the light is for: after `SceneReplaced` the old ones' until there is light on the new ones.
    direct : (n, 3) float32, W/(m² sr)
        From lamps, emissive meshes and the world.
    indirect : (n, 3) float32, W/(m² sr)
        What surfaces reflect.
    error : float
        Estimated standard error of the indirect light, root mean square over the mean; infinite where it is unknown.
    since : float, s
        When the newest edit came that is in it, by `time.perf_counter`; of the first light, when the state was started.
    converged : bool
        Whether it stays as it is until the next edit.
    """

    version: int
    surfaces: LiveSurfaces
    direct: np.ndarray
    indirect: np.ndarray
    error: float
    since: float
    converged: bool
