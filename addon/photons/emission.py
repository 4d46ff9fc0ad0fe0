"""All that emits photons in a scene."""

from ..errors import BakeError
from ..scene import LightKind, Scene
from .caustic_makers import caustic_makers
from .distant_sources import SunSource, WorldSource
from .lamp_sources import AreaSource, PointSource
from .mesh_source import MeshSource
from .source import Source, Sphere, bounding_sphere


def light_sources(scene: Scene, region: Sphere) -> list[Source]:
    """All sources of a scene that emit anything, the receivers being in `region`, aimed at what makes caustics.

    Raises
    ------
    BakeError
        If nothing emits light.
    """
    lights, whole = scene.lights, bounding_sphere(scene)
    sources: list[Source] = []
    for lamp, kind in enumerate(lights.kind):
        if kind in (LightKind.POINT, LightKind.SPOT):
            sources.append(PointSource(lights, lamp, whole))
        elif kind == LightKind.SUN:
            sources.append(SunSource(lights, lamp, scene, region))
        else:
            sources.append(AreaSource(lights, lamp, whole))
    sources.append(MeshSource(scene))
    sources.append(WorldSource(scene, region))
    sources = [source for source in sources if source.power.sum() > 0]
    aim = caustic_makers(scene, region)
    for source in sources:
        if aim and source.sampled_directly:
            source.aim_at(aim)
    if not sources:
        raise BakeError("There is no light in the scene: add a lamp, an emissive material or a world colour.")
    return sources
