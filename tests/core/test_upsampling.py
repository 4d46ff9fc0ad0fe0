"""Joint bilateral upsampling: exact where light is linear, nothing mixed across edges."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.gather import splat_irradiance, upsampled
from photon_bake.tests.core.scenes import merge, plane, scene_of
from photon_bake.tests.core.test_photon_splatting import evenly, photons_at, seen_from, view_of_plane


class Counted:
    """Light by a function of positions, and at how many points it was asked for."""

    def __init__(self, seen, value):
        self.seen, self.value, self.n = seen, value, 0

    def __call__(self, k):
        self.n += len(k)
        return np.repeat(self.value(self.seen.position[k])[:, None], 3, axis=1).astype(np.float32)


@pytest.mark.parametrize("step", [1, 2, 4, 7])
def test_linear_light_on_a_plane_is_exact(step):
    """Within the grid, and close to it beyond its last column and row."""
    camera, seen = view_of_plane(width=161, height=121)
    light = Counted(seen, lambda at: 2 + 0.5 * at[:, 0] - 0.3 * at[:, 1])
    value = upsampled(camera, seen, step, light, Workers())
    inner = (seen.pixel % 161 < 161 - step) & (seen.pixel // 161 < 121 - step)
    assert value[inner, 0] == pytest.approx(light.value(seen.position[inner]), rel=1e-5)
    assert value[:, 0] == pytest.approx(light.value(seen.position), abs=0.01 * step)
    assert light.n < 1.35 * len(seen) / step**2


def test_nothing_is_mixed_across_an_edge():
    """A plate over a floor, one bright and one dark; a stripe narrower than the grid is lit for itself."""
    plate, stripe = plane(0.4, z=0.5), plane(1.0, z=0.3)
    stripe[0][:, 0] = stripe[0][:, 0] * 0.008 - 0.65
    camera, seen = seen_from(scene_of(*merge(plane(4.0), plate, stripe)), width=200, height=200)
    light = Counted(seen, lambda at: np.where(at[:, 2] > 0.2, np.where(at[:, 2] > 0.4, 5.0, 2.0), 0.0))
    value = upsampled(camera, seen, 8, light, Workers())
    assert all((np.abs(seen.position[:, 2] - z) < 1e-3).any() for z in (0, 0.3, 0.5))
    assert value[:, 0] == pytest.approx(light.value(seen.position), abs=1e-6)
    assert light.n < 0.1 * len(seen)


def test_nothing_is_mixed_between_walls_at_an_angle():
    """A floor and a wall that meet: light that is even on each stays so."""
    wall = plane(4.0)[0][:, [2, 0, 1]], plane(4.0)[1]
    forward_and_down = np.float32([[0, -1, 0], [0.6, 0, 0.8], [0.8, 0, -0.6]])
    camera, seen = seen_from(scene_of(*merge(plane(4.0), wall)), (-1.5, 0, 1.2), forward_and_down)
    on_wall = np.abs(seen.normal[:, 0]) > 0.5
    assert 0.1 < on_wall.mean() < 0.9
    value = upsampled(camera, seen, 4, lambda k: (np.abs(seen.normal[k, :1]) > 0.5).astype(np.float32), Workers())
    assert np.array_equal(value[:, 0] > 0.5, on_wall) and np.abs(value[:, 0] - on_wall).max() < 1e-6


def test_photons_are_scattered_to_few_pixels():
    camera, seen = view_of_plane()
    photons = photons_at(evenly(100_000, 2), 16.0)
    full, _ = splat_irradiance(camera, seen, photons, Workers())
    coarse, stderr = splat_irradiance(camera, seen, photons, Workers(), step=3)
    assert coarse.mean() == pytest.approx(full.mean(), rel=0.01)
    assert np.sqrt(np.mean((coarse - full) ** 2)) < 0.5 * np.sqrt(np.mean(stderr**2))
