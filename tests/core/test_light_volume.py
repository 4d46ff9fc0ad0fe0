"""The light-gathering volume: its parts against integrals, its light against closed forms."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.octahedral import encode_octahedral
from photon_bake.addon.core.sampling.spherical_harmonics import Y0, sh_basis, sh_cosine_lobe
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere, to_world
from photon_bake.addon.gather.light_volume import Cascade, Grid, LightVolume
from photon_bake.addon.gather.light_volume.injection import lit_sides, response_of
from photon_bake.addon.gather.light_volume.occlusion import transmittance
from photon_bake.addon.gather.light_volume.propagation import (
    DIRECTIONS,
    face_moments,
    padded,
    propagate,
    transfer,
    transfer_matrices,
)
from photon_bake.addon.gather.screen_volume.sh_fields import sh_response
from photon_bake.addon.photons import PathKind, Photons
from photon_bake.addon.scene.surface_points import surface_points
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, receivers_at, receivers_in_box, scene_of

NORMALS = np.array([(0, 0, 1), (0.6, 0, -0.8), (-2 / 3, 1 / 3, 2 / 3)], np.float32)


def sphere_rule(n=64):
    """Directions and weights that integrate over the sphere: Gauss's rule along z, even steps around it."""
    z, weights = np.polynomial.legendre.leggauss(n)
    phi = np.arange(2 * n) * np.pi / n
    r = np.sqrt(1 - z**2)[:, None]
    directions = np.stack([r * np.cos(phi), r * np.sin(phi), np.broadcast_to(z[:, None], (n, 2 * n))], axis=2)
    return directions.reshape(-1, 3), np.repeat(weights, 2 * n) * np.pi / n


def test_basis_is_orthonormal():
    directions, weights = sphere_rule()
    y = sh_basis(directions)
    assert np.einsum("n,na,nb->ab", weights, y, y) == pytest.approx(np.eye(4), abs=1e-5)


@pytest.mark.parametrize("normal", NORMALS)
def test_cosine_lobe_and_response_are_their_integrals(normal):
    directions, weights = sphere_rule(200)
    cosine, y = np.maximum(directions @ normal, 0), sh_basis(directions)
    lobe = np.einsum("n,na->a", weights * cosine, y)
    response = np.einsum("n,na,nb->ab", weights * cosine, y, y)
    assert sh_cosine_lobe(normal[None])[0] == pytest.approx(lobe, abs=1e-3)
    assert sh_response(normal[None])[0] == pytest.approx(response, abs=1e-3)


def test_face_moments_are_their_integrals():
    """Against quadrature over a slanted rectangle: dω = cos dA/r²."""
    corner, s, t = np.array([-0.3, 0.2, 0.9]), np.array([1.0, 0.1, 0.2]), np.array([-0.1, 0.8, 0.3])
    nodes, weights = np.polynomial.legendre.leggauss(60)
    at, weights = (nodes + 1) / 2, np.outer(weights, weights) / 4
    points = corner + at[:, None, None] * s + at[None, :, None] * t
    r = np.linalg.norm(points, axis=2)
    solid_angle = np.abs(points @ np.cross(s, t)) / r**3 * weights
    moments = [solid_angle.sum(), *np.einsum("ij,ijk->k", solid_angle / r, points)]
    corners = np.array([corner, corner + s, corner + s + t, corner + t])
    assert face_moments(corners) == pytest.approx(moments, rel=1e-9)


def test_what_a_cell_sends_its_neighbours_get():
    """The six neighbours' fluxes add up to all of the cell's, and a turned cell sends turned light."""
    matrices = transfer_matrices()
    assert matrices[:, 0].sum(axis=0) == pytest.approx([1, 0, 0, 0], abs=1e-6)
    up = int(np.flatnonzero(DIRECTIONS[:, 2] > 0)[0])
    for matrix, direction in zip(matrices, DIRECTIONS, strict=True):
        axis = np.abs(direction).argmax()
        assert matrix[0, 0] == pytest.approx(1 / 6, abs=1e-6)
        assert matrix[0, 1 + axis] * direction[axis] == pytest.approx(matrices[up][0, 3], abs=1e-6)
        assert matrix[1 + axis, 1 + axis] == pytest.approx(matrices[up][3, 3], abs=1e-6)


def received(field, passes):
    """What cells (4, nx, ny, nz) get of each other in one iteration, with the transmittance (3, nx, ny, nz)."""
    field, passes = (padded(np.moveaxis(grid, 0, -1)) for grid in (field, passes))
    new = np.zeros_like(field)
    propagate(transfer(), field, passes, new)
    return np.moveaxis(new[1:-1, 1:-1, 1:-1], -1, 0)


