"""Light as a colour attribute of meshes."""

from collections.abc import Iterable
from math import pi

import bpy
import numpy as np

from ..errors import BakeError
from ..receivers import AttributeTarget, Receivers

MAX_NAME_BYTES = 63
"""Blender cuts longer names."""

BUILT_IN = {
    "position",
    "material_index",
    "sharp_edge",
    "sharp_face",
    "crease_edge",
    "crease_vert",
    "bevel_weight_edge",
    "bevel_weight_vert",
    "custom_normal",
    "freestyle_edge",
    "freestyle_face",
    "velocity",
    "id",
}
"""Names that mean something to Blender itself, and that a mesh need not have yet."""


def write_color_attribute(irradiance_value: np.ndarray, receivers: Receivers, attribute_name: str) -> list[str]:
    """Write E / π to a FLOAT_COLOR attribute of each target's mesh, and make it the active colour.

    An attribute of that name is replaced where its domain or type differ. A mesh that several targets share gets the
    mean of their values. Either all meshes are written or none.

    Parameters
    ----------
    irradiance_value : (n, 3) float32, W/m²
        E at each receiver, scene-linear.
    receivers : Receivers
    attribute_name : str

    Returns
    -------
    list of str
        Warnings, one a mesh that several objects share.

    Raises
    ------
    BakeError
        If a value is not finite, or a mesh cannot take the attribute. Nothing was written then.
    """
    if not np.isfinite(irradiance_value).all():
        raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
    colors = np.asarray(irradiance_value, np.float32) / np.float32(pi)
    objects = _objects(receivers.targets)
    check_color_attribute(objects, attribute_name)
    by_mesh: dict[int, list[tuple[bpy.types.Object, AttributeTarget]]] = {}
    for obj, target in zip(objects, receivers.targets, strict=True):
        _check_unchanged(obj, target)
        by_mesh.setdefault(obj.data.as_pointer(), []).append((obj, target))
    for sharers in by_mesh.values():
        mesh = sharers[0][0].data
        corners = any(target.domain == "CORNER" for _, target in sharers)
        values = [_values(colors, target, mesh, corners) for _, target in sharers]
        _write(mesh, attribute_name, "CORNER" if corners else "POINT", np.mean(values, axis=0, dtype=np.float32))
    return [_shared_warning([obj for obj, _ in sharers]) for sharers in by_mesh.values() if len(sharers) > 1]


def check_color_attribute(objects: "Iterable[bpy.types.Object]", attribute_name: str) -> None:
    """Make sure that each object's mesh can take a colour attribute; cheap enough to ask before a bake.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if not attribute_name or attribute_name.startswith(".") or len(attribute_name.encode()) > MAX_NAME_BYTES:
        raise BakeError(
            f"'{attribute_name}' cannot name a colour attribute: choose a name of 1 to {MAX_NAME_BYTES} bytes that "
            "does not start with a dot."
        )
    if attribute_name in BUILT_IN:
        raise BakeError(f"'{attribute_name}' means something else to Blender: choose another attribute name.")
    for obj in objects:
        check_editable(obj)
        existing = obj.data.attributes.get(attribute_name)
        if existing is not None and not _is_color(existing):
            raise BakeError(
                f"Object '{obj.name}' has an attribute '{attribute_name}' that is not a colour: choose another "
                "attribute name, or remove that one."
            )
        if attribute_name in obj.vertex_groups:
            raise BakeError(
                f"Object '{obj.name}' has a vertex group '{attribute_name}': choose another attribute name."
            )


def check_editable(obj: "bpy.types.Object") -> None:
    """Make sure that a mesh object's mesh can be written to.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if obj.mode == "EDIT" or obj.data.is_editmode:
        raise BakeError(f"Object '{obj.name}' is in edit mode: leave edit mode to bake.")
    if not obj.data.is_editable:
        raise BakeError(
            f"The mesh of object '{obj.name}' is linked from another file and cannot be written: make it local "
            "(Object > Relations > Make Local)."
        )


def _is_color(attribute: "bpy.types.Attribute") -> bool:
    return attribute.data_type in {"FLOAT_COLOR", "BYTE_COLOR"} and attribute.domain in {"POINT", "CORNER"}


def _objects(targets: "tuple[AttributeTarget, ...]") -> "list[bpy.types.Object]":
    """The objects of targets, local ones before linked ones of the same name.

    Asked for a name, Blender looks through all objects: here they are gone through once for all names.
    """
    by_name = {obj.name: obj for obj in sorted(bpy.data.objects, key=lambda obj: obj.library is None)}
    found = []
    for target in targets:
        obj = by_name.get(target.object_name)
        if obj is None or obj.type != "MESH":
            raise BakeError(f"Object '{target.object_name}' is gone: bake again.")
        found.append(obj)
    return found


def _check_unchanged(obj: "bpy.types.Object", target: AttributeTarget) -> None:
    """A bake takes its time, and the mesh may have been edited meanwhile."""
    mesh = obj.data
    n = len(mesh.loops) if target.domain == "CORNER" else len(mesh.vertices)
    if mesh.name != target.mesh_name or n != len(target.receiver_of_element):
        raise BakeError(f"The mesh of object '{obj.name}' was changed during the bake: bake again.")


def _values(colors: np.ndarray, target: AttributeTarget, mesh: "bpy.types.Mesh", corners: bool) -> np.ndarray:
    """RGBA of a mesh's vertices or corners, (e, 4) float32; black where no receiver is."""
    receiver = target.receiver_of_element
    rgba = np.zeros((len(receiver), 4), np.float32)
    lit = receiver >= 0
    rgba[lit, :3] = colors[receiver[lit]]
    rgba[:, 3] = 1
    if corners and target.domain == "POINT":
        vertex = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertex)
        rgba = rgba[vertex]
    return rgba


def _write(mesh: "bpy.types.Mesh", name: str, domain: str, rgba: np.ndarray) -> None:
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != ("FLOAT_COLOR", domain):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(name, "FLOAT_COLOR", domain)
    attribute.data.foreach_set("color", np.ascontiguousarray(rgba, np.float32).ravel())
    index = mesh.color_attributes.find(name)
    mesh.color_attributes.active_color_index = index
    mesh.color_attributes.render_color_index = index
    mesh.update()


def _shared_warning(objects: "list[bpy.types.Object]") -> str:
    names = ", ".join(f"'{obj.name}'" for obj in objects[:5]) + (", …" if len(objects) > 5 else "")
    return (
        f"Mesh '{objects[0].data.name}' is shared by {names} and got the mean of their light: make it single-user "
        "(Object > Relations > Make Single User) for light of its own."
    )
