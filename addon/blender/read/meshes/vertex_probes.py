"""How modifiers carry an attribute from a mesh to what they make of it, found by experiment.

Copies of objects, in a scene of their own, carry attributes that name each element. What modifiers make of these says
which elements, and how much of each, every corner of the evaluated mesh shows:

- A corner has the number of its face, and a 1 in the channel of its place in the face. Modifiers mix the corners of
  one face only, as they find values inside of it; so the number stays whole and the channels hold the weights. Faces of
  more than `CHANNELS` corners share the channels out, and the weights of least norm are taken.
- A vertex, for meshes without faces, has its own position, which lies between those of the two that are mixed.

Elements that modifiers make from nothing have Blender's default there, black or white, which no code is. What Boolean
modifiers take from other objects has these objects' codes, if they can hold light (`modifiers.cutters`): their faces'
numbers follow the object's own.
"""

from dataclasses import dataclass

import bpy
import numpy as np

from ....receivers import AttributeMap
from ...temporary import Temporary
from ..render_graph import in_render_graph
from .meshes import attribute, corner_vertex, face_sizes, vectors
from .modifiers import can_be_probed, cutters

CHANNELS = 64
"""At most, for the places in a face."""

ROOM = 1 << 24
"""Numbers that the channels of a mesh may take, where its faces want more than 8."""

_PLACE, _FACE, _VERTEX = "photon_bake.place.", "photon_bake.face", "photon_bake.vertex"
_LOW = 4096  # a face's number is held by two channels, as float32 would round a mix of large ones
_SPARSE = 1e-4  # weights below this are rounding


def attribute_maps(
    objects: "list[bpy.types.Object]", scene: "bpy.types.Scene"
) -> "dict[bpy.types.Object, dict[bpy.types.Object, AttributeMap]]":
    """What mesh objects show of an attribute of their own mesh, and of their cutters', as far as they show any.

    Parameters
    ----------
    objects : list of bpy.types.Object
        Original ones.
    scene : bpy.types.Scene
        Whose frame and simplification hold.
    """
    maps: dict[bpy.types.Object, dict[bpy.types.Object, AttributeMap]] = {obj: {} for obj in objects}
    objects = [obj for obj in objects if can_be_probed(obj)]
    if not objects:
        return maps
    with Temporary() as temporary:
        own = temporary.add(bpy.data.scenes.new("Photon Bake"))
        own.frame_current, own.frame_subframe = scene.frame_current, scene.frame_subframe
        for name in ("use_simplify", "simplify_subdivision", "simplify_subdivision_render"):
            setattr(own.render, name, getattr(scene.render, name))
        probes = _add_probes(objects, own.collection, temporary)
        return maps | in_render_graph(own, own.view_layers[0], lambda depsgraph: _read_probes(probes, depsgraph))


def _add_probes(
    objects: "list[bpy.types.Object]", collection: "bpy.types.Collection", temporary: Temporary
) -> "dict[bpy.types.Object, bpy.types.Object]":
    """A copy of each object with codes on its mesh, linked to a collection, and with such copies of its cutters."""
    meshes: dict[tuple[bpy.types.Mesh, int], bpy.types.Mesh] = {}

    def copy(obj: "bpy.types.Object", first_face: int) -> "bpy.types.Object":
        if (obj.data, first_face) not in meshes:
            mesh = meshes[obj.data, first_face] = temporary.add(obj.data.copy())
            if mesh.shape_keys is not None:
                temporary.add(mesh.shape_keys)
            _write_codes(mesh, first_face)
        probe = temporary.add(obj.copy())
        probe.data = meshes[obj.data, first_face]
        _drop_simulations(probe)
        return probe

    probes = {}
    for obj in objects:
        first_faces = _first_faces(obj)
        copies = {one: copy(one, first_face) for one, first_face in first_faces.items()}
        probe = probes[obj] = copies[obj]
        for modifier in probe.modifiers:
            if modifier.type == "BOOLEAN" and modifier.object in copies:
                modifier.object = copies[modifier.object]
        probe.hide_viewport = probe.hide_render = False
        collection.objects.link(probe)
    return probes


def _drop_simulations(probe: "bpy.types.Object") -> None:
    """Remove the modifiers that take part in simulations, or start them anew, and leave a mesh's elements alone."""
    kinds = {"FLUID"} if any(one.type == "EXPLODE" for one in probe.modifiers) else {"FLUID", "PARTICLE_SYSTEM"}
    for modifier in [one for one in probe.modifiers if one.type in kinds]:
        probe.modifiers.remove(modifier)


