"""Embree's trees in two parts: a large one of what stands still, built once, and a small one of what moves."""

import numpy as np

from ..scene import Scene
from .embree import EmbreeTracer
from .embree_library import EmbreeTree, TreeOfTrees


class PairTracer(EmbreeTracer):
    """An `EmbreeTracer` of a scene in which some objects move.

    Parameters
    ----------
    scene : Scene
    moves : (o,) bool
        Which of the objects do.
    gone : (o,) bool, optional
        Which of these rays do not meet.
    """

    def __init__(self, scene: Scene, moves: np.ndarray, gone: np.ndarray | None = None) -> None:
        self._moves = moves
        self._still: dict[bytes, EmbreeTree] = {}
        self.update(scene, gone)

    def update(self, scene: Scene, gone: np.ndarray | None = None) -> None:
        """The same after its objects have moved, whose tree alone is built anew.

        Parameters
        ----------
        gone : (o,) bool, optional
            Which of them rays do not meet.
        """
        there = self._moves if gone is None else self._moves & ~gone

        def tree(objects: np.ndarray) -> EmbreeTree:
            return EmbreeTree(scene.vertices, scene.triangles, objects[scene.object_of_triangle])

        def pair(objects: np.ndarray) -> TreeOfTrees:
            key = objects.tobytes()
            if key not in self._still:
                self._still[key] = tree(objects & ~self._moves)
            return TreeOfTrees(self._still[key], tree(objects & there))

        self._build(scene, pair)
