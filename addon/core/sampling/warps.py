"""Warps from the unit square to directions and surfaces, each with its density.

All arrays are float32; `u` is (n, 2) in [0, 1). Directions are unit vectors; z is the local axis.
"""

import numpy as np

TWO_PI = np.float32(2 * np.pi)


def sample_uniform_disk(u: np.ndarray) -> np.ndarray:
    """Points of the unit disk, (n, 2), uniform by area."""
    r, phi = np.sqrt(u[:, 0]), TWO_PI * u[:, 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1)


def pdf_uniform_disk() -> float:
    """Density of `sample_uniform_disk` by area: 1/π."""
    return 1 / np.pi


def sample_uniform_triangle(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric weights (b1, b2) of points uniform by area on a triangle, (n,) each."""
    root = np.sqrt(u[:, 0])
    return 1 - root, u[:, 1] * root


def sample_uniform_sphere(u: np.ndarray) -> np.ndarray:
    """Directions uniform by solid angle over the sphere, (n, 3)."""
    z = 1 - 2 * u[:, 0]
    r = np.sqrt(np.maximum(1 - z * z, 0))
    phi = TWO_PI * u[:, 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def pdf_uniform_sphere() -> float:
    """Density of `sample_uniform_sphere` by solid angle: 1/(4π)."""
    return 1 / (4 * np.pi)


def sample_uniform_cone(u: np.ndarray, cos_max: np.ndarray | float) -> np.ndarray:
    """Directions uniform by solid angle within the angle arccos(cos_max) of +z, (n, 3)."""
    versine = u[:, 0] * (1 - cos_max)  # 1 − cos θ, which keeps the precision of narrow cones
    z = 1 - versine
    r = np.sqrt(versine * (2 - versine))
    phi = TWO_PI * u[:, 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32)


def pdf_uniform_cone(cos_max: np.ndarray | float) -> np.ndarray | float:
    """Density of `sample_uniform_cone` by solid angle: 1/(2π(1−cos_max))."""
    return 1 / (2 * np.pi * (1 - cos_max))


def sample_versine_octaves(u: np.ndarray, narrow: np.ndarray) -> np.ndarray:
    """Directions around +z, about as many in each octave of the versine 1 − cos θ above `narrow` (n,), (n, 3)."""
    versine = narrow * np.expm1(u[:, 0] * np.log1p(2 / narrow))
    r, phi = np.sqrt(np.maximum(versine * (2 - versine), 0)), TWO_PI * u[:, 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), 1 - versine], axis=1).astype(np.float32)


def pdf_versine_octaves(versine: np.ndarray, narrow: np.ndarray) -> np.ndarray:
    """Density of `sample_versine_octaves` by solid angle: with v the versine and s narrow, 1/(2π (s+v) ln(1 + 2/s))."""
    return 1 / (2 * np.pi * (narrow + versine) * np.log1p(2 / narrow))


def sample_cosine_hemisphere(u: np.ndarray) -> np.ndarray:
    """Directions around +z with density cos θ/π, (n, 3)."""
    disk = sample_uniform_disk(u)
    z = np.sqrt(np.maximum(1 - u[:, 0], 0))
    return np.concatenate([disk, z[:, None]], axis=1)


def pdf_cosine_hemisphere(cos_theta: np.ndarray) -> np.ndarray:
    """Density of `sample_cosine_hemisphere` by solid angle: cos θ/π above the horizon, 0 below."""
    return np.maximum(cos_theta, 0) / np.float32(np.pi)


def sample_halfway_hemisphere(u: np.ndarray) -> np.ndarray:
    """Directions around +z halfway between cosine-weighted and uniform, (n, 3): density (cos θ + 1/2)/(2π).

    z = cos θ has the distribution function (z² + z)/2.
    """
    z = (np.sqrt(1 + 8 * u[:, 0]) - 1) / 2
    r, phi = np.sqrt(np.maximum(1 - z * z, 0)), TWO_PI * u[:, 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def pdf_halfway_hemisphere(cos_theta: np.ndarray) -> np.ndarray:
    """Density of `sample_halfway_hemisphere` by solid angle: (cos θ + 1/2)/(2π) above the horizon, 0 below."""
    return np.where(cos_theta >= 0, (cos_theta + np.float32(0.5)) / TWO_PI, np.float32(0))


def frame(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors that make a right-handed orthonormal frame with unit normals (n, 3): (tangent, bitangent).

    Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
    """
    tangent, bitangent = _frame_columns(normal)
    return np.stack(tangent, axis=1), np.stack(bitangent, axis=1)


def _frame_columns(normal: np.ndarray) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """The x, y and z of the tangents and bitangents, (n,) each."""
    x, y, z = normal.T
    sign = np.copysign(np.float32(1), z)
    a = -1 / (sign + z)
    b = x * y * a
    return (1 + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)


def to_world(local: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Local directions (n, 3) turned so that +z is the normal (n, 3)."""
    x, y, z = local.T
    columns = zip(*_frame_columns(normal), normal.T, strict=True)
    return np.stack([x * t + y * b + z * n for t, b, n in columns], axis=1)
