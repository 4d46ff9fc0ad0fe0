"""A Blender scene as a `Scene`."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..errors import BakeError
from ..scene import Lights, Scene, SceneObjects, World
from .lamps import read_lamp
from .materials import MaterialTable
from .meshes import LocalMesh, PlacedMesh, place, read_mesh
from .visibility import RenderVisibility
from .warn import Warnings
from .world import read_world


def extract_scene(depsgraph: "bpy.types.Depsgraph", warnings: list[str] | None = None) -> Scene:
    """Everything that light meets in the scene of an evaluated dependency graph, in world space.

    Every mesh is evaluated and read once, however many instances it has. Instances, modifiers, curves, texts, surfaces
    and metaballs are included; what renders do not show is left out, and so are objects that neither diffuse nor shadow
    rays see. What `visibility` says of objects hidden in the viewport holds.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        From ``context.evaluated_depsgraph_get()``, or a render engine's.
    warnings : list of str, optional
        Sentences about what cannot be baked as it is are appended, each once.

    Returns
    -------
    Scene
        It may have no triangles and no lights.

    Raises
    ------
    BakeError
        If an object is in edit mode or has coordinates that are not finite, or an image file is missing.
    """
    warn = Warnings(warnings)
    view_layer = depsgraph.view_layer
    visibility = RenderVisibility(view_layer)
    if depsgraph.mode == "VIEWPORT":
        visibility.warn_of_missing(view_layer, warn)
    gathered = _Gathered(MaterialTable(warn), view_layer.material_override)
    for instance in depsgraph.object_instances:
        kind = instance.object.type
        if kind not in {"MESH", "LIGHT"} or not visibility.shows_instance(instance):
            continue
        if kind == "LIGHT":
            matrix = np.array(instance.matrix_world, np.float64)
            gathered.lights.append(read_lamp(instance.object, matrix, instance.object.name, warn))
        else:
            gathered.add_mesh(instance)
    return gathered.scene(read_world(depsgraph.scene.world, warn))


@dataclass
class _Gathered:
    """What was found so far; the lists have one entry an object."""

    materials: MaterialTable
    material_override: "bpy.types.Material | None" = None
    lights: list[Lights] = field(default_factory=list)
    meshes: dict[int, LocalMesh | None] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    scatters: list[bool] = field(default_factory=list)
    casts_shadow: list[bool] = field(default_factory=list)
    placed: list[PlacedMesh] = field(default_factory=list)
    material_of_triangle: list[np.ndarray] = field(default_factory=list)
    corner_uvs: list[np.ndarray] = field(default_factory=list)

    def add_mesh(self, instance: "bpy.types.DepsgraphObjectInstance") -> None:
        """Add an instance of a mesh, if light can meet it."""
        obj, parent = instance.object, instance.parent
        seers = [obj, parent] if instance.is_instance and parent is not None else [obj]
        scatters = all(one.visible_diffuse for one in seers)
        casts_shadow = all(one.visible_shadow for one in seers)
        if not scatters and not casts_shadow:
            return
        if obj.original.type == "MESH" and obj.original.mode == "EDIT":
            raise BakeError(f"Object '{obj.name}' is in edit mode: leave edit mode to bake.")
        key = obj.data.as_pointer()
        if key not in self.meshes:
            self.meshes[key] = read_mesh(obj.data)
        mesh = self.meshes[key]
        if mesh is None:
            return
        placed = place(mesh, np.array(instance.matrix_world, np.float64), obj.name)
        if not len(placed.triangles):
            return
        material_of_slot = self._material_of_slot(obj, mesh)
        self.names.append(obj.name)
        self.scatters.append(scatters)
        self.casts_shadow.append(casts_shadow)
        self.placed.append(placed)
        self.material_of_triangle.append(material_of_slot[placed.material_slot])
        self.corner_uvs.append(self._corner_uvs(mesh, placed, material_of_slot))

    def _material_of_slot(self, obj: "bpy.types.Object", mesh: LocalMesh) -> np.ndarray:
        """Material of each slot that the mesh's faces may name, (s,) int32. Slots past the last one mean the last."""
        slots = [self.material_override] if self.material_override else [slot.material for slot in obj.material_slots]
        slots = slots or [None]
        of_slot = np.full(int(mesh.used_slots[-1]) + 1, -1, np.int32)
        for slot in mesh.used_slots:
            of_slot[slot] = self.materials.add(slots[min(max(int(slot), 0), len(slots) - 1)])
        return of_slot

    def _corner_uvs(self, mesh: LocalMesh, placed: PlacedMesh, material_of_slot: np.ndarray) -> np.ndarray:
        """Texture coordinates that each triangle's material reads, (t, 3, 2) float32."""
        uvs = np.zeros((len(placed.triangles), 3, 2), np.float32)
        for slot in mesh.used_slots:
            coordinates = self.materials.coordinates(int(material_of_slot[slot]))
            if coordinates is None:
                continue
            on = placed.material_slot == slot
            read = mesh.uvs.corners(coordinates.uv_map)[placed.corners[on]]
            uvs[on] = read @ coordinates.matrix.T + coordinates.offset
        return uvs

    def scene(self, world: World) -> Scene:
        """All of it, end to end."""
        first_vertex = np.cumsum([0] + [len(mesh.vertices) for mesh in self.placed])
        n_triangles = [len(mesh.triangles) for mesh in self.placed]
        return Scene(
            vertices=_join([mesh.vertices for mesh in self.placed], (0, 3), np.float32),
            triangles=_join(
                [mesh.triangles + first for mesh, first in zip(self.placed, first_vertex, strict=False)],
                (0, 3),
                np.int32,
            ),
            corner_normals=_join([mesh.corner_normals for mesh in self.placed], (0, 3, 3), np.float32),
            corner_uvs=_join(self.corner_uvs, (0, 3, 2), np.float32),
            material_of_triangle=_join(self.material_of_triangle, (0,), np.int32),
            object_of_triangle=np.repeat(np.arange(len(self.placed), dtype=np.int32), n_triangles),
            materials=self.materials.materials(),
            objects=SceneObjects(
                tuple(self.names),
                np.array(self.scatters, bool),
                np.array(self.casts_shadow, bool),
                np.array(self.scatters, bool),
                np.array(self.scatters, bool),
                np.ones(len(self.names), bool),
            ),
            lights=Lights.join(self.lights) if self.lights else Lights.none(),
            world=world,
        )


def _join(parts: list[np.ndarray], empty: tuple[int, ...], dtype: type) -> np.ndarray:
    """Arrays one after the other."""
    return np.concatenate(parts).astype(dtype, copy=False) if parts else np.zeros(empty, dtype)
