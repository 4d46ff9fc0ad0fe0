"""What of UV maps spoils lightmaps: found before the bake, named, with a remedy."""

from collections.abc import Callable, Sequence

import numpy as np

from ...core.progress import Progress
from ...receivers import LightmapMesh
from ...receivers.lightmap.coverage import middles_in

_SPARE = 1e-4
"""How far texture coordinates may leave the image, as rounding does."""

OVERLAP = 0.005
"""Share of an object's texels that may lie twice in the image: folds finer than what is seen."""


def uv_problems(
    meshes: Sequence[LightmapMesh],
    doubtful: Sequence[bool],
    sizes: Sequence[tuple[int, int]],
    uv_map: str,
    slack: int,
    progress: Progress,
) -> dict[int, str]:
    """The meshes whose texture coordinates cannot serve, by their numbers, and a sentence that says why and what to do.

    They leave their images, or two faces lie in one place. Of meshes that lie on each other, those go of which the
    largest share does.

    Parameters
    ----------
    doubtful : sequence of bool
        Which of the meshes may have such; the others were laid out so that they have not.
    slack : int
        Texels of a mesh that others may have whatever its size.
    """
    problems = {}
    for i, mesh in enumerate(meshes):
        inside = ((mesh.uv >= -_SPARE) & (mesh.uv <= 1 + _SPARE)).all(axis=(1, 2))
        if not inside.all():
            problems[i] = (
                f"The UV map '{uv_map}' of object '{mesh.object_name}' leaves the square from 0 to 1 with "
                f"{(~inside).sum():,} of its {len(inside):,} triangles: pack its islands, or choose no UV map and have "
                "one made."
            )
    for image in {mesh.image for mesh, may in zip(meshes, doubtful, strict=True) if may}:
        progress.check()
        there = [i for i, mesh in enumerate(meshes) if mesh.image == image and i not in problems]
        problems |= _overlaps(meshes, there, doubtful, sizes[image], uv_map, slack, progress)
    return problems


def _overlaps(
    meshes: Sequence[LightmapMesh],
    there: list[int],
    doubtful: Sequence[bool],
    size: tuple[int, int],
    uv_map: str,
    slack: int,
    progress: Progress,
) -> dict[int, str]:
    """Those of the meshes of an image that lie over themselves or over others, the worst first."""
    if not there:
        return {}
    mesh_of_triangle = np.repeat(there, [len(meshes[i].uv) for i in there])
    texel, triangle = middles(np.concatenate([meshes[i].uv for i in there]), size, progress.check)
    mesh = mesh_of_triangle[triangle]
    n_all = np.bincount(mesh, minlength=len(meshes))
    problems: dict[int, str] = {}
    may_go = np.array(doubtful, bool)
    while True:
        progress.check()
        over = np.bincount(texel, minlength=size[0] * size[1])[texel] > 1
        n_over = np.bincount(mesh[over], minlength=len(meshes))
        share = np.where(may_go & (n_over > slack), n_over / np.maximum(n_all, 1), 0)
        worst = int(np.argmax(share))
        if share[worst] <= OVERLAP:
            return problems
        partners = np.bincount(mesh[over & np.isin(texel, texel[over & (mesh == worst)]) & (mesh != worst)])
        problems[worst] = _overlap(meshes, worst, partners, float(share[worst]), uv_map)
        others = mesh != worst
        texel, mesh = texel[others], mesh[others]


def _overlap(meshes: Sequence[LightmapMesh], worst: int, partners: np.ndarray, share: float, uv_map: str) -> str:
    """A sentence about a mesh a share of whose texels others have too, or itself twice; texels by partner (m,)."""
    name = meshes[worst].object_name
    if partners.any():
        return (
            f"Objects '{name}' and '{meshes[int(np.argmax(partners))].object_name}' lie in one place of UV map "
            f"'{uv_map}': let objects have images of their own, or choose no UV map and have one made."
        )
    return (
        f"The UV map '{uv_map}' of object '{name}' lies over itself in {share:.0%} of its texels: unwrap it without "
        "overlaps, apply modifiers that copy faces, or choose no UV map and have one made."
    )


def overlap_share(uv: np.ndarray, size: tuple[int, int]) -> float:
    """Share of the texels of triangles (t, 3, 2) in an image (height, width) that more than one of them has."""
    texel, _ = middles(uv, size)
    return float((np.bincount(texel, minlength=size[0] * size[1])[texel] > 1).mean()) if len(texel) else 0.0


def middles(
    uv: np.ndarray, size: tuple[int, int], check: Callable[[], None] = lambda: None
) -> tuple[np.ndarray, np.ndarray]:
    """Texels whose middle lies inside of a triangle: pairs of the texel's number and the triangle."""
    corners = np.clip(uv, 0, 1).astype(np.float64) * size[::-1]
    texels, triangles = [np.zeros(0, np.int64)], [np.zeros(0, np.int32)]
    for triangle, texel in middles_in(corners):
        check()
        texels.append(texel[:, 1].astype(np.int64) * size[1] + texel[:, 0])
        triangles.append(triangle)
    return np.concatenate(texels), np.concatenate(triangles)
