"""Bake targets as `ReceiverMesh`: where the light is seen that a mesh's vertices or corners store.

Light is stored on the original mesh and seen on what modifiers make of it:

- Where modifiers keep vertices and faces, or only cut the faces (armatures, shape keys, displacement, …), each vertex
  or corner is where it was put.
- Where they put the original vertices first and make others (`modifiers.FIRST_VERTICES`), the light is the light at
  these. That each does so was found by experiment and is held by tests/host/test_receiver_mesh_modifiers.py.
- Elsewhere the receivers are the evaluated mesh's own vertices or corners, and an `AttributeMap`, which `probes` find,
  leads back to the original's corners.

In the first two cases values go on corners where the evaluated mesh has flat faces or sharp edges, and on vertices
where it is smooth all over. Subdivided surfaces take them on vertices: what was an original corner is rounded there.
"""

from dataclasses import replace

import bpy
import numpy as np

from ....core.errors import BakeError
from ....core.progress import Progress
from ....receivers import IN_PLACE, AttributeMap, ReceiverMesh, joined, unreached_share
from ...warn import Warnings, listed
from ...write.color_attribute import check_editable
from ..transforms import place_normals, to_world
from .meshes import attribute, corner_vertex, evaluated_mesh, face_sizes, triangle_corners, vectors
from .modifiers import COPIES_FACES, active_modifiers, keeps_vertices_first, may_change_elements
from .vertex_probes import attribute_maps

UNREACHED = 1e-5
"""Share of an object's surface that may show no light without a warning: it is white, and seen wherever it is."""


class NotShownError(BakeError):
    """Modifiers leave nothing of a mesh that could show light."""


def receiver_meshes(
    objects: "list[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    warnings: list[str] | None = None,
    all_of_them: bool = True,
    flawed: "list[bpy.types.Object] | None" = None,
    progress: Progress | None = None,
) -> list[ReceiverMesh]:
    """The meshes that values are wanted for.

    Parameters
    ----------
    objects : list of bpy.types.Object
        Original mesh objects of the depsgraph's view layer.
    depsgraph : bpy.types.Depsgraph
    warnings : list of str, optional
        Sentences about light that cannot be shown as it is are appended.
    all_of_them : bool
        Whether an object that cannot be baked to is an error, or is left out with a warning.
    flawed : list of bpy.types.Object, optional
        Objects whose mesh cannot show their light as it is are appended instead, and left out.
    progress : Progress, optional

    Returns
    -------
    list of ReceiverMesh
        Of the objects, and then of objects that cut them, whose meshes hold the light of the cuts.

    Raises
    ------
    Cancelled
        If `progress` was cancelled.
    BakeError
        If one of them, or none, can be baked to, naming it and what to do.
    """
    warn, progress = Warnings(warnings), progress or Progress()
    evaluated = {obj: evaluated_mesh(obj.evaluated_get(depsgraph), depsgraph) for obj in objects}
    probed = [obj for obj in objects if may_change_elements(obj) and not _same_elements(obj.data, evaluated[obj])]
    maps = attribute_maps(probed, depsgraph.scene)
    meshes: dict[bpy.types.Object, ReceiverMesh] = {}
    cut: dict[bpy.types.Object, list[ReceiverMesh]] = {}  # faces of cutters, by these
    refusals = []
    for obj in objects:
        progress.check()
        try:
            parts = _receiver_parts(obj, evaluated[obj], depsgraph, maps.get(obj))
        except BakeError as error:
            if flawed is not None and isinstance(error, NotShownError):
                flawed.append(obj)
            elif all_of_them:
                raise
            else:
                refusals.append(str(error))
            continue
        share = _share_without_light(list(parts.values()))
        if flawed is not None and (share > UNREACHED or _repeats_light(obj, parts[obj], depsgraph)):
            flawed.append(obj)
            continue
        if share > UNREACHED:
            warn.add(_unlit(obj, share, depsgraph))
        meshes[obj] = parts.pop(obj)
        for cutter, part in parts.items():
            cut.setdefault(cutter, []).append(part)
    if refusals and not meshes and not flawed:
        raise BakeError(f"Nothing to bake: {refusals[0]}")
    for sentence in refusals:
        warn.add(f"Left out: {sentence}")
    if flawed is None:
        _warn_of_repeated_light(meshes, depsgraph, warn)
    return [*meshes.values(), *(joined(parts) for cutter, parts in cut.items() if cutter not in meshes)]


