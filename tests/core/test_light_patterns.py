"""Lamps with a pattern: their power, where their photons go, and what points of them give, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.sampling.sobol import fixed_points, sobol_points, sobol_seeds
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.emitters.patterns.arrays import resampled
from photon_bake.addon.scene import LightKind, LightPattern, Lights, PatternDomain
from photon_bake.tests.core.lamp_loops import lamp_hits, light_samples
from photon_bake.tests.core.scenes import chi_square_of_directions, lamp, plane, scene_of

WHOLE = Sphere(np.zeros(3, np.float32), 3.0)
N = 1 << 16
HEIGHT, WIDTH = 64, 128
ZERO = np.zeros((1, 3), np.float32)


def angles(angle):
    """Middles of the rows' angles from the axis, (h, 1), and of the columns' azimuths, (1, w)."""
    theta = angle * (np.arange(HEIGHT) + 0.5) / HEIGHT
    return theta[:, None], np.pi - 2 * np.pi * (np.arange(WIDTH) + 0.5)[None] / WIDTH


def pattern(of, domain=PatternDomain.DIRECTIONS, angle=np.pi):
    """That of a function of the angle from the axis and of the azimuth, or of x and y in [0, 1]."""
    if domain == PatternDomain.PLACES:
        y, x = (np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5) / [[[HEIGHT]], [[WIDTH]]]
        values = of(x, y)
    else:
        values = of(*angles(angle))
    values = np.broadcast_to(values, (HEIGHT, WIDTH))
    return LightPattern(np.repeat(values[..., None], 3, 2).astype(np.float32), domain, angle)


def patterned(light_pattern, kind=LightKind.POINT, emission=1.0, **columns):
    return replace(lamp(kind, emission, **columns), patterns=(light_pattern,))


def rays_of(lights, n=N):
    (source,) = light_sources(scene_of(*plane(2.0), lights=lights), WHOLE)
    return source, source.emit(sobol_points(sobol_seeds(1, 11), 0, 0, n))


def downlight(theta, _):
    """An IES profile: cos⁴ θ below the lamp."""
    return np.cos(theta).clip(0) ** 4


POWERS = [
    # ∫ cos⁴θ dω = 2π/5
    (patterned(pattern(downlight), emission=3), 3 * 2 * np.pi / 5),
    (patterned(pattern(downlight), emission=3, radius=0.2), 3 * 2 * np.pi / 5),
    (patterned(pattern(downlight, PatternDomain.NORMALS), emission=3, radius=0.2, sphere=True), 3 * 2 * np.pi / 5),
    # Half a cone: 2π (1 − cos α) / 2
    (
        patterned(pattern(lambda _, phi: phi > 0, angle=0.5), LightKind.SPOT, emission=2, angle=1.0),
        2 * np.pi * (1 - np.cos(0.5)),
    ),
    # ∫ L cos³θ dω A = 2π/4 L A
    (
        patterned(pattern(lambda t, _: np.cos(t) ** 2, angle=np.pi / 2), LightKind.RECTANGLE, 3, size=(0.5, 2)),
        3 * np.pi / 2,
    ),
    # A third of a rectangle, and the mean of r² over an ellipse: (a² + b²)/16
    (patterned(pattern(lambda x, y: x * x, PatternDomain.PLACES), LightKind.RECTANGLE, 3, size=(0.5, 2)), np.pi),
    (
        patterned(
            pattern(lambda x, y: (x - 0.5) ** 2 + (y - 0.5) ** 2, PatternDomain.PLACES),
            LightKind.ELLIPSE,
            3,
            size=(0.5, 2),
        ),
        3 * np.pi * np.pi / 4 / 8,
    ),
]


@pytest.mark.parametrize("lights, watts", POWERS)
def test_power_is_the_table_s_integral(lights, watts):
    source, rays = rays_of(lights)
    assert source.power.mean() == pytest.approx(watts, rel=3e-3)
    assert rays.flux.mean() == pytest.approx(watts, rel=3e-3)


def test_photons_of_a_point_go_by_the_table_and_carry_alike():
    lights = patterned(pattern(lambda theta, _: 2 + np.cos(theta)))
    _, rays = rays_of(lights)
    assert chi_square_of_directions(rays.directions, lambda z: (2 - z) / (8 * np.pi)) > 1e-3
    assert rays.flux.max() == pytest.approx(rays.flux.min(), rel=1e-3)


def test_photons_of_a_sphere_leave_it_outward_and_by_its_cosine():
    """Of a sphere that shines below alone, nothing leaves straight up; below it, E is that of a small lamp."""
    lights = patterned(
        pattern(lambda t, _: t < np.pi / 2, PatternDomain.NORMALS), position=(0, 0, 0), radius=0.5, sphere=True
    )
    _, rays = rays_of(lights)
    normals = rays.origins / 0.5
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(N), rel=1e-4)
    cosine = (normals * rays.directions).sum(1)
    assert cosine.min() > -1e-4 and (cosine**2).mean() == pytest.approx(0.5, abs=0.01)
    assert normals[:, 2].max() < 1e-4


def give(lights, position, n=1 << 12):
    """Irradiance that points of the lamp give a surface at a position that faces up."""
    positions = np.tile(np.float32(position), (n, 1))
    up = np.tile(np.float32([0, 0, 1]), (n, 1))
    return light_samples(lights, np.zeros(n, int), positions, up, fixed_points(n), np.float32(10))[1].mean()


@pytest.mark.parametrize("aside", [0.0, 0.5, 2.0])
def test_inverse_square_in_each_direction(aside):
    """To within half a row of the table."""
    lights = patterned(pattern(downlight), emission=3, position=(0, 0, 2))
    theta, half = np.arctan2(aside, 2), np.pi / HEIGHT / 2
    low, high = (3 * np.cos(angle) ** 4 for angle in (theta + half, max(theta - half, 0)))
    intensity = give(lights, (aside, 0, 0)) * (4 + aside**2) / np.cos(theta)
    assert 0.999 * low <= intensity <= 1.001 * high


@pytest.mark.parametrize("power, smooth", [(1, 0), (2, 0), (0, 0.7), (2, 0.7)])
def test_light_falls_off_as_the_node_says(power, smooth):
    """Over 1/d²: d, d², and d²/(s + d²)."""
    lights = lamp(LightKind.POINT, 3, position=(0, 0, 2), distance_power=power, smoothing=smooth)
    assert give(lights, (0, 0, 0)) == pytest.approx(3 / 4 * 2**power * 4 / (smooth + 4), rel=1e-4)


def test_rays_find_what_points_of_patterned_lamps_give():
    """∫ L cos θ dω over directions, and over points of the lamp."""
    striped = pattern(lambda x, y: (x * 4) % 1 < 0.5, PatternDomain.PLACES)
    lights = patterned(striped, LightKind.RECTANGLE, 3, size=(0.6, 0.8), distance_power=1)
    given, n = give(lights, (0, 0, 0), N), 1 << 18
    cosine = 0.7 + 0.3 * fixed_points(n)[:, 0]
    phi = 2 * np.pi * fixed_points(n)[:, 1]
    sine = np.sqrt(1 - cosine**2)
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], 1).astype(np.float32)
    hits = lamp_hits(lights, np.zeros(n, int), np.tile(ZERO, (n, 1)), directions)
    found = 2 * np.pi * 0.3 * (hits.radiance.mean(1) * cosine).mean()
    assert found == pytest.approx(given, rel=0.01)


def test_lamps_that_share_a_pattern_share_its_table():
    one, other = pattern(downlight), pattern(lambda t, _: 1 + 0 * t)
    lights = [patterned(of) for of in (one, other, one)]
    sources = light_sources(scene_of(*plane(2.0), lights=Lights.join(lights)), WHOLE)
    assert sources[0].surroundings.lamps.patterns.table.tolist() == [0, 1, 0]
    powers = [source.power.mean() for source in sources]
    assert powers[0] == pytest.approx(powers[2]) and powers[0] < powers[1]


def test_tables_of_other_sizes_keep_their_mean():
    values = np.random.default_rng(2).random((12, 10, 3)).astype(np.float32)
    assert resampled(values, 6, 5).mean() == pytest.approx(values.mean(), rel=1e-5)
    assert resampled(values, 24, 20).mean() == pytest.approx(values.mean(), rel=1e-5)
