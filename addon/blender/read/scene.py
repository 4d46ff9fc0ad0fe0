"""A Blender scene as a `Scene`."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import compress, pairwise

import bpy
import numpy as np

from ...core.errors import BakeError
from ...core.progress import Progress
from ...scene import LightGroups, Lights, NormalSpace, Scene, SceneObjects, ShadingFrames, World
from ..warn import Warnings
from .hair.shapes import Fibres
from .lamps.lamp_nodes import LampNodes, with_patterns
from .lamps.lamps import in_light_group, light_group_of
from .lamps.light_links import Placed, link_lights
from .lamps.sky_suns import shining, with_places
from .lamps.world import WorldReading, light_group_of_world, read_world, world_of
from .materials.materials import READING, MaterialTable
from .materials.pictures.missing_files import warn_of_missing_files
from .materials.stretches import Tangents
from .media.clouds import read_clouds
from .media.scene_media import Instances, reaching, with_media
from .meshes.meshes import LocalMesh
from .meshes.placing import Model, Models, PlacedMeshes
from .meshes.tangents import corner_tangents, tangents_around
from .motion.movement import Layout, Movement
from .scene_contents import SceneContents, Source
from .transforms import normal_matrices
from .visibility import RAYS

_WALKED, _PLACED = 0.3, 0.6
"""Parts of the stage after which all is found, and all placed: the rest are materials that Cycles evaluates."""

BATCH = 500_000
"""Triangles that are placed together, unless one instance alone has more; bounds the memory for what is in between."""


@dataclass(frozen=True)
class SceneReading:
    """What was read of a dependency graph: everything but what Cycles has to render of a world and of lamps.

    Attributes
    ----------
    light_groups : LightGroups
        Those of the view layer.
    layout : Layout or None
        Which rows of the scene's arrays are which objects', to find them again at other times; None where nobody asked.
    materials : MaterialTable
        In which those of the scene are.
    """

    light_groups: LightGroups
    layout: Layout | None
    materials: MaterialTable
    _half_lit: Scene
    _nodes_of_lamps: list[LampNodes | None]
    _world: WorldReading
    _warnings: Warnings
    _light_group: str
    _for_camera: bool

    def scene(self, of: "bpy.types.Scene") -> Scene:
        """The whole scene; not while Cycles or anything else bakes. `of` is whose frame it is."""
        lights = with_patterns(self._half_lit.lights, self._nodes_of_lamps, of, self._warnings)
        world, suns = self._world.world(of, self._warnings)
        return reaching(replace(self._half_lit, lights=shining(lights, suns), world=world))

    def moved(self, depsgraph: "bpy.types.Depsgraph", progress: Progress) -> Movement:
        """Where everything is at another time, to which the graph was moved."""
        warn, for_camera = Warnings([]), self._for_camera
        assert self.layout is not None
        found = SceneContents(depsgraph, MaterialTable(warn, for_camera), self._light_group, for_camera, warn)
        found.walk(progress.part(0, 0.5))
        matrices = _matrices(depsgraph)
        placed = _place(found.sources, matrices, found.materials, progress.part(0.5, 1))
        return Movement.between(self._half_lit, self.layout, Layout.of(found, placed), placed, matrices)


def read_scene(
    depsgraph: "bpy.types.Depsgraph",
    warnings: list[str] | None = None,
    light_group: str = "",
    for_camera: bool = False,
    progress: Progress | None = None,
    moving: bool = False,
) -> SceneReading:
    """Everything that light meets in the scene of an evaluated dependency graph, in world space.

    Every mesh is evaluated and read once, however many instances it has. Instances, modifiers, curves, texts, surfaces
    and metaballs are included; what the graph does not show is left out, and so are objects that no rays of light see.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        `in_render_graph`'s for what renders show, ``context.evaluated_depsgraph_get()`` for what the viewport does.
    warnings : list of str, optional
        Sentences about what cannot be baked as it is are appended, each once.
    light_group : str
        The light group of the view layer that alone gives light; empty for all light.
    for_camera : bool
        Whether objects that only the camera sees are read too.
    progress : Progress, optional
    moving : bool
        Whether other times are to be read too, by `SceneReading.moved`.

    Returns
    -------
    SceneReading
        Of a scene that may have no triangles and no lights.

    Raises
    ------
    BakeError
        If there is no such light group.
    Cancelled
        If `progress` was cancelled.
    """
    warn, progress = Warnings(warnings), progress or Progress()
    _check_light_group(depsgraph.view_layer, light_group)
    materials = MaterialTable(warn, for_camera)
    found = SceneContents(depsgraph, materials, light_group, for_camera, warn)
    found.walk(progress.part(0, _WALKED))
    matrices = _matrices(depsgraph)
    placed = _place(found.sources, matrices, materials, progress.part(_WALKED, _PLACED))
    for name in dict.fromkeys(placed.lost_names):
        warn.add(f"Object '{name}' has vertices or a transform that are not finite: what of it is there is left out.")
    layout = Layout.of(found, placed) if moving else None
    left = placed.drop_degenerate()
    objects = list(compress((by for source in found.sources for by in source.placed_by), left))
    scene = Scene(
        vertices=placed.vertices,
        triangles=placed.triangles,
        corner_normals=placed.corner_normals,
        corner_uvs=placed.corner_uvs,
        material_of_triangle=placed.material_of_triangle,
        object_of_triangle=placed.object_of_triangle,
        materials=materials.materials(progress.part(_PLACED, 1)),
        objects=_objects(found.sources, left, depsgraph.view_layer, light_group, for_camera),
        lights=Lights.join(found.lights) if found.lights else Lights.none(),
        world=World.constant(0),
    )
    scene = replace(scene, frames=_frames(scene, placed, matrices, found.sources, left))
    instances = Instances(found.sources, matrices, left)
    clouds = read_clouds([(obj, matrices[row].astype(np.float64)) for obj, row in found.clouds], depsgraph, warn)
    scene = with_media(scene, materials.volumes, instances, depsgraph, world_of(depsgraph), clouds, warn)
    warn_of_missing_files(depsgraph, materials.readable_images, warn)
    linked, world = link_lights(scene, found.lamps, objects), read_world(depsgraph, light_group)
    linked = replace(linked, lights=with_places(linked.lights, world.n_suns, world.light.hidden_from))
    groups = _light_groups(depsgraph, found.groups_of_lamps, world.n_suns, objects)
    return SceneReading(groups, layout, materials, linked, found.nodes_of_lamps, world, warn, light_group, for_camera)


def read_objects(depsgraph: "bpy.types.Depsgraph", wanted: set[int]) -> tuple[MaterialTable, Layout, PlacedMeshes]:
    """The surfaces of objects of some session ids and of what they instance, and materials of their own table."""
    warn = Warnings([])
    materials = MaterialTable(warn)
    found = SceneContents(depsgraph, materials, "", False, warn)
    found.walk(Progress(), wanted)
    placed = _place(found.sources, _matrices(depsgraph), materials, Progress())
    return materials, Layout.of(found, placed), placed


def _frames(
    scene: Scene, placed: PlacedMeshes, matrices: np.ndarray, sources: list[Source], left: np.ndarray
) -> ShadingFrames:
    """What closures' own normals are given by."""
    frames = ShadingFrames.none()
    if placed.corner_tangents is not None:
        frames = replace(frames, corner_tangents=placed.corner_tangents)
    if (scene.materials.closures.normal_space == NormalSpace.OBJECT).any():
        rows = np.array([row for source in sources for row in source.rows], np.int64)[left]
        frames = replace(frames, normal_matrices=normal_matrices(matrices[rows].astype(np.float64)).astype(np.float32))
    return frames


