"""A bake to vertices in three steps, for the button, for scripts and for the command line."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..addon.blender import (
    bake_objects,
    check_color_attribute,
    extract_scene,
    receiver_meshes,
    write_color_attribute,
)
from ..addon.inspector import Inspector
from ..addon.parallel import Workers
from ..addon.progress import Progress
from ..addon.receivers import ReceiverMesh, Receivers, vertex_receivers
from ..addon.scene import Scene
from ..addon.settings import BakeSettings
from ..addon.tracers import Tracer

if TYPE_CHECKING:
    from ..addon.gather import Irradiance

N_LIGHT_RAYS = 1000
"""That are followed to see which surfaces cube maps are to show."""

READING, WRITING = "Reading the scene", "Writing the light"


@dataclass
class VertexBake:
    """What a bake needs to know of Blender's data: after `prepare` it can be solved on any thread.

    Attributes
    ----------
    scene : Scene
    meshes : list of ReceiverMesh
    attribute : str
        Name of the colour attribute.
    warnings : list of str
        Grows as the bake goes.
    counts : dict of str to int
        Of the scene and the cube maps, for the report; grows too.
    """

    scene: Scene
    meshes: list[ReceiverMesh]
    attribute: str
    warnings: list[str]
    counts: dict[str, int]

    @classmethod
    def prepare(
        cls, context: Any, attribute: str, progress: Progress, names: list[str] | None = None, light_group: str = ""
    ) -> "VertexBake":
        """Read what the bake needs out of Blender's data; for the main thread.

        Parameters
        ----------
        context : bpy.types.Context
        attribute : str
        progress : Progress
        names : list of str, optional
            Objects to bake; without names every renderable mesh object.
        light_group : str
            Whose light is baked alone; empty for all light.

        Raises
        ------
        BakeError
            If the scene cannot be baked, or an object cannot take the light.
        """
        progress.update(READING, 0)
        warnings: list[str] = []
        depsgraph = context.evaluated_depsgraph_get()
        objects = bake_objects(depsgraph, names, warnings)
        check_color_attribute(objects, attribute)
        scene = extract_scene(depsgraph, warnings, light_group)
        meshes = receiver_meshes(objects, depsgraph)
        progress.update(READING, 1)
        return cls(scene, meshes, attribute, warnings, {"triangles": scene.n_triangles})

    def solve(
        self, settings: BakeSettings, progress: Progress, inspector: Inspector | None = None
    ) -> "tuple[Receivers, Irradiance]":
        """Bake, while `inspector` looks on; touches none of Blender's data, so any thread may call it."""
        from ..addon.bake import bake  # here, as Blender's start should not wait for SciPy

        inspector = inspector or Inspector()
        receivers = vertex_receivers(self.meshes)
        self.warnings += too_coarse(receivers)
        tracer = make_tracer(self.scene, self.warnings)
        maps = None
        if settings.tracer == "multi_image" and len(receivers):
            maps = self._take_cube_maps(tracer, receivers, settings, progress, inspector)
        return receivers, bake(self.scene, receivers, settings, tracer, progress, inspector, photon_tracer=maps)

    def write(self, receivers: Receivers, irradiance: "Irradiance", progress: Progress) -> None:
        """Write the light to the meshes; for the main thread."""
        progress.update(WRITING, 0)
        self.warnings += write_color_attribute(irradiance.value, receivers, self.attribute)
        progress.update(WRITING, 1)

    def _take_cube_maps(
        self, tracer: Tracer, receivers: Receivers, settings: BakeSettings, progress: Progress, inspector: Inspector
    ) -> Tracer:
        """A tracer through cube maps around the receivers, which `tracer` takes."""
        from ..addon.photons import emitted_rays, light_sources, region_of
        from ..addon.tracers.multi_image import LightRays, MultiImageTracer, lit_region

        region = lit_region(receivers.position)
        sources = light_sources(self.scene, region_of(receivers.position))
        rays = emitted_rays(sources, N_LIGHT_RAYS, settings.seed)
        light = LightRays(np.concatenate([r.origins for r in rays]), np.concatenate([r.directions for r in rays]))
        workers = Workers(settings.seed, settings.n_threads, progress)
        images = MultiImageTracer.build(
            self.scene, tracer, region, settings.n_maps, settings.map_size, workers=workers, light=light
        )
        self.counts.update(cube_maps=len(images.maps), cube_map_bytes=images.maps.n_bytes)
        inspector.see("maps", lambda: (images.maps.centres, None))
        return images


def too_coarse(receivers: Receivers) -> list[str]:
    """Warnings of objects with faces wider than all the rest: light within such a face is not seen by its vertices."""
    from ..addon.photons import region_of

    if len(receivers) == 0:
        return []
    widest = region_of(receivers.position).radius
    return [
        f"Object '{target.object_name}' has too few vertices for its size to show light: subdivide it."
        for target in receivers.targets
        if (receivers.footprint[target.receiver_of_element[target.receiver_of_element >= 0]] > widest).any()
    ]


def make_tracer(scene: Scene, warnings: list[str]) -> Tracer:
    """Embree's tracer, or where Embree is not installed Blender's own with a notice."""
    try:
        from ..addon.tracers.embree import EmbreeTracer
    except ImportError:
        from ..addon.blender import BVHTracer

        warnings.append("embreex is not installed, so Blender's slower BVH traces rays: install the extension's zip.")
        return BVHTracer(scene)
    return EmbreeTracer(scene)
