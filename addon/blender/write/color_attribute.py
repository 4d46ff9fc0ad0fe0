"""Light as a colour attribute of meshes."""

from collections.abc import Iterable, Sequence
from math import pi

import bpy
import numpy as np

from ...core.errors import BakeError
from ...receivers import AttributeTarget, Receivers
from ..read.as_read import AsRead, still_there

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


def write_color_attribute(
    irradiance_value: np.ndarray, receivers: Receivers, attribute_name: str, meanwhile: Sequence[AsRead]
) -> list[str]:
    """Write E / π to a FLOAT_COLOR attribute of each target's mesh, and make it the active colour.

    The color that renders fall back on, which a Color Attribute node without a name reads, stays what it was, even
    where there was none: otherwise the light would change the materials that it was baked with. An attribute of that
    name is replaced where its domain or type differ. A mesh that several targets share gets the mean of their values.
    Objects that can take their light no more are left out.

    Parameters
    ----------
    irradiance_value : (n, 3) float32, W/m²
        E at each receiver, scene-linear.
    receivers : Receivers
    attribute_name : str
    meanwhile : sequence of AsRead
        The object of each target.

    Returns
    -------
    list of str
        Warnings, one a mesh that several objects share, and one an object that is left out.

    Raises
    ------
    BakeError
        If a value is not finite, or no mesh can take the attribute. Nothing was written then.
    """
    if not np.isfinite(irradiance_value).all():
        raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
    colors = np.asarray(irradiance_value, np.float32) / np.float32(pi)
    by_mesh, warnings = light_takers(receivers, attribute_name, meanwhile)
    if not by_mesh and receivers.targets:
        raise BakeError(warnings[0])
    for sharers in by_mesh:
        mesh = sharers[0][0].data
        corners = any(target.domain == "CORNER" for _, target in sharers)
        values = [_values(colors, target, mesh, corners) for _, target in sharers]
        write_color(mesh, attribute_name, "CORNER" if corners else "POINT", np.mean(values, axis=0, dtype=np.float32))
    return warnings


def light_takers(
    receivers: Receivers, attribute_name: str, meanwhile: Sequence[AsRead]
) -> "tuple[list[list[tuple[bpy.types.Object, AttributeTarget]]], list[str]]":
    """The objects that can take light, with their targets, by the mesh that they share; and warnings about the rest."""
    objects, warnings = still_there(meanwhile)
    by_mesh: dict[int, list[tuple[bpy.types.Object, AttributeTarget]]] = {}
    for obj, target in zip(objects, receivers.targets, strict=True):
        if obj is None:
            continue
        try:
            check_color_attribute([obj], attribute_name)
        except BakeError as error:
            warnings.append(f"Left out: {error}")
        else:
            by_mesh.setdefault(obj.data.session_uid, []).append((obj, target))
    sharing = [[obj for obj, _ in sharers] for sharers in by_mesh.values() if len(sharers) > 1]
    return list(by_mesh.values()), warnings + [_shared_warning(objects) for objects in sharing]


def check_color_attribute(objects: "Iterable[bpy.types.Object]", attribute_name: str) -> None:
    """Make sure that each object's mesh can take a colour attribute; cheap enough to ask before a bake.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if not attribute_name or attribute_name.startswith(".") or len(attribute_name.encode()) > MAX_NAME_BYTES:
        raise BakeError(
            f"'{attribute_name}' cannot name a color attribute: choose a name of 1 to {MAX_NAME_BYTES} bytes that "
            "does not start with a dot."
        )
    if attribute_name in BUILT_IN:
        raise BakeError(f"'{attribute_name}' means something else to Blender: choose another attribute name.")
    for obj in objects:
        check_editable(obj)
        existing = obj.data.attributes.get(attribute_name)
        if existing is not None and not _is_color(existing):
            raise BakeError(
                f"Object '{obj.name}' has an attribute '{attribute_name}' that is not a color: choose another "
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
    if not obj.data.is_editable:
        raise BakeError(
            f"The mesh of object '{obj.name}' is linked from another file and cannot be written: make it local "
            "(Object > Relations > Make Local), or turn on Bake Copies."
        )


def _is_color(attribute: "bpy.types.Attribute") -> bool:
    return attribute.data_type in {"FLOAT_COLOR", "BYTE_COLOR"} and attribute.domain in {"POINT", "CORNER"}


def _values(colors: np.ndarray, target: AttributeTarget, mesh: "bpy.types.Mesh", corners: bool) -> np.ndarray:
    """RGBA of a mesh's vertices or corners, (e, 4) float32; black where no receiver is."""
    values = target.values(colors)
    rgba = np.ones((len(values), 4), np.float32)
    rgba[:, :3] = values
    if corners and target.domain == "POINT":
        vertex = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", vertex)
        rgba = rgba[vertex]
    return rgba


def write_color(mesh: "bpy.types.Mesh", name: str, domain: str, rgba: np.ndarray) -> None:
    """Set a colour attribute of a mesh from its elements' (e, 4) values, and make it the active one."""
    rendered = mesh.attributes.default_color_name
    attribute = mesh.attributes.get(name)
    if attribute is not None and (attribute.data_type, attribute.domain) != ("FLOAT_COLOR", domain):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(name, "FLOAT_COLOR", domain)
    attribute.data.foreach_set("color", np.ascontiguousarray(rgba, np.float32).ravel())
    mesh.attributes.active_color_name = name
    mesh.attributes.default_color_name = rendered
    mesh.update()


def _shared_warning(objects: "list[bpy.types.Object]") -> str:
    names = ", ".join(f"'{obj.name}'" for obj in objects[:5]) + (", …" if len(objects) > 5 else "")
    return (
        f"Mesh '{objects[0].data.name}' is shared by {names} and got the mean of their light: make it single-user "
        "(Object > Relations > Make Single User), or turn on Bake Copies, for light of its own."
    )