def _first_faces(obj: "bpy.types.Object") -> "dict[bpy.types.Object, int]":
    """The number of the first face of an original object and of each of its cutters."""
    owners = [obj, *cutters(obj)]
    return dict(zip(owners, np.cumsum([0, *(len(one.data.polygons) for one in owners)]).tolist(), strict=False))


def _read_probes(
    probes: "dict[bpy.types.Object, bpy.types.Object]", depsgraph: "bpy.types.Depsgraph"
) -> "dict[bpy.types.Object, dict[bpy.types.Object, AttributeMap]]":
    maps: dict[bpy.types.Object, dict[bpy.types.Object, AttributeMap]] = {}
    for obj, probe in probes.items():
        evaluated = probe.evaluated_get(depsgraph).data
        maps[obj] = {}
        for owner, first_face in _first_faces(obj).items():
            entries = (
                _entries(owner.data, evaluated) if owner == obj else _corner_entries(owner.data, evaluated, first_face)
            )
            if entries.n_corners:
                maps[obj][owner] = _attribute_map(owner.data, evaluated, entries)
    return maps


@dataclass(frozen=True)
class _Entries:
    """Which elements of a domain corners show; see `AttributeMap`."""

    domain: str
    corner: np.ndarray
    element: np.ndarray
    weight: np.ndarray

    @property
    def n_corners(self) -> int:
        return len(np.unique(self.corner))


def _write_codes(mesh: "bpy.types.Mesh", first_face: int) -> None:
    positions = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
    _write(mesh, _VERTEX, "POINT", np.column_stack([positions, np.full(len(positions), 2)]))
    faces = _Faces(mesh)
    if not len(faces.of_corner):
        return
    high, low = np.divmod(faces.of_corner + first_face, _LOW)
    one, zero = np.ones(len(low)), np.zeros(len(low))
    _write(mesh, _FACE, "CORNER", np.column_stack([high, low, one, zero]))
    codes = np.zeros((len(low), faces.n_channels))
    for size in np.unique(faces.size):
        chosen = faces.size[faces.of_corner] == size
        codes[chosen] = _codes(int(size), faces.n_channels)[faces.place[chosen]]
    for i in range(0, faces.n_channels, 4):
        _write(mesh, f"{_PLACE}{i}", "CORNER", codes[:, i : i + 4])


