"""What of UV maps spoils lightmaps: found before the bake, named, with a remedy."""

from collections.abc import Sequence

import numpy as np

from ..errors import BakeError
from ..parallel import Workers
from ..receivers import LightmapMesh
from ..receivers.coverage import texels_of

_SPARE = 1e-4
"""How far texture coordinates may leave the image, as rounding does."""

_OVERLAP = 0.005
"""Share of an object's texels that may lie twice in the image: folds finer than what is seen."""

_FULL = 1.01  # texels of area in a texel that are more than one


def check_uv(meshes: Sequence[LightmapMesh], sizes: Sequence[tuple[int, int]], uv_map: str, workers: Workers) -> None:
    """Make sure that texture coordinates lie in their images, and no two faces in one place.

    Raises
    ------
    BakeError
        If not, naming the object or objects and what to do.
    """
    for mesh in meshes:
        outside = ((mesh.uv < -_SPARE) | (mesh.uv > 1 + _SPARE)).any(axis=(1, 2))
        if outside.any():
            raise BakeError(
                f"The UV map '{uv_map}' of object '{mesh.object_name}' leaves the square from 0 to 1 with "
                f"{outside.sum():,} of its {len(outside):,} triangles: pack its islands, or choose no UV map and have "
                "one made."
            )
    for image, size in enumerate(sizes):
        _check_image([mesh for mesh in meshes if mesh.image == image], size, uv_map, workers)


def _check_image(meshes: list[LightmapMesh], size: tuple[int, int], uv_map: str, workers: Workers) -> None:
    if not meshes:
        return
    mesh_of_triangle = np.repeat(np.arange(len(meshes)), [len(mesh.uv) for mesh in meshes])
    texel, triangle, area = _coverage(np.concatenate([mesh.uv for mesh in meshes]), size, workers)
    mesh = mesh_of_triangle[triangle]
    n_all = np.bincount(mesh, minlength=len(meshes))
    over = np.bincount(texel, area, size[0] * size[1])[texel] > _FULL
    n_over = np.bincount(mesh[over], minlength=len(meshes))
    worst = int(np.argmax(n_over / np.maximum(n_all, 1)))
    if n_over[worst] <= _OVERLAP * n_all[worst]:
        return
    name, share = meshes[worst].object_name, n_over[worst] / n_all[worst]
    there = texel[over & (mesh == worst)]
    partners = np.bincount(mesh[over & np.isin(texel, there) & (mesh != worst)], minlength=len(meshes))
    if partners.any():
        raise BakeError(
            f"Objects '{name}' and '{meshes[int(np.argmax(partners))].object_name}' lie in one place of UV map "
            f"'{uv_map}': let objects have images of their own, or choose no UV map and have one made."
        )
    raise BakeError(
        f"The UV map '{uv_map}' of object '{name}' lies over itself in {share:.0%} of its texels: unwrap it without "
        "overlaps, apply modifiers that copy faces, or choose no UV map and have one made."
    )


def share_overlapping(uv: np.ndarray, size: tuple[int, int], workers: Workers) -> float:
    """Share of the texels of triangles (t, 3, 2) in an image (height, width) that more than one triangle fills."""
    texel, _, area = _coverage(uv, size, workers)
    total = np.bincount(texel, area, size[0] * size[1])
    return float((total > _FULL).sum() / max((total > 0).sum(), 1))


def _coverage(uv: np.ndarray, size: tuple[int, int], workers: Workers) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each overlap of a triangle with a texel: number of the texel, triangle, and area in texels."""
    width_height = np.array(size[::-1])
    corners = np.clip(uv, 0, 1).astype(np.float64) * width_height
    fragments = texels_of(corners, np.broadcast_to(width_height, (len(uv), 2)), workers)
    texel = fragments.texel[:, 1].astype(np.int64) * size[1] + fragments.texel[:, 0]
    return texel, fragments.triangle, fragments.area
