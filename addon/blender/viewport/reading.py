"""A scene as live light reads it: once all of it, and then what changes by itself."""

from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import compress
from typing import Any

import bpy
import numpy as np

from ...scene import Lights, Materials, Scene, World
from ..read.lamps.lamp_nodes import with_patterns
from ..read.lamps.lamps import read_lamp
from ..read.lamps.light_links import link_lights
from ..read.lamps.sky_suns import shining, with_places
from ..read.lamps.world import read_world
from ..read.materials.materials import MaterialTable
from ..read.meshes.placing import PlacedMeshes
from ..read.render_graph import is_stand_in
from ..read.scene import read_objects, read_scene
from ..warn import Warnings


@dataclass(frozen=True)
class Shape:
    """What an object of the scene looks like now: t triangles in the scene's order, as `ObjectReshaped` has them.

    Attributes
    ----------
    corners, corner_normals : (t, 3, 3) float32
    corner_tangents : (t, 3, 3, 3) or (0, 3, 3, 3) float32
    matrix : (4, 4) float64
        Local to world.
    """

    corners: np.ndarray
    corner_normals: np.ndarray
    corner_tangents: np.ndarray
    matrix: np.ndarray


InstanceKey = tuple[int, int, tuple[int, ...]]
"""Session ids of an object and of what instances it, 0 for nothing, and which instance it is."""


