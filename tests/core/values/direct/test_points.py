"""Shadow rays, and direct light of many points against its single estimates, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.bsdf.frames import bump_shadowing
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.path_numbers import path_key, two_numbers
from photon_bake.addon.core.sampling.sobol import fixed_points
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.sampling.warps import cosine_hemisphere
from photon_bake.addon.core.vec3 import direction_to, to_world
from photon_bake.addon.gather import direct_irradiance
from photon_bake.addon.gather.direct import direct_irradiance as passes
from photon_bake.addon.gather.direct import ray_directions, sampling, visible
from photon_bake.addon.gather.normal_gradient import slope_of_samples
from photon_bake.addon.receivers.receivers import AttributeTarget
from photon_bake.addon.scene import World
from photon_bake.addon.tracing.embree import new_ray
from photon_bake.tests.core.scenes import receivers_at
from photon_bake.tests.core.values.direct.test_candidates import (
    AT,
    DIFFUSE,
    KEY,
    SCENES,
    UP,
    everything,
    lamps,
    lit,
    met,
)
from photon_bake.tests.core.values.lobe_formulas import f, triple, unit

# With shadow rays


def arriving(of, path, with_sky=False, at=AT, normal=UP):
    direct, tracer, _ = of
    return visible.arriving(direct.arrays, tracer.arrays, new_ray(), at, normal, -1, KEY, path, 3, with_sky)


@pytest.mark.parametrize("with_sky", [False, True])
@pytest.mark.parametrize("name", SCENES)
def test_an_estimate_is_a_point_and_a_ray(name, with_sky):
    of = direct, tracer, scene = SCENES[name]()
    ceiling = np.float64(scene.vertices[4:]).reshape(-1, 3)
    for path in range(8):
        towards, light, direction, found = arriving(of, path, with_sky)
        target, expected, _, is_lit = sampling.sample_emitters(
            direct.arrays, scene.arrays, AT, UP, -1, DIFFUSE, True, KEY, path, 3
        )
        if is_lit:
            assert towards == pytest.approx(direction_to(AT, target)[0])
            passed = tracer.visibility(np.float32([AT]), np.float32([target]))[0]
            assert light == pytest.approx(np.float64(expected) * passed, rel=1e-5)
        else:
            assert light == (0, 0, 0)
        if not with_sky and direct.arrays.mesh_chance == 0 and direct.arrays.world_chance == 0:
            assert found == (0, 0, 0) and direction == UP
            continue
        u, v = two_numbers(KEY, path, 3 + 9)
        way = to_world(cosine_hemisphere(u, v), UP)
        assert direction == way
        hits = tracer.closest_hit(np.float32([AT]), np.float32([way]))
        triangle = hits.triangle[0]
        own = np.float64(
            sampling.met_radiance(
                direct.arrays, scene.arrays, triangle, hits.distance[0], hits.u[0], hits.v[0], way, UP, -1
            )
        )
        if triangle < 0 and not with_sky:
            own = own - np.float64(sampling.unsampled_sky(direct.arrays, DIFFUSE))
        assert found == pytest.approx(np.pi * own, rel=1e-5)
    assert len(ceiling) == 4


def test_rays_that_end_on_a_surface_see_no_sky():
    of = SCENES["sky"]()
    for path in range(6):
        *_, found = arriving(of, path, normal=triple((0, 0, -1)))
        assert found == (0, 0, 0)


def test_lights_pass_what_does_not_block_them():
    """A lamp above the square that does not block it; others are in its shadow."""
    above = lamps(position=np.float32([(0.1, 0, 5), (0.1, 0.1, 5)]))
    blocked = replace(above, blocked_by=np.array([[True, True], [True, False]]))
    direct, tracer, _ = lit(blocked, glow=False)
    for k, passes_ in ((0, 0), (1, 1), (2, 0), (7, 0)):
        share = visible.visible_share(direct.arrays, tracer.arrays, new_ray(), k, AT, triple((0.1, 0, 5)))
        assert share == (passes_,) * 3
    by_square = replace(above, blocked_by=np.array([[True, True], [False, True]]))
    direct, tracer, _ = lit(by_square, glow=False)
    for height, passed in ((2.9, 1), (3.5, 0)):  # the square is a step before the second
        target = triple((0.2, 0.1, height))
        assert visible.visible_share(direct.arrays, tracer.arrays, new_ray(), 1, AT, target) == (passed,) * 3
    direct, tracer, _ = lit(above, glow=False)
    assert visible.visible_share(direct.arrays, tracer.arrays, new_ray(), 1, AT, triple((0.1, 0, 5))) == (0, 0, 0)
    assert visible.visible_share(direct.arrays, tracer.arrays, new_ray(), 1, AT, triple((2, 0, 2))) == (1, 1, 1)


# Many points

POINTS = np.float32([AT, (0.5, -0.3, 0.2)])
NORMALS = np.float32([UP, unit(0.2, 0.1, 0.9)])


@pytest.mark.parametrize("with_sky", [False, True])
def test_means_of_estimates(with_sky):
    """Those of the k-th point have the paths (first + k) n to (first + k + 1) n; bumps shadow both parts."""
    of = lit(lamps(), world=World.constant(0.7))
    direct, bases = of[0], np.float32([unit(-0.3, 0.2, 1), unit(0.1, 0.1, 1)])
    for base in (None, bases):
        found = direct.mean_irradiance(POINTS, NORMALS, None, 3, KEY, 5, with_sky, base)
        for k in range(2):
            total = np.zeros(3)
            at = triple(POINTS[k]), triple(NORMALS[k])
            for path in range((5 + k) * 3, (6 + k) * 3):
                way, light, other, own = visible.arriving(
                    direct.arrays, of[1].arrays, new_ray(), *at, -1, KEY, path, 0, with_sky
                )
                shares = (1, 1) if base is None else [bump_shadowing(triple(base[k]), at[1], w) for w in (way, other)]
                total += np.float64(light) * shares[0] + np.float64(own) * shares[1]
            assert found[k] == pytest.approx(total / 3, rel=1e-4)
    random, key = stream(4), np.uint64(stream(4).integers(1 << 64, dtype=np.uint64, endpoint=False))
    once = direct.irradiance(POINTS, NORMALS, None, random, with_sky)
    assert np.array_equal(once, direct.mean_irradiance(POINTS, NORMALS, None, 1, key, with_sky=with_sky))
    assert np.array_equal(
        direct.mean_irradiance(POINTS, NORMALS, None, 1, key),
        direct.mean_irradiance(POINTS, NORMALS, np.int32([-1, -1]), 1, key),
    )


@pytest.mark.parametrize("own", [False, True])
def test_incident_light_of_points(own):
    direct, tracer, scene = everything()
    key = np.uint64(stream(4).integers(1 << 64, dtype=np.uint64, endpoint=False))
    found = direct.sample(POINTS, NORMALS, np.int32([0, 1]), stream(4), own)
    for k in range(2):
        at = triple(POINTS[k]), triple(NORMALS[k]), k
        target, light, of, is_lit = sampling.sample_emitters(direct.arrays, scene.arrays, *at, DIFFUSE, own, key, k, 0)
        passed = tracer.visibility(POINTS[k : k + 1], np.float32([target]))[0] if is_lit else 0
        assert found.irradiance[k] == pytest.approx(np.float64(light) * passed, rel=1e-5)
        assert found.direction[k] == pytest.approx(direction_to(at[0], target)[0]) and found.source[k] == of


def test_light_met_by_rays_from_several_sides():
    """Σ (ω·a)⁺² L(ω) over the sides, and what see-through surfaces leave of it."""
    direct, tracer, _ = everything()
    directions = np.float32([unit(0.1, 0.05, 1), unit(0.7, 0.2, 0.3), unit(-0.2, 0.1, -0.9)])
    sides = np.float32([UP, unit(0.6, 0.1, 0.5), unit(0, 0, -1)])
    hits = tracer.closest_hit(np.float32([(0.1, 0.1, 2.8), AT, AT]), directions)
    found = direct.met(hits, directions, sides)
    for k, direction in enumerate(directions):
        total = np.zeros(3)
        for side in sides:
            cos = float(direction @ side)
            if cos > 0:
                own = met(everything(), hits.triangle[k], triple(direction), hits.distance[k], triple(side))
                total += cos**2 * np.float64(own)
        assert found[k] == pytest.approx(total, rel=1e-4)
    assert found[0].max() > 0 and found[1].max() > 0
    tinted = replace(hits, tint=np.tile(np.float32([0.5, 1, 0]), (3, 1)))
    assert direct.met(tinted, directions, sides) == pytest.approx(found * [0.5, 1, 0])


# The pass of receivers


def test_the_direct_pass_of_receivers(monkeypatch):
    """64 estimates each by a key of the pass; objects by their targets, and `base_normal`."""
    monkeypatch.setattr(passes, "N_SAMPLES", 4)
    monkeypatch.setattr(passes, "_CHUNK", 2)
    direct, _, scene = lit(lamps(illuminates=np.array([[True, False], [True, True]])), glow=False)
    receivers = receivers_at(np.float32([*POINTS, (0.1, 0.9, 0.4)]), UP)
    where = {"target": np.array([2, -1, 0])}
    names = ("Triangle 2", where["target"]), ("elsewhere", np.array([1, 1, 1]))
    targets = tuple(AttributeTarget(name, "", "POINT", of_element) for name, of_element in names)
    receivers = replace(receivers, targets=targets)
    assert passes._objects(scene, receivers).tolist() == [1, -1, 1]
    value = direct_irradiance(scene, direct, receivers, Workers(5))
    objects = np.array([1, -1, 1])
    at = receivers.position, receivers.normal, objects
    assert value == pytest.approx(direct.mean_irradiance(*at, 4, path_key(5, 31)), rel=1e-6)
    bases = np.tile(np.float32(unit(0.3, 0.2, 1)), (3, 1))
    shaded = direct_irradiance(scene, direct, replace(receivers, base_normal=bases), Workers(5))
    assert shaded == pytest.approx(direct.mean_irradiance(*at, 4, path_key(5, 31), bases=bases), rel=1e-6)
    slope = passes.direct_slope(scene, direct, receivers, value, Workers(5))
    assert slope.shape == (3, 3, 3)
    for chunk in (slice(0, 2), slice(2, 3)):
        n = chunk.stop - chunk.start
        repeated = [np.repeat(of[chunk], 4, 0) for of in at]
        turned = ray_directions.gather_directions(repeated[1], 4, stream(5, 32, chunk.start // 2))
        change = direct.mean_irradiance(repeated[0], turned, repeated[2], 1, path_key(5, 32), 4 * chunk.start)
        change = change.reshape(n, 4, 3) - value[chunk, None]
        expected = slope_of_samples(change, turned.reshape(n, 4, 3), receivers.normal[chunk])
        assert slope[chunk] == pytest.approx(expected, rel=1e-4, abs=1e-6)


def test_directions_of_runs_are_shifted_together():
    """Each run of as many as there are points has a shift of its own, around the torus."""
    normals = np.tile(np.float32(unit(0.2, 0.3, 0.8)), (8, 1))
    found, shifts = ray_directions.gather_directions(normals, 4, stream(2)), stream(2).random((2, 2), dtype=np.float32)
    points = fixed_points(4)
    assert np.array_equal(ray_directions.stratified_set(4), points)
    for k in range(8):
        u, v = (points[k % 4] + shifts[k // 4]) % 1
        expected = to_world(cosine_hemisphere(f(u), f(v)), triple(normals[0]))
        assert found[k] == pytest.approx(expected, abs=1e-5)
    assert ray_directions._BELOW_ONE < 1
