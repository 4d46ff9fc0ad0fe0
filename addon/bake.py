"""One bake, stage by stage: photons are traced, receivers gather them."""

from .gather import Irradiance
from .progress import Progress
from .receivers import Receivers
from .scene import Scene
from .settings import BakeSettings
from .tracers import Tracer


def bake(
    scene: Scene, receivers: Receivers, settings: BakeSettings, tracer: Tracer, progress: Progress | None = None
) -> Irradiance:
    """Trace photons through `scene` and gather them at `receivers`.

    Raises
    ------
    BakeError
        If nothing in the scene gives light.
    Cancelled
        If `progress` was cancelled.
    """
    raise NotImplementedError
