"""The volumes that media fill, as kernels take them."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference
from ...scene import Scene
from ..embree_library import EmbreeTree


@by_reference
class MediaArrays(NamedTuple):
    """The v volumes of a scene that media fill.

    Attributes
    ----------
    any : bool
        Whether there are any.
    tree : (v,) uint64
        Embree's, of the triangles around each; 0 where the medium fills all space.
    first : (v,) int32
        Where the triangles of each tree stand in `triangle`.
    triangle : (n,) int32
        Their numbers in the scene.
    low, high : (v, 3) float32, m
        The box around each.
    absorption, scattering : (v, 3) float32, 1/m
    anisotropy : (v,) float32
    scatters : (v,) bool
    """

    any: bool
    tree: np.ndarray
    first: np.ndarray
    triangle: np.ndarray
    low: np.ndarray
    high: np.ndarray
    absorption: np.ndarray
    scattering: np.ndarray
    anisotropy: np.ndarray
    scatters: np.ndarray


class MediaVolumes:
    """The volumes of a scene that media fill: one for each object and medium, and one of all space.

    Attributes
    ----------
    arrays : MediaArrays
        What kernels take; valid as long as this object lives.
    """

    def __init__(self, scene: Scene) -> None:
        found = list(scene.media.bounded(scene.material_of_triangle, scene.object_of_triangle))
        media, triangles = [medium for medium, _ in found], [on for _, on in found]
        corners = [scene.corners(on).reshape(-1, 3) for on in triangles]
        self._trees = [_tree_of(of_volume) for of_volume in corners]
        handles = [tree.handle for tree in self._trees]
        boxes = [(of_volume.min(0), of_volume.max(0)) for of_volume in corners]
        if scene.media.of_world is not None:
            media, handles, triangles = [*media, scene.media.of_world], [*handles, 0], [*triangles, np.zeros(0, int)]
            boxes.append((np.full(3, -np.inf, np.float32), np.full(3, np.inf, np.float32)))
        ends = np.cumsum([len(on) for on in triangles])
        low, high = (np.array([box[i] for box in boxes], np.float32).reshape(-1, 3) for i in range(2))
        absorption, scattering = (
            np.array([getattr(medium, name) for medium in media], np.float32).reshape(-1, 3)
            for name in ("absorption", "scattering")
        )
        self.arrays = MediaArrays(
            any=len(media) > 0,
            tree=np.array(handles, np.uint64),
            first=np.concatenate([[0], ends])[: len(media)].astype(np.int32),
            triangle=np.concatenate([np.zeros(0, int), *triangles]).astype(np.int32),
            low=low,
            high=high,
            absorption=absorption,
            scattering=scattering,
            anisotropy=np.array([medium.anisotropy for medium in media], np.float32),
            scatters=(scattering > 0).any(axis=1),
        )


def _tree_of(corners: np.ndarray) -> EmbreeTree:
    """The tree of triangles by their corners, (3 n, 3) float32, alone: the scene may have many times as many."""
    n = len(corners) // 3
    return EmbreeTree(corners, np.arange(3 * n).reshape(n, 3), np.ones(n, bool))