def test_cells_send_by_the_matrices():
    """The kernel, which knows five numbers of them, sends what all six matrices say."""
    field = np.zeros((4, 3, 3, 3), np.float32)
    field[:, 1, 1, 1] = [1.0, 0.3, -0.2, 0.5]
    got = received(field, np.ones((3, 3, 3, 3), np.float32))
    for matrix, direction in zip(transfer_matrices(), DIRECTIONS.astype(int), strict=True):
        assert got[(slice(None), *(1 + direction))] == pytest.approx(matrix @ field[:, 1, 1, 1], abs=1e-6)


def test_energy_is_conserved_where_nothing_blocks():
    """Ten iterations in a grid that light does not leave; and light that is the same all around stays symmetric."""
    field = np.zeros((4, 23, 23, 23), np.float32)
    field[:, 11, 11, 11] = [1.0, 0.3, -0.2, 0.5]
    open_ = np.ones((3, 23, 23, 23), np.float32)
    for _ in range(10):
        field = received(field, open_)
    assert field[0].sum(dtype=np.float64) == pytest.approx(1, abs=1e-5)
    even = np.zeros_like(field)
    even[0, 11, 11, 11] = 1
    for _ in range(5):
        even = received(even, open_)
    for axis in range(3):
        assert even[0] == pytest.approx(np.flip(even[0], axis), abs=1e-7)
        assert even[1 + axis] == pytest.approx(-np.flip(even[1 + axis], axis), abs=1e-7)
    assert even[0] == pytest.approx(even[0].transpose(1, 2, 0), abs=1e-7)


def test_blocked_faces_pass_nothing():
    field = np.zeros((4, 5, 5, 5), np.float32)
    field[0, 2, 2, 2] = 1
    passes = np.ones((3, 5, 5, 5), np.float32)
    passes[0, 2, 2, 2] = 0  # from the middle towards +x
    passes[1, 2, 1, 2] = 0.25  # between the middle and its neighbour in −y
    got = received(field, passes)[0]
    assert got[3, 2, 2] == 0 and got[1, 2, 2] == pytest.approx(1 / 6)
    assert got[2, 1, 2] == pytest.approx(0.25 / 6)


def test_surface_points_stand_for_the_area_in_the_box():
    """A ground plane a thousand times as wide as the box does not cost more for that."""
    scene = scene_of(*merge(box(0.5), plane(1000.0)))
    parts = list(surface_points(scene, np.array([[-1, -1, -1], [1, 1, 1.0]]), 0.05))
    position = np.concatenate([part.position for part in parts])
    triangle = np.concatenate([part.triangle for part in parts])
    in_cube = triangle < 12
    assert in_cube.sum() * parts[0].area == pytest.approx(6, rel=0.01)
    counts = np.histogram2d(*position[~in_cube, :2].T, bins=[np.linspace(-1, 1, 5)] * 2)[0]
    assert counts * parts[0].area == pytest.approx(np.full((4, 4), 0.25), rel=0.05)
    assert len(position) < 10_000


def test_transmittance_is_the_open_share():
    """A wall over all of the cells stops all light across it; one over half of each, half of it."""
    whole, half = plane(2.0), plane(2.0)
    half[0][half[0][:, 0] > 0, 0] = 0.0
    for mesh, expected in ((whole, 0.0), (half, 0.5)):
        scene = scene_of(*mesh)
        tracer = EmbreeTracer(scene)
        grid = Grid(np.array([-1.49, -1.49, -1.01], np.float32), 1.0, (3, 3, 2))
        response, _ = response_of(grid, lit_sides(scene, TransparencyTracer(scene, tracer), grid, 32, Workers()))
        passes = transmittance(tracer, grid, response, Workers())
        assert passes[1, 1, 0, 2] == expected
        assert passes[1, 1, 0, 0] == 1


