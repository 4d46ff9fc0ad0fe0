"""What nodes read of objects, instances, the scene and its view layer: values that are the same all over a surface."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from ..materials.nodes import Place, all_nodes

NO_INSTANCE = 2**31 - 1
"""Fills up an instance's persistent_id."""

WIDTH_OF = {"FLOAT": 1, "INT": 1, "INT8": 1, "BOOLEAN": 1, "FLOAT2": 2, "FLOAT_VECTOR": 3, "FLOAT_COLOR": 4}
WIDTH_OF |= {"BYTE_COLOR": 4}


@dataclass(frozen=True, order=True)
class Reading:
    """What a node's output reads.

    Attributes
    ----------
    of : str
        VIEW_LAYER, OBJECT or INSTANCER for an Attribute node, INFO for an Object Info node, HAIR for a Hair Info node.
    name : str
        Of the attribute, or the output's identifier.
    """

    of: str
    name: str

    @property
    def differs_by_instance(self) -> bool:
        """Whether instances of one object may have different values."""
        return self.of == "INSTANCER" or (self.of == "INFO" and self.name in {"Random", "Location"})


Values = Callable[[Reading], np.ndarray | None]
"""The value of a reading, (4,) float32, or None where it is not known."""


def reading_of(output: "bpy.types.NodeSocket") -> Reading | None:
    """What an output reads of its surroundings; None where it does something else."""
    node = output.node
    if node.type == "ATTRIBUTE" and node.attribute_type in {"VIEW_LAYER", "OBJECT", "INSTANCER"}:
        return Reading(node.attribute_type, node.attribute_name)
    if node.type == "HAIR_INFO" and output.identifier in {"Is Strand", "Length", "Thickness"}:
        return Reading("HAIR", output.identifier)
    return Reading("INFO", output.identifier) if node.type == "OBJECT_INFO" else None


def readings_in(tree: "bpy.types.NodeTree") -> list[Reading]:
    """What the linked outputs of a tree and its groups read, in order."""
    linked = [output for node in all_nodes(tree) for output in node.outputs if output.is_linked]
    return sorted({reading for reading in map(reading_of, linked) if reading})


def read_by(place: Place, values: Values) -> np.ndarray | None:
    """The value of an output that reads something, (1 or 3,) float32; None where it does not, or what is not known."""
    reading = reading_of(place.socket)
    value = values(reading) if reading else None
    if reading is None or value is None:
        return None
    if place.socket.type in {"RGBA", "VECTOR"}:
        return value[:3]
    if reading.of in {"INFO", "HAIR"}:
        return value[:1]
    return value[3:] if place.socket.identifier == "Alpha" else value[:3].mean(keepdims=True)


def of_scene(reading: Reading) -> np.ndarray | None:
    """The `Values` of no object in particular: what the scene that is baked says."""
    if reading.of != "VIEW_LAYER":
        return None
    scene, layer = bpy.context.scene, bpy.context.view_layer
    return _first(reading.name, (layer, scene, scene.world))


@dataclass(frozen=True)
class ObjectValues:
    """The `Values` of an instance.

    Attributes
    ----------
    obj : bpy.types.Object
        Evaluated; of an instance, the instanced one.
    location : (3,) float
        In the world.
    random : float
        In [0, 1].
    index : tuple of int
        Which instance it is at each level, innermost first; empty where it is none.
    instancers : tuple
        What may give an instance its attributes, besides geometry: a particle system's settings, an evaluated object.
    known : dict of Reading to (4,) float32
        What is known already.
    """

    obj: "bpy.types.Object"
    location: tuple[float, ...]
    random: float
    index: tuple[int, ...] = ()
    instancers: tuple = ()
    known: dict[Reading, np.ndarray | None] = field(default_factory=dict)

    @staticmethod
    def of(instance: "bpy.types.DepsgraphObjectInstance", known: dict[Reading, np.ndarray | None]) -> "ObjectValues":
        """Of what a dependency graph's iterator is at."""
        obj, location = instance.object, tuple(instance.matrix_world.translation)
        if not instance.is_instance:
            return ObjectValues(obj, location, random_of_name(obj.name), known=known)
        random = (instance.random_id & 0xFFFFFFFF) / 0xFFFFFFFF
        index = tuple(i for i in instance.persistent_id if i != NO_INSTANCE)
        particles = instance.particle_system
        instancers = ((particles.settings,) if particles else ()) + (instance.parent,)
        return ObjectValues(obj, location, random, index, instancers, known)

    def __call__(self, reading: Reading) -> np.ndarray | None:
        """As Cycles finds it, zero where there is nothing of that name."""
        if reading not in self.known:
            self.known[reading] = self._found(reading)
        return self.known[reading]

    def _found(self, reading: Reading) -> np.ndarray | None:
        if reading.of == "INFO":
            return self._info(reading.name)
        if reading.of == "HAIR":  # that is for strands to say
            return np.zeros(4, np.float32)
        if reading.of == "VIEW_LAYER":
            return of_scene(reading)
        own = (self.obj, self.obj.data)
        if reading.of == "OBJECT" or not self.instancers:
            return _first(reading.name, own)
        *particles, parent = self.instancers
        of_geometry = _of_geometry(parent, self.index, reading.name)
        if particles or of_geometry is None:
            return _first(reading.name, (*self.instancers, *own))
        return of_geometry

    def _info(self, name: str) -> np.ndarray | None:
        """An output of an Object Info node. A material's own index is not the object's to say."""
        color = tuple(self.obj.color)
        numbers = {"Object Index": self.obj.pass_index, "Random": self.random, "Alpha": color[3]}
        if name in numbers:
            return np.full(4, numbers[name], np.float32)
        vectors = {"Color": color[:3], "Location": self.location}
        return np.array([*vectors[name], 1], np.float32) if name in vectors else None