def _unlit(obj: "bpy.types.Object", share: float, depsgraph: "bpy.types.Depsgraph") -> str:
    return (
        f"Object '{obj.name}': {_percent(share)} of its surface shows no light, as its modifier "
        f"'{_culprit(obj, depsgraph)}' makes faces that show no attribute: turn on Bake Copies."
    )


def _receiver_parts(
    obj: "bpy.types.Object",
    evaluated: "bpy.types.Mesh",
    depsgraph: "bpy.types.Depsgraph",
    maps: "dict[bpy.types.Object, AttributeMap] | None",
) -> "dict[bpy.types.Object, ReceiverMesh]":
    """What an original object shows of its own mesh, and of those of its cutters."""
    mesh = obj.data
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    if maps is not None:
        if obj not in maps or len(maps[obj].area) != len(evaluated.loops):
            raise _not_shown(obj, depsgraph)
        whole = evaluated_receiver_mesh(obj.name, mesh.name, evaluated, matrix)
        return {
            owner: replace(whole, object_name=owner.name, mesh_name=owner.data.name, map=mapped)
            for owner, mapped in maps.items()
        }
    if len(evaluated.vertices) < len(mesh.vertices):
        raise _not_shown(obj, depsgraph)
    local = _positions(evaluated)[: len(mesh.vertices)]
    normals, on_corners = _normals(obj, evaluated, local)
    own = ReceiverMesh(
        object_name=obj.name,
        mesh_name=mesh.name,
        domain="CORNER" if on_corners else "POINT",
        positions=to_world(local, matrix, obj.name),
        normals=place_normals(normals, matrix),
        corner_vertex=corner_vertex(mesh),
        corner_face=_corner_face(mesh),
        triangles=triangle_corners(evaluated) if _same_faces(mesh, evaluated) else None,
    )
    return {obj: own}


def evaluated_receiver_mesh(
    object_name: str,
    mesh_name: str,
    evaluated: "bpy.types.Mesh",
    matrix: np.ndarray,
) -> ReceiverMesh:
    """An evaluated mesh in its own elements, where a (4, 4) matrix puts it."""
    smooth = evaluated.normals_domain == "POINT"
    return ReceiverMesh(
        object_name=object_name,
        mesh_name=mesh_name,
        domain="POINT" if smooth else "CORNER",
        positions=to_world(_positions(evaluated), matrix, object_name),
        normals=place_normals(vectors(evaluated.vertex_normals if smooth else evaluated.corner_normals), matrix),
        corner_vertex=corner_vertex(evaluated),
        corner_face=_corner_face(evaluated),
        triangles=triangle_corners(evaluated),
    )


