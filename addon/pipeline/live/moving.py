"""Objects that move, are reshaped or come and go: in a small tree of their own beside the large one."""

from dataclasses import dataclass, replace

import numpy as np

from ...receivers import Receivers
from ...scene import Scene, ShadingFrames
from ...tracing import TransparencyTracer
from ...tracing.embree_pair import PairTracer
from .edits import ObjectMoved, ObjectReshaped, ObjectShown, OfObject
from .state import OF_SURFACES, with_objects
from .surfaces import LiveSurfaces

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
    vertices : (n,) int64
        Row of `LiveSurfaces` that each is of.

    Attributes
    ----------
    gone : (o,) bool
        Which objects are not there.
    """

    def __init__(self, receivers: Receivers, objects: np.ndarray, vertices: np.ndarray, n_objects: int) -> None:
        self._receivers, self._objects, self._vertices = receivers, objects, vertices
        self._at_first = Receivers(receivers.position.copy(), receivers.normal.copy(), receivers.footprint.copy())
        self._parts: dict[int, _Part] = {}
        self._pair: PairTracer | None = None
        self._low: np.ndarray | None = None
        self._emits: np.ndarray | None = None
        self.gone = np.zeros(n_objects, bool)

    def restarted(self, scene: Scene, tracer: TransparencyTracer) -> TransparencyTracer:
        """A tracer that was built anew, without what is gone: nothing else lies in a tree of its own any more."""
        self._pair = self._low = None
        return self._with_pair(scene, tracer) if self.gone.any() else tracer

    def take(
        self, scene: Scene, tracer: TransparencyTracer, edit: OfObject
    ) -> tuple[Scene, TransparencyTracer, np.ndarray]:
        """The scene and its tracer after an edit; boxes around where the object was and is, (2, 2, 3) float32.

        Arrays of scenes that this returned before are written to.
        """
        first = edit.object not in self._parts
        if first:
            scene = self._with_part(scene, edit.object)
        part = self._parts[edit.object]
        before = _box(scene.vertices[part.vertices])
        if isinstance(edit, ObjectMoved):
            _put(scene, part, _moved(part.scene, edit.transform))
            self._move_receivers(np.flatnonzero(self._objects == edit.object), edit.transform)
        elif isinstance(edit, ObjectReshaped):
            part = self._parts[edit.object] = _reshaped(part, edit)
            _put(scene, part, part.scene)
            self._reshape_receivers(np.flatnonzero(self._objects == edit.object), edit)
        else:
            scene = self._with_shown(scene, edit)
        after = _box(scene.vertices[part.vertices])
        low, high = scene.bounds
        scene.__dict__["bounds"] = np.stack([np.minimum(low, after[0]), np.maximum(high, after[1])])
        self._pair = None if first else self._pair
        return scene, self._with_pair(scene, tracer), np.stack([before, after])

    def _with_pair(self, scene: Scene, tracer: TransparencyTracer) -> TransparencyTracer:
        """A tracer of the scene as it is now; which surfaces lie in one place is as it was, but for those gone."""
        if self._pair is None:
            moves = np.zeros(len(scene.objects.names), bool)
            moves[list(self._parts)] = True
            self._pair = PairTracer(scene, moves, self.gone)
        else:
            self._pair.update(scene, self.gone)
        other = tracer.lit_by(scene)
        other.surfaces = self._pair
        coincident = other.arrays.coincident
        self._low = coincident.low if self._low is None else self._low
        without = self.gone[scene.object_of_triangle[coincident.partner]]
        low = np.where(without[:, None], np.float32(np.inf), self._low)
        coincident = coincident._replace(low=low)
        other.__dict__["arrays"] = other.arrays._replace(trees=self._pair.handles, coincident=coincident)
        return other

    def _with_shown(self, scene: Scene, edit: ObjectShown) -> Scene:
        """The scene where an object that is gone gives no light."""
        self._emits = scene.objects.emits if self._emits is None else self._emits
        self.gone[edit.object] = not edit.shown
        return with_objects(scene, replace(scene.objects, emits=self._emits & ~self.gone))

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

    def _reshape_receivers(self, rows: np.ndarray, edit: ObjectReshaped) -> None:
        (mesh,) = (mesh for mesh in edit.surfaces.meshes if mesh.object == edit.object)
        found = LiveSurfaces((mesh,)).receivers().where(self._vertices[rows] - mesh.vertices.start)
        for at in (self._at_first, self._receivers):
            at.position[rows], at.normal[rows], at.footprint[rows] = found.position, found.normal, found.footprint

    def _move_receivers(self, rows: np.ndarray, transform: np.ndarray) -> None:
        at = self._at_first
        self._receivers.position[rows] = _points(at.position[rows], transform)
        self._receivers.normal[rows] = _normals(at.normal[rows], transform)


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


def _reshaped(part: _Part, edit: ObjectReshaped) -> _Part:
    """An object whose triangles have their corners elsewhere."""
    vertices = part.scene.vertices.copy()
    vertices[part.scene.triangles.ravel()] = edit.corners.reshape(-1, 3)
    frames = replace(part.scene.frames, corner_tangents=edit.corner_tangents)
    alone = replace(part.scene, vertices=vertices, corner_normals=edit.corner_normals, frames=frames)
    return replace(part, scene=alone)


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
