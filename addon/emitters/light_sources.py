"""All that emits photons in a scene."""

from ..scene import LightKind, Lights, Scene
from .aiming.caustic_makers import caustic_makers
from .aiming.discs import Discs
from .aiming.regions import Sphere
from .area import area_row
from .mesh import mesh_row
from .patterns.emit import pattern_row
from .point import point_row
from .row import WORLD, SourceRow
from .source import Source, Surroundings
from .spot import spot_row
from .sun import sun_row
from .world import world_row

_LARGEST, _LARGEST_FROM_AFAR = 0.5, 0.1
"""Radius of what is aimed at, over that of the receivers' region: what is larger is found anyway.

Of photons from afar, which fill the region, a ball gets as much as its radius says, squared; of a lamp's, which fly
everywhere, far less.
"""

_ROW_OF = {
    LightKind.POINT: point_row,
    LightKind.SPOT: spot_row,
    LightKind.SUN: sun_row,
    LightKind.RECTANGLE: area_row,
    LightKind.ELLIPSE: area_row,
}


def light_sources(scene: Scene, region: Sphere) -> list[Source]:
    """All sources of a scene that emit anything, the receivers being in `region`, aimed at what makes caustics."""
    of = Surroundings.of(scene, region)
    rows = [_row(scene.lights, lamp, of.discs) for lamp in range(len(scene.lights))]
    rows += [mesh_row(len(scene.lights), of.mesh_power), world_row(scene.world, of.discs)]
    sources = [Source(row, of) for row in rows]
    sources = [source for source in sources if source.importance > 0]
    near, far = (caustic_makers(scene, share * region.radius) for share in (_LARGEST, _LARGEST_FROM_AFAR))
    for source in sources:
        aim = far if source.kind in (LightKind.SUN, WORLD) else near
        if aim and source.sampled_directly:
            source.aim_at(aim)
    return sources


def _row(lights: Lights, lamp: int, discs: Discs) -> SourceRow:
    """How a lamp emits photons."""
    pattern = lights.patterns[lamp]
    if pattern is not None:
        return pattern_row(lights, lamp, pattern, discs)
    return _ROW_OF[LightKind(lights.kind[lamp])](lights, lamp, discs)