@dataclass
class LiveReading:
    """What was read; holds no references to Blender's data.

    Attributes
    ----------
    scene : Scene
        As it was read, but for lamps, world and materials, which are the newest.
    objects : dict of InstanceKey to list of int
        Which of the scene's objects each instance is.
    owners : (o,) int64
        Session id of the object that a view shows or hides each by: the one that instances it, or itself.
    matrices : (o, 4, 4) float64
        Local to world, as read.
    faces : list of bytes
        Digest of the faces of each.
    n_suns : int
        Of the world, which are the last lamps.
    table : MaterialTable
    """

    scene: Scene
    objects: dict[InstanceKey, list[int]]
    owners: np.ndarray
    matrices: np.ndarray
    faces: list[bytes]
    n_suns: int
    table: MaterialTable

    @staticmethod
    def of(depsgraph: "bpy.types.Depsgraph", scene: "bpy.types.Scene") -> "LiveReading":
        """All of what a viewport's evaluated graph of a scene shows; not while Cycles renders or bakes."""
        reading = read_scene(depsgraph, moving=True)
        layout = reading.layout
        assert layout is not None
        whole = np.bincount(layout.object_of_triangle[layout.whole], minlength=len(layout.keys)) > 0
        rows = layout.instance[whole]
        keys, matrices = _instances(depsgraph, rows)
        n_suns = read_world(depsgraph).n_suns
        read = reading.scene(scene)  # Cycles may work on data of our own, after which the graph is another one
        objects: dict[InstanceKey, list[int]] = {}
        for number, key in enumerate(keys):
            objects.setdefault(key, []).append(number)
        owners = np.array([parent or own for own, parent, _ in keys], np.int64)
        faces = list(compress(layout.topology, whole))
        return LiveReading(read, objects, owners, matrices, faces, n_suns, reading.materials)

    @property
    def gives_light(self) -> bool:
        """Whether a lamp, a surface or the world emits light."""
        scene = self.scene
        return bool(scene.lights.emission.any() or scene.shines.any() or not scene.world.black)

    def lamps(self, depsgraph: "bpy.types.Depsgraph", scene: "bpy.types.Scene") -> Lights | None:
        """All lamps as they are now; None where light linking has a say, for which objects have to be known."""
        warn, found, nodes, originals = Warnings(), [Lights.none()], [], []
        for instance in depsgraph.object_instances:
            obj = instance.object
            if obj.type != "LIGHT" or not instance.show_self or is_stand_in(obj.original):
                continue
            lamp = read_lamp(obj, np.array(instance.matrix_world, np.float64), obj.name, warn)
            found.append(lamp.lights)
            nodes += [lamp.nodes] * len(lamp.lights)
            originals += [obj.original] * len(lamp.lights)
        if self.scene.objects.links is not None or any(_is_linked(lamp) for lamp in originals):
            return None
        unknown: list[Any] = [(None, None)] * len(self.scene.objects.names)
        lights = link_lights(replace(self.scene, lights=Lights.join(found)), originals, unknown).lights
        lights = with_patterns(lights, nodes, scene, warn)
        n, world = self.n_suns, self.scene.world
        if n == 0:
            return lights
        suns = self.scene.lights.where(np.arange(len(self.scene.lights) - n, len(self.scene.lights)))
        joined = with_places(lights, n, world.hidden_from)
        columns = {
            name: getattr(joined, name).copy() for name in ("emission", "axis_x", "axis_y", "direction", "angle")
        }
        for name, column in columns.items():
            column[-n:] = getattr(suns, name)
        return replace(joined, **columns)

    def world(self, depsgraph: "bpy.types.Depsgraph", scene: "bpy.types.Scene") -> tuple[World, Lights]:
        """The world as it is now, and all lamps with its suns."""
        reading = read_world(depsgraph)
        lights, n = self.scene.lights, reading.n_suns
        lamps = lights.where(np.arange(len(lights) - self.n_suns))
        world, suns = reading.world(scene, Warnings())
        self.n_suns = n
        return world, shining(with_places(lamps, n, reading.light.hidden_from), suns)

    def materials(self, depsgraph: "bpy.types.Depsgraph", changed: set[int]) -> Materials | None:
        """All materials, of which those with some session ids are read anew; None where all has to be."""
        blocks = [one for one in bpy.data.materials if one.session_uid in changed]
        return self.table.renewed([block.evaluated_get(depsgraph) for block in blocks])

    def moved(self, depsgraph: "bpy.types.Depsgraph", changed: set[int]) -> dict[int, np.ndarray] | None:
        """Where objects are that changed, or that others instance that did: from where the scene has them, (4, 4) each.

        None where one of them has no volume now, so that it has to be dropped.
        """
        found: dict[int, np.ndarray] = {}
        placed = {key: numbers for key, numbers in self.objects.items() if key[0] in changed or key[1] in changed}
        if all(key[1] == 0 for key in placed):
            by_uid = {obj.session_uid: obj for obj in depsgraph.view_layer.objects}
            for (uid, _, _), numbers in placed.items():
                if uid in by_uid:
                    matrix = np.array(by_uid[uid].evaluated_get(depsgraph).matrix_world, np.float64)
                    found |= dict.fromkeys(numbers, matrix)
        else:
            for instance in depsgraph.object_instances:
                for number in placed.get(_key(instance), []):
                    found[number] = np.array(instance.matrix_world, np.float64)
        if any(abs(np.linalg.det(matrix[:3, :3])) < 1e-18 for matrix in found.values()):
            return None
        return {number: matrix @ np.linalg.inv(self.matrices[number]) for number, matrix in found.items()}

    def reshaped(self, depsgraph: "bpy.types.Depsgraph", changed: set[int]) -> dict[int, Shape] | None:
        """Objects that have another shape, of those that changed; None where there are others, or of other faces."""
        wanted = {key for key in self.objects if key[0] in changed or key[1] in changed}
        if any(key[1] in changed for key in wanted) or len(self.scene.frames.normal_matrices):
            return None
        table, layout, placed = read_objects(depsgraph, changed)
        keys, matrices = _instances(depsgraph, layout.instance)
        if set(keys) != wanted or len(keys) != len(wanted) or placed.lost_names or not layout.whole.all():
            return None
        of_material, found = np.array([*table.numbers_in(self.table), -1], np.int32), {}
        for row, (key, matrix) in enumerate(zip(keys, matrices, strict=True)):
            number, *others = self.objects[key]
            first, n = layout.first_triangle[row], layout.n_triangles[row]
            mirrored = np.linalg.det(matrix[:3, :3]) * np.linalg.det(self.matrices[number][:3, :3]) < 0
            if others or mirrored or layout.topology[row] != self.faces[number]:
                return None
            shape = self._shape(number, placed, slice(first, first + n), of_material, matrix)
            if shape is None:
                return None
            found[number] = shape
        return found

    def _shape(
        self, number: int, placed: PlacedMeshes, now: slice, of_material: np.ndarray, matrix: np.ndarray
    ) -> Shape | None:
        """An object's shape by rows of what was read; None where its surface looks otherwise."""
        scene = self.scene
        own = np.flatnonzero(scene.object_of_triangle == number)
        if len(own) != now.stop - now.start:
            return None
        same = np.array_equal(of_material[placed.material_of_triangle[now]], scene.material_of_triangle[own])
        if not same or not np.array_equal(placed.corner_uvs[now], scene.corner_uvs[own]):
            return None
        tangents = np.zeros((len(own) if len(scene.frames.corner_tangents) else 0, 3, 3, 3), np.float32)
        if len(tangents) and placed.corner_tangents is not None:
            tangents = placed.corner_tangents[now].copy()
        corners = placed.vertices[placed.triangles[now]]
        return Shape(corners, placed.corner_normals[now].copy(), tangents, matrix)

    def has(self, number: int, shape: Shape) -> bool:
        """Whether the scene has an object in a shape."""
        own, scene = self.scene.object_of_triangle == number, self.scene
        same = np.array_equal(scene.vertices[scene.triangles[own]], shape.corners)
        return same and np.array_equal(scene.corner_normals[own], shape.corner_normals)

    def reshape(self, shapes: dict[int, Shape]) -> None:
        """Take objects' shapes over: the scene has these from now on, where they are."""
        scene = self.scene
        vertices, normals = scene.vertices.copy(), scene.corner_normals.copy()
        tangents, self.matrices = scene.frames.corner_tangents.copy(), self.matrices.copy()
        for number, shape in shapes.items():
            own = np.flatnonzero(scene.object_of_triangle == number)
            vertices[scene.triangles[own].ravel()] = shape.corners.reshape(-1, 3)
            normals[own], self.matrices[number] = shape.corner_normals, shape.matrix
            if len(tangents):
                tangents[own] = shape.corner_tangents
        frames = replace(scene.frames, corner_tangents=tangents)
        self.scene = replace(scene, vertices=vertices, corner_normals=normals, frames=frames)


