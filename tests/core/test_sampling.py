"""Every sampler against its density (χ²), and the streams and codes around them."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import slices
from photon_bake.addon.core.sampling import warps
from photon_bake.addon.core.sampling.octahedral import decode_octahedral, encode_octahedral
from photon_bake.addon.core.sampling.sobol import N_DIMENSIONS, sobol_points, sobol_seeds
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.tests.core.scenes import chi_square, chi_square_of_directions
from photon_bake.tests.core.warp_loops import sample_cosine_uniform_mixture, sample_uniform_sphere
from scipy import stats
from scipy.stats import qmc

N = 200_000


@pytest.fixture
def u():
    return stream(1, 2).random((N, 2), dtype=np.float32)


def test_cosine_hemisphere(u):
    assert chi_square_of_directions(warps.sample_cosine_hemisphere(u), lambda z: np.maximum(z, 0) / np.pi) > 1e-3


def test_cosine_uniform_mixture(u):
    def pdf(z):
        return (z >= 0) * (z + 0.5) / (2 * np.pi)

    assert chi_square_of_directions(sample_cosine_uniform_mixture(u), pdf) > 1e-3


def test_uniform_sphere(u):
    directions = sample_uniform_sphere(u)
    assert chi_square_of_directions(directions, lambda z: np.full_like(z, 1 / (4 * np.pi))) > 1e-3


@pytest.mark.parametrize("cos_max", [-1.0, 0.0, 0.35, 0.9])
def test_uniform_cone(u, cos_max):
    directions = warps.sample_uniform_cone(u, cos_max)
    assert chi_square_of_directions(directions, lambda z: (z >= cos_max) / (2 * np.pi * (1 - cos_max))) > 1e-3


def test_narrow_cones_stay_narrow(u):
    directions = warps.sample_uniform_cone(u, np.cos(0.0046))
    sine = np.hypot(directions[:, 0], directions[:, 1])
    assert sine.max() <= np.sin(0.0046) * 1.001
    assert stats.kstest(sine**2 / np.sin(0.0046) ** 2, "uniform").pvalue > 1e-3


def test_uniform_disk(u):
    points = warps.sample_uniform_disk(u)
    counts, _, _ = np.histogram2d(
        (points**2).sum(1),
        np.arctan2(points[:, 1], points[:, 0]),
        [np.linspace(0, 1, 21), np.linspace(-np.pi, np.pi, 17)],
    )
    assert chi_square(counts, np.full(counts.shape, N / counts.size)) > 1e-3


def test_uniform_triangle(u):
    b1, b2 = warps.sample_uniform_triangle(u)
    assert (b1 >= 0).all() and (b2 >= 0).all() and (b1 + b2 <= 1 + 1e-6).all()
    # The triangle cut into 16 equal ones
    i, j = (b1 * 4).astype(int), (b2 * 4).astype(int)
    upper = b1 * 4 - i + b2 * 4 - j > 1
    counts = np.bincount(i * 8 + j * 2 + upper, minlength=32)
    assert chi_square(counts[counts > 0], np.full(16, N / 16)) > 1e-3


def test_frames_are_orthonormal_and_right_handed(u):
    normals = sample_uniform_sphere(u[:1000])
    normals[:2] = [[0, 0, 1], [0, 0, -1]]
    tangent, bitangent = warps.frame(normals)
    basis = np.stack([tangent, bitangent, normals], axis=1)
    assert np.allclose(basis @ basis.transpose(0, 2, 1), np.eye(3), atol=1e-5)
    assert np.allclose(np.linalg.det(basis), 1, atol=1e-5)
    z = np.tile(np.array([[0, 0, 1]], np.float32), (1000, 1))
    assert np.allclose(warps.to_world(z, normals), normals)


def test_points_of_circles_are_cosines_and_sines():
    v = np.append(np.arange(8) / 8, np.random.default_rng(3).random(N)).astype(np.float32)
    found = warps.sample_uniform_disk(np.stack([np.ones_like(v), v], axis=1))
    angle = 2 * np.pi * v.astype(np.float64)
    assert np.abs(found - np.stack([np.cos(angle), np.sin(angle)], axis=1)).max() < 2e-7


def test_octahedral_code_keeps_directions(u):
    vectors = sample_uniform_sphere(u)
    vectors[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    decoded = decode_octahedral(encode_octahedral(vectors))
    assert np.linalg.norm(decoded - vectors, axis=1).max() < 7e-5


def test_streams_depend_on_seed_and_key_only():
    assert np.array_equal(stream(1, 2, 3).random(5), stream(1, 2, 3).random(5))
    draws = {stream(*key).random() for key in [(1, 2, 3), (1, 2, 4), (1, 3, 2), (2, 2, 3), (1, 2)]}
    assert len(draws) == 5


def test_sobol_chunks_are_one_sequence():
    seeds = sobol_seeds(1, 7, 1)
    whole = sobol_points(seeds, 0, 0, 1000)
    parts = np.concatenate([sobol_points(seeds, 0, part.start, part.stop - part.start) for part in slices(1000, 128)])
    assert np.array_equal(whole, parts)
    assert whole.dtype == np.float32 and whole.min() >= 0 and whole.max() < 1
    # Far more even than random points: each of 8 × 8 × 8 cells of 512 points holds one
    cells = (whole[:512, :3] * 8).astype(int)
    assert len(np.unique(cells @ [64, 8, 1])) > 480


def test_sobol_points_have_one_in_each_interval():
    """Scrambling keeps that 2ᵏ points have one in each of 2ᵏ intervals, and of the first two dimensions' boxes."""
    seeds, n = sobol_seeds(3, 1, 2), 4096
    for sequence in range(3):
        points = sobol_points(seeds, sequence, 0, n)
        cells = np.sort((points * n).astype(int), axis=0)
        assert (cells == np.arange(n)[:, None]).all()
        for columns in (1, 8, 64, 512, n):
            i, j = (points[:, :2] * [columns, n // columns]).astype(int).T
            assert len(np.unique(i * (n // columns) + j)) == n


def test_sobol_points_are_those_of_joe_and_kuo():
    """Exchanges of halves, as scrambling is, leave which points share all their first bits: SciPy's in Gray code."""
    n = 256
    ours = (sobol_points(sobol_seeds(1, 5), 0, 0, n) * 16).astype(int)
    gray = np.arange(n) ^ (np.arange(n) >> 1)
    theirs = (qmc.Sobol(N_DIMENSIONS, scramble=False).random(n) * 16).astype(int)[np.argsort(gray)]
    for a, b in zip(ours.T, theirs.T, strict=True):
        assert np.array_equal(a[:, None] == a, b[:, None] == b)


def test_sobol_sequences_are_their_own_and_need_no_points_before():
    seeds = sobol_seeds(2, 7)
    assert np.array_equal(sobol_points(seeds, 0, 100, 50), sobol_points(seeds, 0, 0, 150)[100:])
    assert np.array_equal(sobol_seeds(5, 7)[:2], seeds)
    assert (sobol_points(seeds, 0, 0, 1000) != sobol_points(seeds, 1, 0, 1000)).all()
