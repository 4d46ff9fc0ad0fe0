"""The volumes that media fill, as kernels take them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference
from ...scene import Medium, Scene
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
    low, high : (v, 3) float32, m
        The box around each.
    absorption, scattering : (v, 3) float32, 1/m
    anisotropy : (v,) float32
    scatters : (v,) bool
    """

    any: bool
    tree: np.ndarray
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
        found = list(_bounded(scene))
        media, bounds = [medium for medium, _ in found], [scene.vertices[scene.triangles[on]] for _, on in found]
        self._trees = [EmbreeTree(scene.vertices, scene.triangles, on) for _, on in found]
        handles = [tree.handle for tree in self._trees]
        boxes = [(corners.min((0, 1)), corners.max((0, 1))) for corners in bounds]
        if scene.media.of_world is not None:
            media, handles = [*media, scene.media.of_world], [*handles, 0]
            boxes.append((np.full(3, -np.inf, np.float32), np.full(3, np.inf, np.float32)))
        low, high = (np.array([box[i] for box in boxes], np.float32).reshape(-1, 3) for i in range(2))
        absorption, scattering = (
            np.array([getattr(medium, name) for medium in media], np.float32).reshape(-1, 3)
            for name in ("absorption", "scattering")
        )
        self.arrays = MediaArrays(
            any=len(media) > 0,
            tree=np.array(handles, np.uint64),
            low=low,
            high=high,
            absorption=absorption,
            scattering=scattering,
            anisotropy=np.array([medium.anisotropy for medium in media], np.float32),
            scatters=(scattering > 0).any(axis=1),
        )


def _bounded(scene: Scene) -> Iterator[tuple[Medium, np.ndarray]]:
    """The medium and the triangles (t,) bool of each volume that triangles bound."""
    for material, medium in enumerate(scene.media.of_material):
        if medium is None:
            continue
        on = scene.material_of_triangle == material
        for object_ in np.unique(scene.object_of_triangle[on]):
            yield medium, on & (scene.object_of_triangle == object_)
