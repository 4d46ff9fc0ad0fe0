"""All that emits photons in a scene."""

from ..scene import LightKind, Scene
from .caustic_makers import caustic_makers
from .distant_sources import SunSource, WorldSource
from .lamp_sources import AreaSource, PointSource
from .mesh_source import MeshSource
from .source import Source, Sphere, bounding_sphere

_LARGEST, _LARGEST_FROM_AFAR = 0.5, 0.1
"""Radius of what is aimed at, over that of the receivers' region: what is larger is found anyway.

Of photons from afar, which fill the region, a ball gets as much as its radius says, squared; of a lamp's, which fly
everywhere, far less.
"""


def light_sources(scene: Scene, region: Sphere) -> list[Source]:
    """All sources of a scene that emit anything, the receivers being in `region`, aimed at what makes caustics."""
    lights, whole = scene.lights, bounding_sphere(scene)
    sources: list[Source] = []
    for lamp, kind in enumerate(lights.kind):
        if kind in (LightKind.POINT, LightKind.SPOT):
            sources.append(PointSource(lights, lamp, whole))
        elif kind == LightKind.SUN:
            sources.append(SunSource(lights, lamp, scene, region))
        else:
            sources.append(AreaSource(lights, lamp, whole))
    sources.append(MeshSource(scene, region))
    sources.append(WorldSource(scene, region))
    sources = [source for source in sources if source.importance > 0]
    near, far = (caustic_makers(scene, share * region.radius) for share in (_LARGEST, _LARGEST_FROM_AFAR))
    for source in sources:
        aim = far if isinstance(source, SunSource | WorldSource) else near
        if aim and source.sampled_directly:
            source.aim_at(aim)
    return sources
