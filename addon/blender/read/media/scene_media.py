"""What fills a scene's meshes and its world, and what of that cannot be baked."""

from collections.abc import Iterator
from dataclasses import replace

import bpy
import numpy as np

from ....scene import LightKind, Media, Medium, Scene, World
from ...warn import Warnings, listed
from .volume_shaders import medium_of, volume_differences, volume_shortcomings


def with_media(
    scene: Scene, of_materials: tuple[Medium | None, ...], world: "bpy.types.World | None", warnings: Warnings
) -> Scene:
    """The scene with the media of its materials, and of its world."""
    of_world = None
    if world is not None:
        of_world = medium_of(world)
        for what in (*volume_shortcomings(world), *volume_differences(world)):
            warnings.add(f"World '{world.name}': {what}.")
    scene = replace(scene, media=Media(of_materials, of_world))
    open_ = [f"'{name}'" for name in dict.fromkeys(_unclosed(scene))]
    if open_:
        warnings.add(
            f"{len(open_)} object(s) have a volume inside but are not closed ({listed(open_)}), so that it is not "
            "there for rays that leave through the gap: close their meshes."
        )
    return scene


def reaching(scene: Scene) -> Scene:
    """The scene without light from infinitely far away where a medium is all the way from there."""
    medium = scene.media.of_world
    if medium is None:
        return scene
    lights, dark = scene.lights, medium.extinction > 0
    emission = np.where((lights.kind == LightKind.SUN)[:, None] & dark, np.float32(0), lights.emission)
    return replace(scene, lights=replace(lights, emission=emission), world=_faded(scene.world, dark))


def _faded(world: World, dark: np.ndarray) -> World:
    """A world without light in some channels (3,) bool."""
    color = np.where(dark, np.float32(0), world.color)
    image = None if world.image is None or dark.all() else np.where(dark, np.float32(0), world.image)
    return replace(world, color=color, image=image)


def _unclosed(scene: Scene) -> Iterator[str]:
    """Names of objects that media fill whose triangles have edges with one side alone."""
    for _, on in scene.media.bounded(scene.material_of_triangle, scene.object_of_triangle):
        place = np.unique(scene.corners(on).reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
        edges = np.concatenate([place[:, [0, 1]], place[:, [1, 2]], place[:, [2, 0]]])
        way = np.where(edges[:, 0] < edges[:, 1], 1, -1)
        edge = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)[1].ravel()
        if np.bincount(edge, way).any():
            yield scene.objects.names[scene.object_of_triangle[on[0]]]
