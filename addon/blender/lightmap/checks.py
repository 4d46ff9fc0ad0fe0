"""What of UV maps spoils lightmaps: found before the bake, named, with a remedy."""

from collections.abc import Sequence

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...receivers import LightmapMesh
from ...receivers.coverage import middles_in

_SPARE = 1e-4
"""How far texture coordinates may leave the image, as rounding does."""

_OVERLAP = 0.005
"""Share of an object's texels that may lie twice in the image: folds finer than what is seen."""


def check_uv(
    meshes: Sequence[LightmapMesh],
    sizes: Sequence[tuple[int, int]],
    uv_map: str,
    progress: Progress | None = None,
) -> None:
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
        if progress is not None:
            progress.check()
        _check_image([mesh for mesh in meshes if mesh.image == image], size, uv_map)


def _check_image(meshes: list[LightmapMesh], size: tuple[int, int], uv_map: str) -> None:
    if not meshes:
        return
    mesh_of_triangle = np.repeat(np.arange(len(meshes)), [len(mesh.uv) for mesh in meshes])
    texel, triangle = _middles(np.concatenate([mesh.uv for mesh in meshes]), size)
    mesh = mesh_of_triangle[triangle]
    n_all = np.bincount(mesh, minlength=len(meshes))
    over = np.bincount(texel, minlength=size[0] * size[1])[texel] > 1
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


def overlapping(uv: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Which triangles (t, 3, 2) share the middle of a texel of the image (height, width) with others."""
    texel, triangle = _middles(uv, size)
    return np.unique(triangle[np.bincount(texel, minlength=size[0] * size[1])[texel] > 1])


def _middles(uv: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Texels whose middle lies inside of a triangle: pairs of the texel's number and the triangle."""
    corners = np.clip(uv, 0, 1).astype(np.float64) * size[::-1]
    pairs = [
        (texel[:, 1].astype(np.int64) * size[1] + texel[:, 0], triangle) for triangle, texel in middles_in(corners)
    ]
    nothing = np.zeros(0, np.int64)
    texel, triangle = (np.concatenate([nothing, *column]) for column in zip((nothing, nothing), *pairs, strict=True))
    return texel, triangle
