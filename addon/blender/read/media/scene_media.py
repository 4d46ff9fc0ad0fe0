"""What fills a scene's meshes and its world, and what of that cannot be baked."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import bpy
import numpy as np

from ....scene import LightKind, Media, Medium, Scene, World
from ....scene.media import by_object
from ...temporary import CyclesError
from ...warn import Warnings, listed
from ..scene_contents import Source
from .clouds import medium_of_grids
from .lattices import cells_over, values_in_cells
from .smoke import is_smoke, smoke_grids
from .volume_shaders import VolumeShader, volume_differences, volume_shortcomings


@dataclass(frozen=True)
class Instances:
    """What the objects of a scene are instances of.

    Attributes
    ----------
    sources : list of Source
    matrices : (n, 4, 4) float32
        Local to world, of all instances of the dependency graph.
    left : (m,) bool
        Which of the sources' instances are objects of the scene.
    """

    sources: list[Source]
    matrices: np.ndarray
    left: np.ndarray

    @cached_property
    def are_smoke(self) -> list[bool]:
        """Which objects of the scene are the domains of gas simulations."""
        return list(compress((is_smoke(by[0]) for one in self.sources for by in one.placed_by), self.left))

    def __getitem__(self, number: int) -> "tuple[bpy.types.Object, bpy.types.Mesh, np.ndarray]":
        """The original object, the evaluated mesh and the matrix of an object of the scene."""
        every = (
            (by[0], one.mesh, row) for one in self.sources for row, by in zip(one.rows, one.placed_by, strict=True)
        )
        obj, mesh, row = list(compress(every, self.left))[number]
        assert isinstance(mesh, bpy.types.Mesh)  # fibres have no inside
        return obj, mesh, self.matrices[row].astype(np.float64)


def with_media(
    scene: Scene,
    volumes: tuple[VolumeShader | None, ...],
    instances: Instances,
    depsgraph: "bpy.types.Depsgraph",
    world: "bpy.types.World | None",
    clouds: tuple[Medium, ...],
    warnings: Warnings,
) -> Scene:
    """The scene with all its media; comes when all else is read, since Cycles bakes."""
    of_world = None
    if world is not None:
        shader = VolumeShader.of(world)
        of_world = shader.medium() if shader else None
        for what in (*volume_shortcomings(world), *volume_differences(world)):
            warnings.add(f"World '{world.name}': {what}.")
    same = tuple(volume.medium() if volume and not volume.varying else None for volume in volumes)
    filled = {number: volume for number, volume in enumerate(volumes) if volume}
    of_object = {}
    for key, _ in by_object(scene.material_of_triangle, scene.object_of_triangle, set(filled)):
        if filled[key[0]].varying or instances.are_smoke[key[1]]:
            of_object[key] = _medium_in(filled[key[0]], *instances[key[1]], depsgraph, warnings)
    scene = replace(scene, media=Media(same, of_world, of_object, clouds))
    open_ = [f"'{name}'" for name in dict.fromkeys(_unclosed(scene))]
    if open_:
        warnings.add(
            f"{len(open_)} object(s) have a volume inside but are not closed ({listed(open_)}), so that it is not "
            "there for rays that leave through the gap: close their meshes."
        )
    return scene


def _medium_in(
    volume: VolumeShader,
    obj: "bpy.types.Object",
    mesh: "bpy.types.Mesh",
    matrix: np.ndarray,
    depsgraph: "bpy.types.Depsgraph",
    warnings: Warnings,
) -> Medium | None:
    """What fills an object where that differs from place to place."""
    name = f"Material '{volume.block.name}'"
    grids = smoke_grids(obj.evaluated_get(depsgraph)) if is_smoke(obj) else {}
    shape, low, size = cells_over(mesh, matrix, next((grid.shape for grid in grids.values()), None))
    local_from_grid = np.eye(4)
    local_from_grid[:3] = np.column_stack([np.diag(size), low])
    world_from_grid = matrix @ local_from_grid
    if not np.isfinite(world_from_grid).all() or abs(np.linalg.det(world_from_grid)) < 1e-30:
        return None
    if is_smoke(obj):
        voxels = {grid_name: grid.ravel() for grid_name, grid in grids.items()}
        return medium_of_grids(volume, obj.name, voxels, shape, world_from_grid, warnings) if grids else None
    try:
        values = values_in_cells(volume.block, volume.varying, obj, mesh, matrix)
    except CyclesError as error:
        warnings.add(f"{name}: its volume is not baked, as its nodes cannot be ({error}).")
        return None
    medium, is_exact = volume.medium_in(values, shape, np.linalg.inv(world_from_grid)[:3])
    if not is_exact:
        warnings.add(f"{name}: the color of its volume differs from place to place, and its mean is baked.")
    return medium


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
