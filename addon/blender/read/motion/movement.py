"""Where a scene's surfaces and lamps are at another time of the shutter.

What moves are vertices, and what turns with them: normals, tangents, lamps. Materials, worlds, the power of lamps and
what is shown are those of the scene that was read, as Cycles has it.
"""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace
from hashlib import blake2b

import bpy
import numpy as np

from ....scene import Lights, Scene, ShadingFrames
from ..hair.shapes import Fibres
from ..meshes.meshes import corner_vertex, face_sizes
from ..meshes.placing import PlacedMeshes
from ..scene_contents import SceneContents
from ..transforms import normal_matrices

_PLACES = ("position", "axis_x", "axis_y", "direction")
"""The columns of `Lights` that move."""

Key = tuple[str, int]
"""An object's name, and which of those of this name it is, as instances have one name."""


@dataclass(frozen=True)
class Layout:
    """Which rows of `PlacedMeshes`, before any were dropped, are whose; o objects.

    Attributes
    ----------
    keys : list of Key
        Of the objects.
    topology : list of bytes
        Digest of each object's faces.
    first_vertex, n_vertices, first_triangle, n_triangles : (o,) int64
    whole : (t,) bool
        Which of their triangles have an area.
    instance : (o,) int64
        Which of the dependency graph's instances each is.
    moves : (o,) bool
        Whether the objects' own Motion Blur is on.
    lights : Lights
        As they were read, not linked to objects.
    """

    keys: list[Key]
    topology: list[bytes]
    first_vertex: np.ndarray
    n_vertices: np.ndarray
    first_triangle: np.ndarray
    n_triangles: np.ndarray
    whole: np.ndarray
    instance: np.ndarray
    moves: np.ndarray
    lights: Lights

    @staticmethod
    def of(found: SceneContents, placed: PlacedMeshes) -> "Layout":
        """That of what was found and placed; while the dependency graph is there, and before triangles are dropped."""
        sources = found.sources
        n_copies = [len(source.rows) for source in sources]
        n_triangles = np.repeat(np.array([source.n_triangles for source in sources], np.int64), n_copies)
        ends = np.cumsum(n_triangles)
        digests = [_digest(source.mesh) for source in sources]
        return Layout(
            keys=_keys(name for source in sources for name in source.names),
            topology=[digest for digest, n in zip(digests, n_copies, strict=True) for _ in range(n)],
            first_vertex=placed.first_vertex.astype(np.int64),
            n_vertices=np.diff(np.append(placed.first_vertex, placed.n_vertices)).astype(np.int64),
            first_triangle=ends - n_triangles,
            n_triangles=n_triangles,
            whole=placed.whole[: ends[-1] if len(ends) else 0].copy(),
            instance=np.array([row for source in sources for row in source.rows], np.int64),
            moves=np.array([moves for source in sources for moves in source.moves], bool),
            lights=Lights.join(found.lights) if found.lights else Lights.none(),
        )

    @property
    def object_of_triangle(self) -> np.ndarray:
        """(t,) int64."""
        return np.repeat(np.arange(len(self.keys)), self.n_triangles)


def _keys(names: Iterable[str]) -> list[Key]:
    """Names, each with how often it came before."""
    seen: dict[str, int] = defaultdict(int)
    keys = []
    for name in names:
        keys.append((name, seen[name]))
        seen[name] += 1
    return keys


def _digest(mesh: "bpy.types.Mesh | Fibres") -> bytes:
    """Of which vertices the corners of a mesh's faces have."""
    if isinstance(mesh, Fibres):
        return mesh.digest()
    digest = blake2b(corner_vertex(mesh).data, digest_size=16)
    digest.update(face_sizes(mesh).data)
    return digest.digest()