def _is_linked(lamp: "bpy.types.Object") -> bool:
    linking = getattr(lamp, "light_linking", None)
    return bool(linking and (linking.receiver_collection or linking.blocker_collection))


def _key(instance: "bpy.types.DepsgraphObjectInstance") -> InstanceKey:
    own = instance.object.original.session_uid
    if not instance.is_instance:
        return own, 0, ()
    return own, instance.parent.original.session_uid if instance.parent else 0, tuple(instance.persistent_id)


def _instances(depsgraph: "bpy.types.Depsgraph", rows: np.ndarray) -> tuple[list[InstanceKey], np.ndarray]:
    """Keys and matrices (n, 4, 4) of some of a graph's instances."""
    wanted = set(rows.tolist())
    found = {
        row: (_key(instance), np.array(instance.matrix_world, np.float64))
        for row, instance in enumerate(depsgraph.object_instances)
        if row in wanted
    }
    keys = [found[row][0] for row in rows.tolist()]
    return keys, np.array([found[row][1] for row in rows.tolist()]).reshape(-1, 4, 4)


def equal(one: Any, other: Any) -> bool:
    """Whether two dataclasses of arrays hold the same."""
    if one is other:
        return True
    if is_dataclass(one) and type(one) is type(other):
        return all(equal(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return one.shape == other.shape and bool((one == other).all())
    if isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        return all(equal(*pair) for pair in zip(one, other, strict=True))
    return type(one) is type(other) and bool(one == other)


def same_surfaces(one: Scene, other: Scene) -> bool:
    """Whether two scenes have the same surfaces of the same materials, and differ in lamps and world at most."""
    names = [field.name for field in fields(Scene) if field.name not in ("lights", "world")]
    return all(equal(getattr(one, name), getattr(other, name)) for name in names)