def _first(name: str, blocks: Iterable) -> np.ndarray:
    """The first value of a name that some of Blender's structs have, as a custom property or as one of their own."""
    for block in blocks:
        value = _property(block, name) if block is not None else None
        if value is not None:
            return value
    return np.zeros(4, np.float32)


def _property(block: "bpy.types.bpy_struct", name: str) -> np.ndarray | None:
    for path in (f'["{bpy.utils.escape_identifier(name)}"]', name):
        try:
            found = block.path_resolve(path)
            value = np.array(found if isinstance(found, (bool, int, float)) else list(found), np.float32)
        except (ValueError, TypeError, AttributeError):
            continue
        if value.ndim == 0:
            return np.append(np.repeat(value, 3), np.float32(1))
        if value.ndim == 1 and 1 <= len(value) <= 4:
            return np.concatenate([value, np.array([0, 0, 0, 1], np.float32)[len(value) :]])
    return None


def _of_geometry(parent: "bpy.types.Object", index: tuple[int, ...], name: str) -> np.ndarray | None:
    """An attribute of an object's instances of geometry, the innermost first, (4,); None where there is none."""
    found = None
    geometry: Any = parent.evaluated_geometry() if parent.type != "EMPTY" else None
    for i in reversed(index):
        cloud = geometry.instances_pointcloud() if geometry is not None else None
        if cloud is None or i >= len(cloud.attributes["position"].data):
            break
        attribute = cloud.attributes.get(name)
        if attribute is not None and attribute.data_type in WIDTH_OF:
            found = _element(attribute, i)
        reference = geometry.instance_references()[cloud.attributes[".reference_index"].data[i].value]
        geometry = reference if isinstance(reference, bpy.types.GeometrySet) else None
    return found


def _element(attribute: "bpy.types.Attribute", i: int) -> np.ndarray:
    """A value of an attribute as a colour, (4,) float32."""
    element, width = attribute.data[i], WIDTH_OF[attribute.data_type]
    if width == 1:
        return np.array([element.value] * 3 + [1], np.float32)
    value = element.color if width == 4 else element.vector
    return np.concatenate([np.array(value, np.float32), np.array([0, 0, 0, 1], np.float32)[width:]])


def random_of_name(name: str) -> float:
    """The random number in [0, 1] of an object that is no instance."""
    seed = 0
    for byte in name.encode():
        seed = (seed * 37 + byte) & 0xFFFFFFFF
    return float(random_of(seed))


def random_of(seed: Any) -> Any:
    """Cycles' numbers in [0, 1] of integers in [0, 2³²), one or an array: their hashes by Jenkins' lookup3."""
    start = (0xDEADBEEF + (2 << 2) + 13) & 0xFFFFFFFF
    a, b, c = (start + seed) & 0xFFFFFFFF, start, start
    for bits in ((14, 11, 25), (16, 4, 14)):
        c = _mixed(c, b, bits[0])
        a = _mixed(a, c, bits[1])
        b = _mixed(b, a, bits[2])
    return _mixed(c, b, 24) / 0xFFFFFFFF


def _mixed(x: Any, y: Any, bits: int) -> Any:
    return ((x ^ y) - (y << bits | y >> (32 - bits))) & 0xFFFFFFFF