@dataclass(frozen=True)
class Movement:
    """What is elsewhere than in the scene that was read.

    Attributes
    ----------
    vertices, triangles, corner_normals, frames
        As in `Scene`, of all its triangles.
    whole : (t,) bool
        Which of the triangles have an area.
    lamps : dict of str to (l, 3) float32
        Columns of `Lights`.
    changed : list of str
        Names of the objects that are not there, or have other faces: they are where they were.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corner_normals: np.ndarray
    frames: ShadingFrames
    whole: np.ndarray
    lamps: dict[str, np.ndarray]
    changed: list[str]

    @staticmethod
    def between(scene: Scene, at: Layout, now: Layout, placed: PlacedMeshes, matrices: np.ndarray) -> "Movement":
        """What moved since a scene of one layout was read, by meshes that are placed anew by another.

        Parameters
        ----------
        matrices : (n, 4, 4) float32
            Of the dependency graph's instances now.
        """
        found, changed = _found(at, now)
        left = np.flatnonzero(np.bincount(at.object_of_triangle[at.whole], minlength=len(at.keys)))
        row, object_of = np.flatnonzero(at.whole), scene.object_of_triangle
        there = found[left]  # of the scene's objects: the object that each is now

        # Vertices, which are in the scene object by object
        n_vertices = at.n_vertices[left]
        first = np.cumsum(n_vertices) - n_vertices
        known = np.repeat(there >= 0, n_vertices)
        shift = np.repeat(np.append(now.first_vertex, 0)[there] - first, n_vertices)
        vertices = scene.vertices.copy()
        vertices[known] = placed.vertices[(np.arange(len(vertices)) + shift)[known]]
        lost = ~np.isfinite(vertices).all(axis=1)
        vertices[lost] = scene.vertices[lost]

        # Triangles, which the scene has those of that have an area
        k = np.flatnonzero(there[object_of] >= 0)
        of_k = there[object_of[k]]
        row_now = row[k] - at.first_triangle[left[object_of[k]]] + now.first_triangle[of_k]
        triangles, normals, whole = scene.triangles.copy(), scene.corner_normals.copy(), np.ones(len(row), bool)
        moved_by = first[object_of[k]] - now.first_vertex[of_k]
        triangles[k] = placed.triangles[row_now] + moved_by[:, None].astype(np.int32)
        normals[k], whole[k] = placed.corner_normals[row_now], placed.whole[row_now]
        frames = _frames(scene, there, k, row_now, placed, matrices[now.instance])
        return Movement(vertices, triangles, normals, frames, whole, _lamps(at.lights, now.lights), changed)

    def of(self, scene: Scene) -> Scene:
        """The scene that was read, as it is now."""
        tangents, whole = self.frames.corner_tangents, self.whole
        all_whole = bool(whole.all())

        def left(values: np.ndarray) -> np.ndarray:
            return values if all_whole or not len(values) else values[whole]

        return replace(
            scene,
            vertices=self.vertices,
            triangles=left(self.triangles),
            corner_normals=left(self.corner_normals),
            corner_uvs=left(scene.corner_uvs),
            material_of_triangle=left(scene.material_of_triangle),
            object_of_triangle=left(scene.object_of_triangle),
            lights=self._lights(scene.lights),
            frames=replace(self.frames, corner_tangents=left(tangents)),
        )

    def _lights(self, lights: Lights) -> Lights:
        n = len(self.lamps["position"])  # after them are suns of the world, which stand still
        position, axis_x, axis_y, direction = (
            np.concatenate([self.lamps[name], getattr(lights, name)[n:]]) for name in _PLACES
        )
        return replace(lights, position=position, axis_x=axis_x, axis_y=axis_y, direction=direction)


def _found(at: Layout, now: Layout) -> tuple[np.ndarray, list[str]]:
    """Which object each of a layout is in another one, (o,) int64; −1, and its name, where none is the same."""
    index = {key: i for i, key in enumerate(now.keys)}
    found = np.array([index.get(key, -1) for key in at.keys], np.int64)
    for i, j in enumerate(found):
        if j >= 0 and (at.topology[i] != now.topology[j] or at.n_vertices[i] != now.n_vertices[j]):
            found[i] = -1
    changed = list(dict.fromkeys(at.keys[i][0] for i in np.flatnonzero(found < 0)))
    return np.where(at.moves, found, -1), changed


def _frames(
    scene: Scene, there: np.ndarray, k: np.ndarray, row_now: np.ndarray, placed: PlacedMeshes, matrices: np.ndarray
) -> ShadingFrames:
    """What closures' own normals are given by, as far as the scene's need it."""
    tangents, normals = scene.frames.corner_tangents, scene.frames.normal_matrices
    if len(tangents) and placed.corner_tangents is not None:
        tangents = tangents.copy()
        tangents[k] = placed.corner_tangents[row_now]
    if len(normals):
        normals, objects = normals.copy(), np.flatnonzero(there >= 0)
        normals[objects] = normal_matrices(matrices[there[objects]].astype(np.float64))
    return ShadingFrames(tangents, normals)


def _lamps(at: Lights, now: Lights) -> dict[str, np.ndarray]:
    """Where lamps are; those that are gone are where they were."""
    index = {key: i for i, key in enumerate(_keys(now.names))}
    found = np.array([index.get(key, -1) for key in _keys(at.names)], np.int64)
    columns = {}
    for name in _PLACES:
        columns[name] = getattr(at, name).copy()
        columns[name][found >= 0] = getattr(now, name)[found[found >= 0]]
    return columns
