"""Objects that move: their triangles and vertices elsewhere, and a small tree of them beside the large one."""

from dataclasses import dataclass, replace

import numpy as np

from ...receivers import Receivers
from ...scene import Scene, ShadingFrames
from ...tracing import TransparencyTracer
from ...tracing.embree_pair import PairTracer
from .edits import ObjectMoved
from .state import OF_SURFACES

_MARGIN = 1e-4  # of the box around an object, as a share of its size


@dataclass(frozen=True)
class _Part:
    """An object where the scene that was read has it.

    Attributes
    ----------
    triangles : (t,) int
    vertices : slice
        Of the scene's, which are its own.
    scene : Scene
        Of it alone.
    """

    triangles: np.ndarray
    vertices: slice
    scene: Scene


class Moving:
    """The objects of a scene that have moved.

    Parameters
    ----------
    receivers : Receivers
        Which move with their objects: written in place.
    objects : (n,) int32
        Of each.
    """

    def __init__(self, receivers: Receivers, objects: np.ndarray) -> None:
        self._receivers, self._objects = receivers, objects
        self._at_first = Receivers(receivers.position.copy(), receivers.normal.copy(), receivers.footprint)
        self._parts: dict[int, _Part] = {}
        self._pair: PairTracer | None = None

    def restart(self) -> None:
        """The tracer was built anew: nothing lies in a tree of its own any more."""
        self._pair = None

    def move(
        self, scene: Scene, tracer: TransparencyTracer, edit: ObjectMoved
    ) -> tuple[Scene, TransparencyTracer, np.ndarray]:
        """The scene and its tracer with an object elsewhere; boxes around where that was and is, (2, 2, 3) float32.

        Arrays of scenes that this returned before are written to.
        """
        first = edit.object not in self._parts
        if first:
            scene = self._with_part(scene, edit.object)
        part = self._parts[edit.object]
        before = _box(scene.vertices[part.vertices])
        _put(scene, part, _moved(part.scene, edit.transform))
        after = _box(scene.vertices[part.vertices])
        low, high = scene.bounds
        scene.__dict__["bounds"] = np.stack([np.minimum(low, after[0]), np.maximum(high, after[1])])
        self._move_receivers(np.flatnonzero(self._objects == edit.object), edit.transform)
        if first or self._pair is None:
            moves = np.zeros(len(scene.objects.names), bool)
            moves[list(self._parts)] = True
            self._pair = PairTracer(scene, moves)
        else:
            self._pair.update(scene)
        return scene, _with_trees(tracer, scene, self._pair), np.stack([before, after])

    def _with_part(self, scene: Scene, number: int) -> Scene:
        """The scene, with arrays of its own and vertices of the object's own."""
        triangles = np.flatnonzero(scene.object_of_triangle == number)
        used, local = np.unique(scene.triangles[triangles], return_inverse=True)
        local, n = local.reshape(-1, 3).astype(np.int32), len(scene.vertices)
        alone = replace(
            scene,
            vertices=scene.vertices[used],
            triangles=local,
            corner_normals=scene.corner_normals[triangles],
            corner_uvs=scene.corner_uvs[triangles],
            material_of_triangle=scene.material_of_triangle[triangles],
            object_of_triangle=scene.object_of_triangle[triangles],
            frames=_frames_of(scene, triangles, number),
        )
        self._parts[number] = _Part(triangles, slice(n, n + len(used)), alone)
        numbers = scene.triangles.copy()
        numbers[triangles] = local + n
        frames = ShadingFrames(scene.frames.corner_tangents.copy(), scene.frames.normal_matrices.copy())
        own = replace(
            scene,
            vertices=np.concatenate([scene.vertices, scene.vertices[used]]),
            triangles=numbers,
            corner_normals=scene.corner_normals.copy(),
            frames=frames,
        )
        for name in OF_SURFACES:
            value = getattr(scene, name)
            copied = tuple(one.copy() for one in value) if isinstance(value, tuple) else np.copy(value)
            own.__dict__[name] = float(value) if name == "diagonal" else copied
        return own

    def _move_receivers(self, rows: np.ndarray, transform: np.ndarray) -> None:
        at = self._at_first
        self._receivers.position[rows] = _points(at.position[rows], transform)
        self._receivers.normal[rows] = _normals(at.normal[rows], transform)


def _with_trees(tracer: TransparencyTracer, scene: Scene, trees: PairTracer) -> TransparencyTracer:
    """A tracer of the moved scene; which surfaces lie in one place is as it was."""
    other = tracer.lit_by(scene)
    other.surfaces = trees
    other.__dict__["arrays"] = other.arrays._replace(trees=trees.handles)
    return other


def _box(vertices: np.ndarray) -> np.ndarray:
    """A little more than the box around vertices, (2, 3) float32."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    margin = _MARGIN * float(np.linalg.norm(high - low)) + 1e-6
    return np.stack([low - margin, high + margin]).astype(np.float32)


def _frames_of(scene: Scene, triangles: np.ndarray, number: int) -> ShadingFrames:
    tangents, matrices = scene.frames.corner_tangents, scene.frames.normal_matrices
    tangents = tangents[triangles] if len(tangents) else tangents
    return ShadingFrames(tangents, matrices[number : number + 1] if len(matrices) else matrices)


def _points(points: np.ndarray, transform: np.ndarray) -> np.ndarray:
    """Points (n, 3) transformed, float32."""
    linear, moved = np.asarray(transform, np.float64)[:3, :3], np.asarray(transform, np.float64)[:3, 3]
    return (points.astype(np.float64) @ linear.T + moved).astype(np.float32)


def _normals(normals: np.ndarray, transform: np.ndarray) -> np.ndarray:
    """Normals (…, 3) transformed, of unit length, float32."""
    turned = normals.astype(np.float64) @ np.linalg.inv(np.asarray(transform, np.float64)[:3, :3])
    length = np.linalg.norm(turned, axis=-1, keepdims=True)
    return (turned / np.maximum(length, 1e-30)).astype(np.float32)


def _moved(scene: Scene, transform: np.ndarray) -> Scene:
    """A scene of one object elsewhere; where it is mirrored, its normals go with its triangles' winding."""
    linear = np.asarray(transform, np.float64)[:3, :3]
    sign = np.float32(np.sign(np.linalg.det(linear)) or 1)
    tangents, matrices = scene.frames.corner_tangents, scene.frames.normal_matrices
    frames = ShadingFrames(
        (tangents.astype(np.float64) @ linear.T).astype(np.float32),
        (np.linalg.inv(linear).T @ matrices.astype(np.float64)).astype(np.float32),
    )
    return replace(
        scene,
        vertices=_points(scene.vertices, transform),
        corner_normals=sign * _normals(scene.corner_normals, transform),
        frames=frames,
    )


def _put(scene: Scene, part: _Part, moved: Scene) -> None:
    """Write a moved object into the scene's own arrays."""
    k = part.triangles
    scene.vertices[part.vertices], scene.corner_normals[k] = moved.vertices, moved.corner_normals
    scene.normals[k], scene.areas[k] = moved.normals, moved.areas
    scene.smooth[k], scene.packed_normals[k] = moved.smooth, moved.packed_normals
    scene.height_errors[k] = moved.height_errors
    if len(scene.frames.corner_tangents):
        scene.frames.corner_tangents[k] = moved.frames.corner_tangents
    if len(scene.frames.normal_matrices):
        scene.frames.normal_matrices[part.scene.object_of_triangle[:1]] = moved.frames.normal_matrices
