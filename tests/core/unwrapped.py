"""Meshes with places in lightmaps, and bilinear look-ups, for tests that know the answer."""

import numpy as np
from photon_bake.addon.receivers import LightmapMesh
from photon_bake.tests.core.scenes import box, plane


def turned(degrees) -> np.ndarray:
    """A rotation of the plane, for points in rows."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, s], [-s, c]])


def mesh_of(positions, uv, normals=None, image=0, name="Mesh") -> LightmapMesh:
    """Triangles (t, 3, 3) with UVs (t, 3, 2); without normals each has its own."""
    positions = np.asarray(positions, np.float32)
    if normals is None:
        normals = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])[:, None]
        normals = np.repeat(normals / np.linalg.norm(normals, axis=2, keepdims=True), 3, axis=1)
    return LightmapMesh(name, image, positions, np.asarray(normals, np.float32), np.asarray(uv, np.float32))


def unwrapped_plane(scale=0.3, degrees=0.0) -> LightmapMesh:
    """`plane` from −1 to 1, whose UVs are its x and y turned, scaled and moved to the image's middle."""
    vertices, triangles = plane()
    corners = vertices[triangles]
    return mesh_of(corners, corners[..., :2] @ turned(degrees) * scale + 0.5)


def unwrapped_box(padding, inwards=True, degrees=0.0, smooth=False, half=1.0) -> LightmapMesh:
    """`box`, each wall a chart of its own in a third by a half of the image, less `padding`, turned a little each.

    `smooth` gives it the normals of a ball.
    """
    vertices, triangles = box(half, inwards)
    corners = vertices[triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(facing).argmax(axis=1)
    wall = axis + 3 * (np.take_along_axis(facing, axis[:, None], axis=1)[:, 0] > 0)
    uv = np.zeros((12, 3, 2))
    for k in range(12):
        flat = np.delete(corners[k], axis[k], axis=1) / half @ turned(degrees * wall[k])
        largest = np.abs(np.array([(1, 1), (1, -1)]) @ turned(degrees * wall[k])).max()
        place = flat / largest / 2 * (np.array([1 / 3, 1 / 2]).min() - 2 * padding)
        middle = (wall[k] % 3 + 0.5) / 3, (wall[k] // 3 + 0.5) / 2
        uv[k] = place + np.array(middle)
    normals = corners / np.linalg.norm(corners, axis=2, keepdims=True) if smooth else None
    return mesh_of(corners, uv, normals)


def look_up(image, uv) -> np.ndarray:
    """Bilinear look-ups of an image (h, w, c), row 0 at v = 0, at (n, 2): as renderers do, clamped at its border."""
    size = np.array(image.shape[1::-1])
    at = np.clip(np.asarray(uv) * size - 0.5, 0, size - 1)
    low = np.minimum(at.astype(int), size - 2)
    share = at - low
    values = 0.0
    for x in (0, 1):
        for y in (0, 1):
            weight = np.where(x, share[:, 0], 1 - share[:, 0]) * np.where(y, share[:, 1], 1 - share[:, 1])
            values = values + weight[:, None] * image[low[:, 1] + y, low[:, 0] + x]
    return values


def points_on(mesh, n, seed=0) -> tuple[np.ndarray, np.ndarray]:
    """Random points of a mesh's triangles, many of them close to edges: positions and UVs."""
    random = np.random.default_rng(seed)
    k, weights = random.integers(0, len(mesh.uv), n), random.dirichlet((0.4, 0.4, 0.4), n)
    return tuple(np.einsum("nk,nki->ni", weights, corners[k].astype(float)) for corners in (mesh.positions, mesh.uv))
