"""A Blender scene as a `Scene`."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import compress, pairwise

import bpy
import numpy as np

from ..errors import BakeError
from ..scene import Lights, Scene, SceneObjects
from .lamps import in_light_group, read_lamp
from .light_links import Placed, link_lights
from .materials import MaterialTable
from .meshes import LocalMesh, count_triangles, read_mesh, used_slots
from .placing import Model, Models, PlacedMeshes
from .visibility import (
    ALL_RAYS,
    LIGHT_RAYS,
    NOT_READ,
    RAYS,
    ObjectVisibility,
    RenderVisibility,
    has_hair,
    warn_of_hair,
    warn_of_modifiers,
)
from .warn import Warnings
from .world import read_world

BATCH = 500_000
"""Triangles that are placed together, unless one instance alone has more; bounds the memory for what is in between."""


def extract_scene(
    depsgraph: "bpy.types.Depsgraph",
    warnings: list[str] | None = None,
    light_group: str = "",
    for_camera: bool = False,
) -> Scene:
    """Everything that light meets in the scene of an evaluated dependency graph, in world space.

    Every mesh is evaluated and read once, however many instances it has. Instances, modifiers, curves, texts, surfaces
    and metaballs are included; what renders do not show is left out, and so are objects that no rays of light see.
    What `visibility` says of objects hidden in the viewport holds.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        From ``context.evaluated_depsgraph_get()``, or a render engine's.
    warnings : list of str, optional
        Sentences about what cannot be baked as it is are appended, each once.
    light_group : str
        The light group of the view layer that alone gives light; empty for all light.
    for_camera : bool
        Whether objects that only the camera sees are read too.

    Returns
    -------
    Scene
        It may have no triangles and no lights.

    Raises
    ------
    BakeError
        If an object is in edit mode or has coordinates that are not finite, an image file is missing, or there is no
        such light group.
    """
    warn = Warnings(warnings)
    _check_light_group(depsgraph.view_layer, light_group)
    visibility = RenderVisibility(depsgraph.view_layer)
    if depsgraph.mode == "VIEWPORT":
        visibility.warn_of_missing(depsgraph.view_layer, warn)
    materials = MaterialTable(warn)
    found = _Found(visibility, materials, depsgraph.view_layer.material_override, light_group, for_camera, warn)
    found.walk(depsgraph)
    if depsgraph.mode == "VIEWPORT":
        warn_of_modifiers(found.shown, depsgraph.scene, warn)
    warn_of_hair(found.hairy, warn)
    placed = _place(found.sources, _matrices(depsgraph), materials)
    left = placed.drop_degenerate()
    objects = [placed_by for source in found.sources for placed_by in source.placed_by]
    scene = Scene(
        vertices=placed.vertices,
        triangles=placed.triangles,
        corner_normals=placed.corner_normals,
        corner_uvs=placed.corner_uvs,
        material_of_triangle=placed.material_of_triangle,
        object_of_triangle=placed.object_of_triangle,
        materials=materials.materials(),
        objects=_objects(found.sources, left, light_group, for_camera),
        lights=Lights.join(found.lights) if found.lights else Lights.none(),
        world=read_world(depsgraph, warn, light_group),
    )
    return link_lights(scene, found.lamps, list(compress(objects, left)), warn)


def _check_light_group(view_layer: "bpy.types.ViewLayer", name: str) -> None:
    if name and name not in view_layer.lightgroups:
        there_are = ", ".join(f"'{group.name}'" for group in view_layer.lightgroups) or "none"
        raise BakeError(
            f"View layer '{view_layer.name}' has no light group '{name}' (there are: {there_are}): check the name."
        )


@dataclass
class _Source:
    """A mesh with its materials, and its instances; the lists have one entry an instance.

    Attributes
    ----------
    mesh : bpy.types.Mesh
        With faces.
    material_of_slot : dict of int to int
        Of the slots that faces use.
    rows : list of int
        Which of the dependency graph's instances they are.
    names : list of str
    rays : list of int
        Masks of the `RAYS` that see them.
    placed_by : list of Placed
    """

    mesh: "bpy.types.Mesh"
    material_of_slot: dict[int, int]
    rows: list[int] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    rays: list[int] = field(default_factory=list)
    placed_by: list[Placed] = field(default_factory=list)


@dataclass
class _Look:
    """What the instances of an object with one data-block have in common; `source` is known once rays see one."""

    kind: str
    name: str
    visibility: ObjectVisibility
    shown: bool
    known: bool = False
    source: _Source | None = None


class _Found:
    """The lamps and meshes of a dependency graph.

    Of its instances there may be very many, and asking Blender is slow: what they have in common is asked once.
    """

    def __init__(
        self,
        visibility: RenderVisibility,
        materials: MaterialTable,
        material_override: "bpy.types.Material | None",
        light_group: str,
        for_camera: bool,
        warnings: Warnings,
    ) -> None:
        self.lights: list[Lights] = []
        self.lamps: list[bpy.types.Object] = []
        self._light_group = light_group
        self._counted_rays = ALL_RAYS if for_camera else LIGHT_RAYS
        self._visibility = visibility
        self._materials = materials
        self._override = material_override
        self._warnings = warnings
        self._looks: dict[tuple[bpy.types.Object, bpy.types.ID | None], _Look] = {}
        self._parents: dict[bpy.types.Object, ObjectVisibility] = {}
        self._used_slots: dict[bpy.types.Mesh, list[int]] = {}
        self._sources: dict[bpy.types.Mesh, dict[tuple[int, ...], _Source]] = {}

    @property
    def sources(self) -> list[_Source]:
        """The sources of one mesh follow each other."""
        return [source for of_mesh in self._sources.values() for source in of_mesh.values()]

    @property
    def shown(self) -> list["bpy.types.Object"]:
        """The original objects that renders show, or what they instance."""
        return list(dict.fromkeys(look.visibility.original for look in self._looks.values() if look.shown))

    @property
    def hairy(self) -> list["bpy.types.Object"]:
        """Those of them that have hair, points or a volume."""
        unread = {look.visibility.original for look in self._looks.values() if look.shown and look.kind in NOT_READ}
        return [obj for obj in self.shown if obj in unread or has_hair(obj)]

    def walk(self, depsgraph: "bpy.types.Depsgraph") -> None:
        """Find all there is."""
        for row, instance in enumerate(depsgraph.object_instances):
            obj = instance.object
            key = (obj.original, obj.data)
            look = self._looks.get(key)
            if look is None:
                visibility = self._visibility.of(obj)
                look = self._looks[key] = _Look(obj.type, obj.name, visibility, visibility.shown)
            parent = self._of_parent(instance.parent)
            rays = look.visibility.rays_through(parent)
            if rays is None:
                continue
            look.shown = True
            if look.kind not in {"MESH", "LIGHT"}:
                continue
            placed_by = look.visibility.original, parent.original if parent else None
            if look.kind == "LIGHT":
                self._add_lamp(instance, look.name, placed_by)
            elif rays & self._counted_rays:
                if not look.known:
                    look.known, look.source = True, self._source(obj)
                if look.source is not None:
                    look.source.rows.append(row)
                    look.source.names.append(look.name)
                    look.source.rays.append(rays)
                    look.source.placed_by.append(placed_by)

    def _add_lamp(self, instance: "bpy.types.DepsgraphObjectInstance", name: str, placed_by: Placed) -> None:
        if in_light_group(*placed_by, self._light_group):
            lamp = read_lamp(instance.object, np.array(instance.matrix_world, np.float64), name, self._warnings)
            self.lights.append(lamp)
            self.lamps += [placed_by[0]] * len(lamp)

    def _of_parent(self, parent: "bpy.types.Object | None") -> ObjectVisibility | None:
        if parent is None:
            return None
        if parent not in self._parents:
            self._parents[parent] = self._visibility.of(parent)
        return self._parents[parent]

    def _source(self, obj: "bpy.types.Object") -> _Source | None:
        """The source that a mesh object's instances share with those of all others like it; None without faces."""
        if obj.original.type == "MESH" and obj.original.mode == "EDIT":
            raise BakeError(f"Object '{obj.name}' is in edit mode: leave edit mode to bake.")
        mesh = obj.data
        if not len(mesh.polygons):
            return None
        material_of_slot = self._material_of_slot(obj)
        of_mesh = self._sources.setdefault(mesh, {})
        return of_mesh.setdefault(tuple(material_of_slot.values()), _Source(mesh, material_of_slot))

    def _material_of_slot(self, obj: "bpy.types.Object") -> dict[int, int]:
        """Material of each slot that an object's faces use. Slots past the last one mean the last."""
        mesh = obj.data
        if mesh not in self._used_slots:
            self._used_slots[mesh] = used_slots(mesh)
        slots = [self._override] if self._override else [slot.material for slot in obj.material_slots] or [None]
        return {used: self._materials.add(slots[min(used, len(slots) - 1)], obj) for used in self._used_slots[mesh]}