class _Faces:
    """The faces of a mesh.

    Attributes
    ----------
    first, size : (f,) int32
        First corner, and number of corners.
    of_corner, place : (c,) int64
        Face of each corner, and its place in it.
    n_channels : int
        That the codes of places take.
    """

    def __init__(self, mesh: "bpy.types.Mesh") -> None:
        self.first, self.size = np.empty(len(mesh.polygons), np.int32), face_sizes(mesh)
        mesh.polygons.foreach_get("loop_start", self.first)
        self.of_corner = np.repeat(np.arange(len(self.size)), self.size)
        self.place = np.arange(len(self.of_corner)) - np.repeat(self.first, self.size)
        wanted = min(int(self.size.max(initial=1)), CHANNELS, max(8, ROOM // max(len(self.place), 1)))
        self.n_channels = -(-wanted // 4) * 4  # a colour has four


def _codes(size: int, n_channels: int) -> np.ndarray:
    """Codes of the places in a face (size, n_channels): each is in one channel, or shared out over two that adjoin."""
    if size <= n_channels:
        return np.eye(size, n_channels)
    at = np.arange(size) * n_channels / size
    channel = at.astype(np.int64)
    codes = np.zeros((size, n_channels))
    codes[np.arange(size), channel] = 1 - (at - channel)
    codes[np.arange(size), (channel + 1) % n_channels] += at - channel
    return codes


def _write(mesh: "bpy.types.Mesh", name: str, domain: str, values: np.ndarray) -> None:
    layer = mesh.attributes.new(name, "FLOAT_COLOR", domain)  # as the light will be: modifiers ask for the type
    layer.data.foreach_set("color", np.ascontiguousarray(values, np.float32).ravel())


def _read(evaluated: "bpy.types.Mesh", name: str) -> np.ndarray | None:
    """Values of an attribute at an evaluated mesh's corners, (c, 4); None where it is not there."""
    layer = evaluated.attributes.get(name)
    if layer is None or layer.data_type != "FLOAT_COLOR" or layer.domain not in {"POINT", "CORNER"}:
        return None
    values = np.empty((len(layer.data), 4), np.float32)
    layer.data.foreach_get("color", values.reshape(-1))
    return values if layer.domain == "CORNER" else values[corner_vertex(evaluated)]


def _entries(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> _Entries:
    """What the corners of an evaluated probe show of its own mesh.

    The vertices' codes count where the corners', which tell more, reach less than half of what they reach.

    Parameters
    ----------
    mesh : bpy.types.Mesh
        The stored one.
    """
    corners, vertices = _corner_entries(mesh, evaluated, 0), _vertex_entries(mesh, evaluated)
    return vertices if 2 * corners.n_corners < vertices.n_corners else corners


def _corner_entries(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh", first_face: int) -> _Entries:
    faces = _Faces(mesh)
    codes = [_read(evaluated, f"{_PLACE}{i}") for i in range(0, faces.n_channels, 4)]
    number = _read(evaluated, _FACE)
    if number is None or any(code is None for code in codes):
        return _joined("CORNER", [])
    code = np.concatenate([values for values in codes if values is not None], axis=1)
    whole = np.rint(number[:, :2])
    face = (whole @ [_LOW, 1]).astype(np.int64) - first_face
    known = (np.abs(number[:, :2] - whole) < 0.02).all(axis=1) & (np.abs(number[:, 2:] - [1, 0]) < 1e-3).all(axis=1)
    known &= (face >= 0) & (face < len(faces.size))
    parts = []
    for size in np.unique(faces.size[face[known]]):
        corner = np.flatnonzero(known)[faces.size[face[known]] == size]
        weight = code[corner] @ np.linalg.pinv(_codes(int(size), faces.n_channels))
        row, place = np.nonzero(np.abs(weight) > _SPARSE)
        parts.append((corner[row], faces.first[face[corner[row]]] + place, weight[row, place]))
    return _joined("CORNER", parts)


def _vertex_entries(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> _Entries:
    from scipy.spatial import cKDTree

    code = _read(evaluated, _VERTEX)
    if code is None or not len(mesh.vertices):
        return _joined("POINT", [])
    positions = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32).astype(np.float64)
    corner = np.flatnonzero(np.abs(code[:, 3] - 2) < 1e-3)
    at = code[corner, :3].astype(np.float64)
    _, nearest = cKDTree(positions).query(at, k=[1, min(2, len(positions))])
    first, second = nearest.T
    way = positions[second] - positions[first]
    share = ((at - positions[first]) * way).sum(1) / np.maximum((way**2).sum(1), 1e-300)
    share = np.clip(share, 0, 1)
    parts = []
    for element, weight in ((first, 1 - share), (second, share)):
        chosen = weight > _SPARSE
        parts.append((corner[chosen], element[chosen], weight[chosen]))
    return _joined("POINT", parts)


def _joined(domain: str, parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> _Entries:
    nothing = np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32)
    corner, element, weight = (np.concatenate(columns) for columns in zip(nothing, *parts, strict=True))
    return _Entries(domain, corner.astype(np.int32), element.astype(np.int32), weight.astype(np.float32))


def _attribute_map(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh", entries: _Entries) -> AttributeMap:
    from scipy.spatial import cKDTree

    features = _features(mesh, entries.domain)
    shown = np.zeros(len(features), bool)
    shown[entries.element] = True
    shown = np.flatnonzero(shown)
    _, nearest = cKDTree(features[shown]).query(features)
    stand_in = shown[nearest]
    stand_in[shown] = shown
    corner = corner_vertex(evaluated)
    places = attribute(evaluated, "position", "vector", (len(evaluated.vertices), 3), np.float32)[corner]
    found = AttributeMap(
        domain="CORNER" if entries.domain == "CORNER" else "POINT",
        area=_corner_areas(evaluated),
        stand_in=stand_in.astype(np.int32),
        corner=entries.corner,
        element=entries.element,
        weight=entries.weight,
    )
    return found.with_misplaced(np.nan_to_num(places), np.nan_to_num(vectors(evaluated.corner_normals)))


def _features(mesh: "bpy.types.Mesh", domain: str) -> np.ndarray:
    """Where each element lies: elements of like place and normal are like in these, (e, 6)."""
    positions = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
    size = float(np.ptp(positions, axis=0).max(initial=0))
    normals = vectors(mesh.corner_normals if domain == "CORNER" else mesh.vertex_normals)
    places = positions[corner_vertex(mesh)] if domain == "CORNER" else positions
    return np.nan_to_num(np.concatenate([places, 0.1 * size * normals], axis=1))


def _corner_areas(mesh: "bpy.types.Mesh") -> np.ndarray:
    """The share that each corner has of its face's area, (c,) float32."""
    area, size = np.empty(len(mesh.polygons), np.float32), face_sizes(mesh)
    mesh.polygons.foreach_get("area", area)
    return np.repeat(np.nan_to_num(area / np.maximum(size, 1)), size)