def photons_of_even_light(n, half=1.0, seed=1):
    """Photons that radiance 1 from everywhere brings to the walls of `box`: E = π."""
    random = np.random.default_rng(seed)
    at = receivers_in_box(n // 6, half, lift=0.0, seed=seed)
    n = len(at)
    direction = -to_world(sample_cosine_hemisphere(random.random((n, 2), np.float32)), at.normal)
    power = np.full((n, 3), np.pi * 6 * (2 * half) ** 2 / n, np.float32)
    zeros = np.zeros(n, np.int32)
    return Photons(
        position=at.position,
        power=power,
        packed_direction=encode_octahedral(direction.astype(np.float32)),
        packed_normal=encode_octahedral(at.normal),
        triangle=zeros,
        path=np.arange(n, dtype=np.int32),
        path_density=np.ones(n, np.float32),
        kind=np.full(n, PathKind.INDIRECT, np.uint8),
        bounce=np.ones(n, np.uint8),
    )


def volume_of(scene, photons, n_cells, n_iterations):
    grid = Grid.over(scene.bounds, n_cells)
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    return Cascade((LightVolume.of_photons(scene, tracer, photons, grid, n_iterations, Workers()),))


@pytest.mark.parametrize(("n_cells", "n_iterations"), [(1, 0), (8, 0), (8, 2), (16, 4), (24, 24)])
def test_even_light_has_its_absolute_level_everywhere(n_cells, n_iterations):
    """Walls, edges and corners of a closed box in light of radiance 1 read E = π, however coarse the grid."""
    scene, at = scene_of(*box()), receivers_in_box(200)
    cascade = volume_of(scene, photons_of_even_light(600_000), n_cells, n_iterations)
    irradiance, stderr = cascade.irradiance(at.position, at.normal, Workers())
    assert irradiance.mean() == pytest.approx(np.pi, rel=0.01)
    assert irradiance == pytest.approx(np.full_like(irradiance, np.pi), rel=0.15)
    assert stderr.max() < 0.2 * np.pi


def test_radiance_has_the_light_s_directions():
    """In even light the constant band is 1/Y₀; the linear band, which walls on one side hardly know, stays small."""
    scene, at = scene_of(*box()), receivers_in_box(100)
    radiance = volume_of(scene, photons_of_even_light(600_000), 12, 3).radiance(at.position, at.normal)
    assert radiance[:, :3, 0].mean() == pytest.approx(1 / Y0, rel=0.02)
    assert np.abs(radiance[:, :3, 1:]).mean() < 0.1 / Y0


def test_stderr_is_the_error():
    """Over several sets of photons, errors are as large as the signed fields say."""
    scene, at = scene_of(*box()), receivers_in_box(50)
    errors, said = [], []
    for seed in range(4):
        cascade = volume_of(scene, photons_of_even_light(30_000, seed=seed), 12, 3)
        irradiance, stderr = cascade.irradiance(at.position, at.normal, Workers(seed))
        errors.append(irradiance[:, 0] - np.pi)
        said.append(stderr)
    assert 0.8 < np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(said))) < 1.25


def test_surfaces_without_photons_do_not_dim_the_light():
    """Two of the walls are mirrors, on which no photons are stored; the others read E = π all the same."""
    mirror = [1, 1, 0, 0, 0, 0] * 2  # the walls at x = ±1
    scene, at, photons = (
        scene_of(*box(), albedo=[0.5, 0.0], material=mirror),
        receivers_in_box(100),
        photons_of_even_light(300_000),
    )
    stored = np.abs(photons.position[:, 0]) < 0.9999
    irradiance, _ = volume_of(scene, photons.where(stored), 12, 3).irradiance(at.position, at.normal, Workers())
    assert irradiance.mean() == pytest.approx(np.pi, rel=0.03)


@pytest.mark.parametrize("n_cells", [4, 9, 13, 20])
def test_nothing_bleeds_through_a_wall(n_cells):
    """A wall without thickness cuts a box in two, light in the left half: the right one stays dark."""
    wall = plane(1.0)[0][:, [2, 0, 1]], plane(1.0)[1]
    (vertices, triangles), at = box(), receivers_in_box(100)
    scene = scene_of(*merge((vertices * np.float32([2, 1, 1]), triangles), wall))
    photons = photons_of_even_light(60_000)
    photons.position[:, 0] -= 1
    cascade = volume_of(scene, photons, n_cells, n_cells // 4)
    lit, dark = (cascade.irradiance(at.position + np.float32([x, 0, 0]), at.normal, Workers())[0] for x in (-1, 1))
    assert dark.max() == 0
    assert lit.mean() == pytest.approx(np.pi, rel=0.05)


def test_cascade_is_finer_where_receivers_are_and_photons_too():
    """Receivers in a corner of a wide hall get a volume of their own, if there are photons for it."""
    scene = scene_of(*box(50.0))
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    at = receivers_at(np.random.default_rng(0).uniform(-50, -45, (500, 3)), (0, 0, 1)).position
    photons = photons_of_even_light(600_000, 50.0)
    cells = [
        [volume.grid.length for volume in Cascade.of_photons(scene, tracer, some, at, 16, Workers()).volumes]
        for some in (photons, photons.where(slice(None, None, 100)))
    ]
    assert cells[0][0] == pytest.approx(100 / 16) and cells[0][1] == pytest.approx(5 / 16, rel=0.1)
    assert len(cells[1]) == 1


def test_no_photons_and_no_surfaces_read_nothing():
    for scene in (scene_of(*box()), scene_of(np.zeros((0, 3)), [])):
        light = volume_of(scene, Photons.none(), 4, 1).irradiance(np.zeros((2, 3), np.float32), NORMALS[:2], Workers())
        assert not light[0].any() and not light[1].any()
