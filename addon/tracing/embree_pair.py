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
    """

    def __init__(self, scene: Scene, moves: np.ndarray) -> None:
        self._moves = moves
        self._still: dict[bytes, EmbreeTree] = {}
        self.update(scene)

    def update(self, scene: Scene) -> None:
        """The same after its objects have moved, whose tree alone is built anew."""

        def tree(objects: np.ndarray) -> EmbreeTree:
            return EmbreeTree(scene.vertices, scene.triangles, objects[scene.object_of_triangle])

        def pair(objects: np.ndarray) -> TreeOfTrees:
            key = objects.tobytes()
            if key not in self._still:
                self._still[key] = tree(objects & ~self._moves)
            return TreeOfTrees(self._still[key], tree(objects & self._moves))

        self._build(scene, pair)