def _light_groups(
    depsgraph: "bpy.types.Depsgraph", of_lamps: list[str], n_suns: int, objects: list[Placed]
) -> LightGroups:
    """The view layer's light groups, and which of them lamps, objects and the world with its suns are in."""
    names = tuple(group.name for group in depsgraph.view_layer.lightgroups)
    number = {name: i for i, name in enumerate(names)}
    of_objects = [number.get(light_group_of(*by), -1) for by in objects]
    of_world = number.get(light_group_of_world(depsgraph), -1)
    of_lamps_ = [*(number.get(name, -1) for name in of_lamps), *[of_world] * n_suns]
    return LightGroups(names, np.array(of_lamps_, np.int32), np.array(of_objects, np.int32), of_world)


def _check_light_group(view_layer: "bpy.types.ViewLayer", name: str) -> None:
    if name and name not in view_layer.lightgroups:
        there_are = ", ".join(f"'{group.name}'" for group in view_layer.lightgroups) or "none"
        raise BakeError(
            f"View layer '{view_layer.name}' has no light group '{name}' (there are: {there_are}): check the name."
        )


def _matrices(depsgraph: "bpy.types.Depsgraph") -> np.ndarray:
    """Matrices of a graph's instances, local to world, (n, 4, 4) float32."""
    instances = depsgraph.object_instances
    columns = np.empty((len(instances), 4, 4), np.float32)
    instances.foreach_get("matrix_world", columns.ravel())
    return columns.transpose(0, 2, 1)