def _not_shown(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> NotShownError:
    return NotShownError(
        f"Object '{obj.name}': its modifier '{_culprit(obj, depsgraph)}' makes a new mesh that shows no attribute of "
        "the old one: turn on Bake Copies, or apply the modifier."
    )


def _percent(share: float) -> str:
    return f"{share:.0%}" if share >= 0.01 else "under 1%"


def _culprit(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> str:
    """The name of the modifier that most likely changes the elements of an original object's mesh."""
    modifiers = active_modifiers(obj, depsgraph.mode)
    changing = [modifier for modifier in modifiers if not keeps_vertices_first(modifier)]
    return next((modifier.name for modifier in (*changing, *modifiers)), "?")


def _share_without_light(parts: list[ReceiverMesh]) -> float:
    """Share of an object's surface that shows no stored light."""
    maps = [part.map for part in parts if part.map is not None]
    return unreached_share(maps) if maps else 0.0


def _repeats_light(obj: "bpy.types.Object", mesh: ReceiverMesh, depsgraph: "bpy.types.Depsgraph") -> bool:
    """Whether some of the surface shows the light of other places."""
    if mesh.map is None:
        return any(modifier.type in COPIES_FACES for modifier in active_modifiers(obj, depsgraph.mode))
    return mesh.map.misplaced > IN_PLACE


def _warn_of_repeated_light(
    meshes: "dict[bpy.types.Object, ReceiverMesh]", depsgraph: "bpy.types.Depsgraph", warn: Warnings
) -> None:
    """Name the objects that show the light of some places in others."""
    repeating = [f"'{obj.name}'" for obj, mesh in meshes.items() if _repeats_light(obj, mesh, depsgraph)]
    if repeating:
        warn.add(
            f"{len(repeating)} object(s) show the same light in several places, as their modifiers copy faces "
            f"({listed(repeating)}): turn on Bake Copies for light of their own."
        )


def check_target(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that light can be baked to an object's vertices, if its modifiers show it.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    check_is_mesh(obj)
    check_editable(obj)
    check_placed(obj, depsgraph)
    if not len(evaluated_mesh(obj.evaluated_get(depsgraph), depsgraph).polygons):
        raise BakeError(f"Object '{obj.name}' has no faces to bake to: give it some, or leave it out.")


def check_is_mesh(obj: "bpy.types.Object") -> None:
    """Make sure that an object is a mesh.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if obj.type != "MESH":
        raise BakeError(
            f"Object '{obj.name}' is not a mesh: convert it to one (Object > Convert), or turn on Bake Copies."
        )


def check_placed(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that an object is there, and spans a space.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    evaluated = obj.evaluated_get(depsgraph)
    linear = np.array(evaluated.matrix_world, np.float64)[:3, :3]
    to_world(np.zeros((1, 3), np.float32), np.array(evaluated.matrix_world, np.float64), obj.name)
    if abs(np.linalg.det(linear)) <= 1e-9 * np.linalg.norm(linear, axis=0).prod():
        raise BakeError(f"Object '{obj.name}' has zero scale along an axis: give it a scale (N panel > Item > Scale).")


def _same_elements(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> bool:
    """Whether an evaluated mesh has a mesh's own vertices: as many in other faces may have been sorted anew."""
    same_number = len(evaluated.vertices) == len(mesh.vertices)
    return same_number and np.array_equal(corner_vertex(evaluated), corner_vertex(mesh))


def _normals(obj: "bpy.types.Object", evaluated: "bpy.types.Mesh", positions: np.ndarray) -> tuple[np.ndarray, bool]:
    """Shading normals in local space, and whether they are corners' (c, 3) or vertices' (v, 3)."""
    mesh = obj.data
    n = len(mesh.loops)
    if _corners_come_first(mesh, evaluated):
        # A modifier may have made edges sharp ('Smooth by Angle') or smooth: what is seen counts.
        if evaluated.normals_domain == "POINT":
            return vectors(evaluated.vertex_normals)[: len(mesh.vertices)], False
        return vectors(evaluated.corner_normals)[:n], True
    subdivided = len(evaluated.vertices) != len(mesh.vertices)
    if subdivided or mesh.normals_domain == "POINT":
        return vectors(evaluated.vertex_normals)[: len(mesh.vertices)], False
    return _original_corner_normals(obj, positions), True


def _corners_come_first(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> bool:
    """Whether an evaluated mesh's corners start with the original ones."""
    n = len(mesh.loops)
    if len(evaluated.loops) < n:
        return False
    # Split edges give corners new vertices, but leave the corners where they were.
    if _same_faces(mesh, evaluated):
        return True
    return np.array_equal(corner_vertex(evaluated)[:n], corner_vertex(mesh))


def _same_faces(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> bool:
    """Whether an evaluated mesh that has a mesh's vertices first has its very faces."""
    return len(evaluated.loops) == len(mesh.loops) and len(evaluated.polygons) == len(mesh.polygons)


def _original_corner_normals(obj: "bpy.types.Object", positions: np.ndarray) -> np.ndarray:
    """Corner normals (c, 3) of the original topology with its vertices at (v, 3) positions in local space.

    For modifiers that keep the vertices but cut the faces, as Triangulate does.
    """
    copy = obj.to_mesh()  # of an original object: without modifiers, and in no file
    try:
        copy.vertices.foreach_set("co", positions.ravel())
        copy.update()
        return vectors(copy.corner_normals)
    finally:
        obj.to_mesh_clear()


def _corner_face(mesh: "bpy.types.Mesh") -> np.ndarray:
    """The face of each corner, (c,) int32."""
    return np.repeat(np.arange(len(mesh.polygons), dtype=np.int32), face_sizes(mesh))


def _positions(mesh: "bpy.types.Mesh") -> np.ndarray:
    return attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
