"""True displacement: vertices of evaluated meshes moved as Cycles moves them before it renders.

Cycles evaluates a material's Displacement at the vertices of the render's mesh and moves them, in object space by

    P + N (h − m) s    for a Displacement node of height h, midlevel m and scale s
    P + (v − m) s      for a Vector Displacement node

with the smooth normal N of the vertex, whichever way its faces are shaded. Where faces of several materials or UV
islands meet at a vertex, the first of them counts.
"""

import bpy
import numpy as np

from ...temporary import CyclesError
from ...warn import Warnings
from ..materials.cycles_bake import bake_at_corners
from ..materials.expressions import constant
from ..materials.nodes import Place, output_node, source, uses_nodes
from .meshes import attribute, corner_vertex, face_sizes, used_slots, vectors


def displace(
    depsgraph: "bpy.types.Depsgraph", warnings: list[str], displaced: dict[int, np.ndarray] | None = None
) -> None:
    """Move the vertices of the mesh objects in an evaluated graph, which no data-block of the file has anything of.

    It comes before anything is read of meshes, and while nothing is kept of them, since Cycles evaluates the nodes.

    Parameters
    ----------
    displaced : dict of int to (v, 3) float32, optional
        Where an earlier call for the same graph at another time left the vertices of objects, by their session ids:
        those that are still there are left alone. Is brought up to date.
    """
    displaced = {} if displaced is None else displaced
    warn, moves, seen = Warnings(warnings), [], set()
    for obj in [one for one in depsgraph.objects if one.type == "MESH" and not one.data.is_editmode]:
        mesh = obj.data
        if len(mesh.polygons) == 0 or mesh.as_pointer() in seen:
            continue
        seen.add(mesh.as_pointer())
        slots = {slot: material for slot, material in _materials(obj, mesh) if displaces(material)}
        uid = obj.original.session_uid
        if slots and not np.array_equal(_positions(mesh), displaced.get(uid, ())):
            moves.append((uid, mesh, _offsets(obj, mesh, slots, warn)))
    for uid, mesh, offsets in moves:
        displaced[uid] = (_positions(mesh) + offsets).astype(np.float32)
        mesh.attributes["position"].data.foreach_set("vector", displaced[uid].reshape(-1))
        mesh.update()


def _positions(mesh: "bpy.types.Mesh") -> np.ndarray:
    """Where vertices are, (v, 3) float32."""
    return attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)


def displaces(material: "bpy.types.Material | None") -> bool:
    """Whether a material moves vertices."""
    if material is None or not uses_nodes(material) or material.displacement_method == "BUMP":
        return False
    output = output_node(material)
    return output is not None and source(output.inputs["Displacement"]) is not None


def _materials(obj: "bpy.types.Object", mesh: "bpy.types.Mesh") -> "list[tuple[int, bpy.types.Material | None]]":
    """The material slots that faces use, and what is in each."""
    slots = [one.material for one in obj.material_slots] or [None]
    return [(slot, slots[min(slot, len(slots) - 1)]) for slot in used_slots(mesh)]


def _offsets(
    obj: "bpy.types.Object", mesh: "bpy.types.Mesh", slots: "dict[int, bpy.types.Material]", warn: Warnings
) -> np.ndarray:
    """How far each vertex of a mesh is moved in its own space, (v, 3)."""
    offsets, vertex = np.zeros((len(mesh.vertices), 3)), corner_vertex(mesh)
    slot_of_face = attribute(mesh, "material_index", "value", (len(mesh.polygons),), np.int32)
    slot_of_corner = np.repeat(slot_of_face, face_sizes(mesh))
    for slot, material in sorted(slots.items(), reverse=True):
        try:
            moved = _of_material(obj, mesh, material)
        except CyclesError as error:
            warn.add(f"Material '{material.name}': its displacement is not baked ({error}).")
            continue
        corners = np.flatnonzero(slot_of_corner == slot)[::-1]  # so that the first is written last
        offsets[vertex[corners]] = moved[corners]
    return np.nan_to_num(offsets, posinf=0.0, neginf=0.0)


def _of_material(obj: "bpy.types.Object", mesh: "bpy.types.Mesh", material: "bpy.types.Material") -> np.ndarray:
    """What a material would move the corners of a mesh by in its own space, (c, 3)."""
    output = output_node(material)
    assert output is not None
    origin = Place(output.inputs["Displacement"]).origin
    node, to_world = origin.socket.node, np.array(obj.matrix_world, np.float64)[:3, :3]
    scaled = origin.socket.is_output and node.type in {"DISPLACEMENT", "VECTOR_DISPLACEMENT"}
    names = {"DISPLACEMENT": "Height", "VECTOR_DISPLACEMENT": "Vector"}
    places = [origin.input(name) for name in (names[node.type], "Midlevel", "Scale")] if scaled else [origin]
    fixed = {place: value[None] for place in places if (value := constant(place)) is not None}
    known = fixed | bake_at_corners(material.original, [one for one in places if one not in fixed], mesh, obj.original)
    values = [known[one] for one in places]
    if not scaled:
        return np.broadcast_to(values[0], (len(mesh.loops), 3)) @ np.linalg.pinv(to_world).T
    amount = np.broadcast_to((values[0] - values[1]) * values[2], (len(mesh.loops), values[0].shape[1]))
    if node.type == "DISPLACEMENT":
        along = vectors(mesh.vertex_normals).astype(np.float64).take(corner_vertex(mesh), 0)
        if node.space == "WORLD":
            along = along @ np.linalg.pinv(to_world)
            along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
        amount = amount * along
    elif node.space == "TANGENT":
        amount = _from_tangents(mesh, amount)
    return amount @ np.linalg.pinv(to_world).T if node.space == "WORLD" else amount


def _from_tangents(mesh: "bpy.types.Mesh", amount: np.ndarray) -> np.ndarray:
    """Vectors (c, 3) along the tangent, the normal and the bitangent of each corner, in the mesh's own space."""
    normal = vectors(mesh.vertex_normals).astype(np.float64).take(corner_vertex(mesh), 0)
    try:
        mesh.calc_tangents()
    except RuntimeError as error:
        raise CyclesError(f"its mesh has no tangents: {str(error).strip()}") from error
    tangent, sign = np.empty((len(mesh.loops), 3), np.float32), np.empty(len(mesh.loops), np.float32)
    mesh.loops.foreach_get("tangent", tangent.reshape(-1))
    mesh.loops.foreach_get("bitangent_sign", sign)
    mesh.free_tangents()
    bitangent = np.cross(normal, tangent) * sign[:, None]
    bitangent /= np.maximum(np.linalg.norm(bitangent, axis=1, keepdims=True), 1e-30)
    return amount[:, :1] * tangent + amount[:, 1:2] * normal + amount[:, 2:] * bitangent