def _place(sources: list[Source], matrices: np.ndarray, materials: MaterialTable, progress: Progress) -> PlacedMeshes:
    """All instances of all sources, which become objects in the sources' order."""
    n_copies = np.array([len(source.rows) for source in sources], np.int64)
    n_vertices = np.array([source.n_vertices for source in sources], np.int64)
    n_triangles = np.array([source.n_triangles for source in sources], np.int64)
    placed = PlacedMeshes(int(n_copies @ n_vertices), int(n_copies @ n_triangles))
    of_copy = np.repeat(np.arange(len(sources)), n_copies)
    rows = np.array([row for source in sources for row in source.rows], np.int64)
    names = [name for source in sources for name in source.names]
    reader = _Reader(materials)
    for batch in _batches(n_triangles[of_copy]):
        progress.update(READING, batch.start / len(of_copy))
        used, of_used = np.unique(of_copy[batch], return_inverse=True)
        models = Models([reader.model(sources[source]) for source in used])
        placed.add(models, of_used, matrices[rows[batch]], names[batch])
    return placed


def _batches(n_triangles: np.ndarray) -> Iterator[slice]:
    """Slices of copies that have some `BATCH` triangles together, and at least one copy each."""
    batch = np.cumsum(n_triangles) // BATCH
    ends = np.flatnonzero(np.diff(batch, append=-1)) + 1
    return (slice(start, end) for start, end in pairwise([0, *ends.tolist()]))


class _Reader:
    """Reads sources, and keeps the last mesh for the next one."""

    def __init__(self, materials: MaterialTable) -> None:
        self._materials = materials
        self._last: tuple[Source, Model] | None = None

    def model(self, source: Source) -> Model:
        """A source's mesh and materials as arrays."""
        if self._last and self._last[0] is source:
            return self._last[1]
        same = self._last is not None and self._last[0].mesh == source.mesh
        mesh = self._last[1].mesh if self._last and same else source.local_mesh()
        of_slot = np.full(max(source.material_of_slot) + 1, -1, np.int32)
        of_slot[list(source.material_of_slot)] = list(source.material_of_slot.values())
        uvs = self._corner_uvs(mesh, source.material_of_slot)
        model = Model(mesh, of_slot.take(mesh.material_slot), uvs, self._tangents(source, mesh))
        self._last = source, model
        return model

    def _tangents(self, source: Source, mesh: LocalMesh) -> np.ndarray | None:
        """Tangents that each triangle's material needs, (t, 3, 3, 3) float32; None where none needs any."""
        found: np.ndarray | None = None
        along = cache(lambda uv_map: corner_tangents(mesh, uv_map))
        for slot, material in source.material_of_slot.items():
            needed, on = self._materials.tangents(material), mesh.material_slot == slot
            if needed == Tangents(None, None) or not on.any():
                continue
            found = np.zeros((len(on), 3, 3, 3), np.float32) if found is None else found
            if needed.normals is not None:
                found[on, :, :2] = along(needed.normals)[on]
            if needed.stretched is not None and needed.stretched.uv_map is not None:
                found[on, :, 2] = along(needed.stretched.uv_map)[on, :, 0]
            elif needed.stretched is None:
                continue
            elif isinstance(source.mesh, Fibres):
                found[on, :, 2] = source.mesh.directions()[on]
            else:
                space = (np.array(one) for one in (source.mesh.texspace_location, source.mesh.texspace_size))
                found[on, :, 2] = tangents_around(mesh, needed.stretched.axis, *space)[on]
        return found

    def _corner_uvs(self, mesh: LocalMesh, material_of_slot: dict[int, int]) -> np.ndarray | None:
        """Texture coordinates that each triangle's material reads, (t, 3, 2) float32; None where none reads any."""
        uvs = None
        for slot, material in material_of_slot.items():
            coordinates = self._materials.coordinates(material)
            if coordinates is None:
                continue
            uvs = np.zeros((len(mesh.triangles), 3, 2), np.float32) if uvs is None else uvs
            on = mesh.material_slot == slot
            uvs[on] = coordinates.of_corners(mesh.uvs).take(mesh.corners[on], 0)
        return uvs


def _objects(
    sources: list[Source],
    left: np.ndarray,
    view_layer: "bpy.types.ViewLayer",
    light_group: str,
    for_camera: bool,
) -> SceneObjects:
    """The instances that are left of the sources'."""
    placed_by = [by for source in sources for by in source.placed_by]
    held_out = [for_camera and by[0].holdout_get(view_layer=view_layer) for by in placed_by]
    names = [name for source in sources for name in source.names]
    rays = np.array([mask for source in sources for mask in source.rays], np.int64)[left]
    seen = {name: (rays >> bit & 1).astype(bool) for bit, name in enumerate(RAYS)}
    fibrous = np.array([isinstance(source.mesh, Fibres) for source in sources for _ in source.rows], bool)[left]
    return SceneObjects(
        names=tuple(compress(names, left)),
        scatters=seen["diffuse"],
        casts_shadow=seen["shadow"],
        seen_in_gloss=seen["glossy"],
        seen_through_glass=seen["transmission"],
        seen_by_camera=seen["camera" if for_camera else "diffuse"],
        emits=np.array([in_light_group(*by, light_group) for by in placed_by], bool)[left],
        held_out=np.array(held_out, bool)[left],
        fibrous=fibrous if fibrous.any() else None,
    )
