"""Embree's trees in two parts: a large one of what stands still, built once, and a small one of what moves.

Both are instanced by a tree of two, which kernels take like any other: an instance's triangles keep their numbers.
"""

import ctypes
import weakref

import numpy as np

from ..scene import RayKind, Scene, seen_by
from .embree import EmbreeTracer
from .embree_library import EmbreeTree, _call, _device

_P, _U, _INSTANCE, _ROBUST = ctypes.c_void_p, ctypes.c_uint, 121, 4


class PairTree:
    """A tree of two trees, which it keeps alive.

    Attributes
    ----------
    handle : int
        What kernels take.
    """

    def __init__(self, still: EmbreeTree, moving: EmbreeTree) -> None:
        self._parts, device = (still, moving), _device()
        self.handle: int = _call("rtcNewScene", _P, device)
        weakref.finalize(self, _call, "rtcReleaseScene", None, _P(self.handle))
        _call("rtcSetSceneFlags", None, _P(self.handle), ctypes.c_int(_ROBUST))
        for part in self._parts:
            geometry = _P(_call("rtcNewGeometry", _P, device, ctypes.c_int(_INSTANCE)))
            _call("rtcSetGeometryInstancedScene", None, geometry, _P(part.handle))
            _call("rtcCommitGeometry", None, geometry)
            _call("rtcAttachGeometry", _U, _P(self.handle), geometry)
            _call("rtcReleaseGeometry", None, geometry)
        _call("rtcCommitScene", None, _P(self.handle))


class PairTracer(EmbreeTracer):
    """An `EmbreeTracer` of a scene in which some objects move.

    Parameters
    ----------
    scene : Scene
    moves : (o,) bool
        Which of the objects do.
    """

    def __init__(self, scene: Scene, moves: np.ndarray) -> None:
        self._moves = moves[scene.object_of_triangle]
        self._seen = [seen_by(scene.objects, kind) for kind in RayKind]
        self._still = self._built(scene, ~self._moves)
        self.update(scene)

    def update(self, scene: Scene) -> None:
        """The same after its objects have moved, whose tree alone is built anew."""
        moving, pairs = self._built(scene, self._moves), dict[bytes, PairTree]()
        for key, tree in moving.items():
            pairs[key] = PairTree(self._still[key], tree)
        self._normals, self._pairs = scene.normals, pairs
        self.handles = np.array([pairs[seen.tobytes()].handle for seen in self._seen], np.uint64)

    def _built(self, scene: Scene, included: np.ndarray) -> dict[bytes, EmbreeTree]:
        """A tree of some triangles for all rays that see the same objects."""
        trees = dict[bytes, EmbreeTree]()
        for seen in self._seen:
            if seen.tobytes() not in trees:
                chosen = seen[scene.object_of_triangle] & included
                trees[seen.tobytes()] = EmbreeTree(scene.vertices, scene.triangles, chosen)
        return trees