def _matrices(depsgraph: "bpy.types.Depsgraph") -> np.ndarray:
    """Matrices of a graph's instances, local to world, (n, 4, 4) float32."""
    instances = depsgraph.object_instances
    columns = np.empty((len(instances), 4, 4), np.float32)
    instances.foreach_get("matrix_world", columns.ravel())
    return columns.transpose(0, 2, 1)


def _place(sources: list[_Source], matrices: np.ndarray, materials: MaterialTable) -> PlacedMeshes:
    """All instances of all sources; they become objects in the sources' order."""
    n_copies = np.array([len(source.rows) for source in sources], np.int64)
    n_vertices = np.array([len(source.mesh.vertices) for source in sources], np.int64)
    n_triangles = np.array([count_triangles(source.mesh) for source in sources], np.int64)
    placed = PlacedMeshes(int(n_copies @ n_vertices), int(n_copies @ n_triangles))
    of_copy = np.repeat(np.arange(len(sources)), n_copies)
    rows = np.array([row for source in sources for row in source.rows], np.int64)
    names = [name for source in sources for name in source.names]
    reader = _Reader(materials)
    for batch in _batches(n_triangles[of_copy]):
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
        self._last: tuple[_Source, Model] | None = None

    def model(self, source: _Source) -> Model:
        """A source's mesh and materials as arrays."""
        if self._last and self._last[0] is source:
            return self._last[1]
        same = self._last is not None and self._last[0].mesh == source.mesh
        mesh = self._last[1].mesh if self._last and same else read_mesh(source.mesh)
        of_slot = np.full(max(source.material_of_slot) + 1, -1, np.int32)
        of_slot[list(source.material_of_slot)] = list(source.material_of_slot.values())
        model = Model(mesh, of_slot.take(mesh.material_slot), self._corner_uvs(mesh, source.material_of_slot))
        self._last = source, model
        return model

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


def _objects(sources: list[_Source], left: np.ndarray, light_group: str, for_camera: bool) -> SceneObjects:
    """The instances that are left of the sources'."""
    names = [name for source in sources for name in source.names]
    rays = np.array([mask for source in sources for mask in source.rays], np.int64)[left]
    seen = {name: (rays >> bit & 1).astype(bool) for bit, name in enumerate(RAYS)}
    return SceneObjects(
        names=tuple(compress(names, left)),
        scatters=seen["diffuse"],
        casts_shadow=seen["shadow"],
        seen_in_gloss=seen["glossy"],
        seen_through_glass=seen["transmission"],
        seen_by_camera=seen["camera" if for_camera else "diffuse"],
        emits=np.array([in_light_group(*by, light_group) for source in sources for by in source.placed_by], bool)[left],
    )
