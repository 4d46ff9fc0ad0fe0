"""Records, their weights and the budget: few receivers gather, all are lit."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import region_of
from photon_bake.addon.gather import FinalGather
from photon_bake.addon.gather.irradiance_cache import sample_budget
from photon_bake.addon.gather.irradiance_cache.cells import cell_keys, middles
from photon_bake.addon.gather.irradiance_cache.placement import affordable
from photon_bake.addon.gather.irradiance_cache.record_error import Around, RecordErrorModel
from photon_bake.addon.gather.irradiance_cache.record_index import RecordIndex
from photon_bake.addon.gather.irradiance_cache.records import N_BATCHES, Records
from photon_bake.addon.gather.irradiance_cache.sample_budget import SampleBudget, rays_for_budget, rays_for_noise
from photon_bake.addon.gather.irradiance_cache.weights import Weights
from photon_bake.addon.pipeline.bake import bake, solve
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, receivers_at, receivers_in_box, scene_of
from scipy.spatial import cKDTree

RNG = np.random.default_rng(7)
UP = np.array([0, 0, 1], np.float32)


def on_floor(n, half=1.0, z=1e-3, seed=1):
    place = np.random.default_rng(seed).uniform(-half, half, (n, 2))
    return np.column_stack([place, np.full(n, z)]).astype(np.float32)


def records_at(position, normal=UP, edge=0.3, radiance=0.0, n_rays=64, noise=0.0, seed=5):
    """Records of a radiance (m,) or number, with normal noise a batch."""
    n = len(position)
    mean = np.broadcast_to(np.asarray(radiance, float), n)[:, None, None]
    batches = mean + noise * np.random.default_rng(seed).standard_normal((n, N_BATCHES, 1))
    total = np.repeat(batches * n_rays / N_BATCHES, 3, axis=2)
    normals = np.broadcast_to(np.asarray(normal, np.float32), position.shape).copy()
    edges = np.full(n, edge, np.float32)
    rays, nearness = np.full(n, n_rays), np.full(n, float(n_rays))
    return Records(np.arange(n), position, normals, edges, total, rays, nearness, np.zeros((n, 0, 3)))


def around_floor(records, scene=None):
    return RecordIndex(records, 4.0, EmbreeTracer(scene or scene_of(*plane(2.0))))


def others_of(records):
    """What the records say of each other, on a floor."""
    weights = around_floor(records).of_records(np.arange(len(records)), Workers())
    return Around.of(weights, records)


def test_middles_are_receivers_of_their_cells():
    position, normal = RNG.uniform(0, 1, (5000, 3)).astype(np.float32), RNG.standard_normal((5000, 3))
    normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32)
    keys = cell_keys(position, normal, np.zeros(3, np.float32), 0.25)
    chosen, cell = middles(keys, position)
    assert np.array_equal(cell[chosen], np.arange(len(chosen))) and np.array_equal(keys[chosen][cell], keys)
    assert (np.abs(position - position[chosen[cell]]).max(axis=1) < 0.25).all()
    assert np.linalg.norm(normal - normal[chosen[cell]], axis=1).max() < 1


def test_weights_reproduce_a_plane():
    """Light that changes linearly is interpolated exactly but for the ridge, inside and at the border alike."""
    records = records_at(on_floor(500))
    weights = around_floor(records).of_points(on_floor(2000, seed=2), np.tile(UP, (2000, 1)), Workers())
    assert weights.supported.all()
    assert weights.apply(np.ones(500)) == pytest.approx(np.ones(2000), abs=1e-5)
    linear = 3 + records.position[:, :1] - 2 * records.position[:, 1:2]
    at = on_floor(2000, seed=2)
    assert weights.apply(linear)[:, 0] == pytest.approx(3 + at[:, 0] - 2 * at[:, 1], abs=0.1)


def test_records_of_other_sides_do_not_count():
    """Neither what faces another way, nor what lies behind a wall, under a board, or on another level."""
    floor, wall = on_floor(400), np.array([[0, -2, 0], [0, 2, 0], [0, 2, 1], [0, -2, 1]], np.float32)
    scene = scene_of(*merge(plane(2.0), (wall, np.array([[0, 1, 2], [0, 2, 3]]))))
    lit = (floor[:, 0] > 0).astype(float)
    near = around_floor(records_at(floor, radiance=lit), scene)
    at = on_floor(2000, seed=3)
    weights = near.of_points(at, np.tile(UP, (2000, 1)), Workers())
    got = weights.apply(near.records.irradiance)[:, 0] / np.pi
    assert np.allclose(got[weights.supported], (at[:, 0] > 0)[weights.supported], atol=1e-5)
    for position, normal in ((at, -UP), (at + np.float32([0, 0, 0.5]), UP), (at, np.float32([1, 0, 0]))):
        assert not near.of_points(position, np.tile(normal, (2000, 1)), Workers()).supported.any()


def test_convex_surfaces_do_not_hide_their_own_records():
    half = np.linspace(0, np.pi, 64)
    ring = np.stack([np.cos(half), np.zeros(64), np.sin(half)], axis=1)
    strip = np.concatenate([ring - np.eye(3)[1], ring + np.eye(3)[1]]).astype(np.float32)
    k = np.arange(63)
    triangles = np.concatenate([np.stack([k, k + 1, k + 65], 1), np.stack([k, k + 65, k + 64], 1)])
    angle, y = RNG.uniform(0.2, np.pi - 0.2, 600), RNG.uniform(-0.9, 0.9, 600)
    normal = np.stack([np.cos(angle), np.zeros(600), np.sin(angle)], axis=1).astype(np.float32)
    position = (normal * 1.001 + np.column_stack([0 * y, y, 0 * y])).astype(np.float32)
    near = around_floor(records_at(position[:300], normal[:300]), scene_of(strip, triangles))
    assert near.of_points(position[300:], normal[300:], Workers()).supported.mean() > 0.98


def test_blending_takes_noise_and_leaves_edges():
    """Where all records agree but for noise they move to each other; where light changes at an edge they stay."""
    position = on_floor(900)
    even = records_at(position, radiance=1.0, noise=0.1)
    model = RecordErrorModel.of(even, others_of(even))
    assert model.blended(even.irradiance).std() < 0.7 * even.irradiance.std()
    step = records_at(position, edge=0.1, radiance=np.where(position[:, 0] > 0, 1.0, 0.2), noise=0.01)
    model = RecordErrorModel.of(step, others_of(step))
    at_edge = np.abs(position[:, 0]) < 0.02
    moved = np.abs(model.blended(step.irradiance) - step.irradiance)[at_edge]
    assert moved.max() < 0.1 * np.pi and model.bias2[at_edge].mean() > 10 * model.bias2[~at_edge].mean()


@pytest.mark.parametrize("bend", [0.0, 5.0, 20.0])
def test_errors_of_blends_by_chance_are_told(bend):
    """Records' own noise decides how far they move, in even light and in light that bends: errors are as large as said.

    Blends that are taken to be fixed tell errors that are too small by a fifth and more.
    """
    position, off2, said2 = on_floor(900), [], []
    light = 4 + bend * (position[:, 0] ** 2 + position[:, 1] ** 2)
    for seed in range(8):
        records = records_at(position, radiance=light, noise=0.5, seed=seed)
        model = RecordErrorModel.of(records, others_of(records))
        own = Weights.identity(records.receiver)
        off2.append((model.blended(records.irradiance)[:, 0] - np.pi * light) ** 2)
        said2.append(model.variance(records, own, position))
    assert np.sqrt(np.mean(off2) / np.mean(said2)) == pytest.approx(1, abs=0.1)


def test_look_ups_off_to_the_side_know_what_a_slope_makes_of_them():
    """Beyond the last of few records, light that changes in a straight line is off by as much as is said."""
    position = on_floor(900)
    steep = records_at(position, edge=0.2, radiance=2 + position[:, 0], n_rays=64)
    model, at = RecordErrorModel.of(steep, others_of(steep)), on_floor(400, seed=8)
    nearest = cKDTree(position).query(at)[1]
    weights = Weights.of_one(nearest)
    said = np.sqrt(model.bias2_of(steep, weights, at))
    off = np.pi * (position[nearest, 0] - at[:, 0])
    assert np.sqrt(np.mean(off**2) / np.mean(said**2)) == pytest.approx(1, abs=0.1)
    fitted = around_floor(steep).of_points(at, np.tile(UP, (400, 1)), Workers())
    assert np.sqrt(model.bias2_of(steep, fitted, at)).mean() < 0.2 * said.mean()


def test_rays_are_shared_by_the_noise_of_others():
    """A record's own rays do not say how many more it gets: those that missed a rare bright thing would get none."""
    position = on_floor(900)
    calm, restless = records_at(position, radiance=1.0, noise=0.1), records_at(position, radiance=1.0, noise=0.1)
    k = int(np.argmin(np.abs(position[:, :2]).sum(axis=1)))
    restless.total[k] *= np.array([0.1, 3, 0.1, 0.8])[:, None]
    around = others_of(calm)
    before, after = (RecordErrorModel.of(records, around) for records in (calm, restless))
    assert after.per_ray[k] > 20 * before.per_ray[k]
    assert after.expected[k] == pytest.approx(before.expected[k])
    beside = np.argsort(((position - position[k]) ** 2).sum(axis=1))[1:4]
    assert (after.expected[beside] > 1.5 * before.expected[beside]).all()


def test_sources_that_rays_hardly_ever_meet_widen_the_error(monkeypatch):
    """A tiny window of radiance L that a ray meets with the probability p brings π p L; most records meet it never."""
    position, n_rays, p, radiance = on_floor(2000), 64, 1e-4, 1e4
    off2, said2, blind = [], [], []
    for seed in range(6):
        records = records_at(position, edge=0.1, radiance=1.0, n_rays=n_rays, noise=1e-3)
        met = np.random.default_rng(seed).binomial(n_rays // N_BATCHES, p, (len(position), N_BATCHES))
        records.total[:] += radiance * met[..., None]
        near = around_floor(records)
        weights = near.of_points(at := on_floor(500, seed=9), np.tile(UP, (500, 1)), Workers())
        model = RecordErrorModel.of(records, others_of(records))
        off2.append((weights.apply(model.blended(records.irradiance))[:, 0] - np.pi * (1 + p * radiance)) ** 2)
        said2.append(model.variance(records, weights, at))
        with monkeypatch.context() as patch:
            patch.setattr(RecordErrorModel, "_widened", lambda self, _: self.per_ray)
            blind.append(model.variance(records, weights, at))
    off2, said2 = np.array(off2), np.array(said2)
    dark = off2 < (1.5 * np.pi * p * radiance) ** 2
    assert 0.6 < dark.mean() < 0.99
    assert 0.5 < np.sqrt(off2.mean() / said2.mean()) < 1.4
    said, said_blindly = (np.sqrt(np.mean(off2 / estimate)) for estimate in (said2, np.array(blind)))
    assert said < 20 and said_blindly > 100 * said


def test_least_rays_for_a_variance_and_least_variance_for_rays():
    """Neyman's allocation: records with more than the least have rays in proportion to √(sensitivity · per_ray)."""
    per_ray, sensitivity, has = RNG.uniform(0, 4, 200), RNG.uniform(0, 2, 200), np.full(200, 16)
    per_ray[:20] = 0
    wanted = rays_for_noise(per_ray, sensitivity, has, variance=1.0)
    assert (sensitivity * per_ray / wanted).sum() == pytest.approx(1.0, rel=1e-3)
    for rays in (wanted, rays_for_budget(per_ray, sensitivity, has, 10_000.0)):
        more = rays > has + 1e-6
        assert (rays >= has).all() and np.ptp(rays[more] / np.sqrt(sensitivity * per_ray)[more]) < 1e-6 * rays.max()
    assert (rays_for_budget(per_ray, sensitivity, has, 10_000.0) - has).sum() == pytest.approx(10_000, rel=1e-3)
    assert np.array_equal(rays_for_noise(np.zeros(3), np.ones(3), has[:3], 0.0), has[:3])


def dense(weights, n_records):
    """The weights as a matrix (n, m)."""
    return weights.apply(np.eye(n_records))


def test_rows_sum_as_their_matrix_does():
    """Plain, squared and positive sums of compressed rows, some of which are empty, and of rows with others put in."""
    matrix = np.where(RNG.random((40, 30)) < 0.2, RNG.standard_normal((40, 30)), 0).astype(np.float32)
    matrix[5], values = 0, RNG.random((30, 3))

    def compressed(matrix):
        start = np.concatenate([[0], np.cumsum((matrix != 0).sum(axis=1))]).astype(np.int32)
        return Weights(start, np.nonzero(matrix)[1].astype(np.int32), matrix[matrix != 0])

    rows = compressed(matrix)
    assert np.array_equal(dense(rows, 30), matrix) and np.array_equal(rows.supported, matrix.any(axis=1))
    assert rows.apply(values) == pytest.approx(matrix @ values, abs=1e-5)
    assert rows.apply_squares(values) == pytest.approx(matrix**2 @ values, abs=1e-5)
    positive = np.maximum(matrix, 0)
    mean = positive @ values / np.maximum(positive.sum(axis=1), 1e-30)[:, None]
    assert rows.mean(values) == pytest.approx(mean, abs=1e-5)
    assert rows.sums_of_squares(30) == pytest.approx((matrix**2).sum(axis=0), rel=1e-5)
    points = np.array([7, 3, 20])
    replaced, new = matrix.copy(), np.roll(matrix[10:13], 1, axis=1)
    replaced[points] = new
    assert np.array_equal(dense(rows.replaced(points, compressed(new)), 30), replaced)
    replaced[3] = matrix[3]
    some = rows.replaced(points, compressed(matrix[10:13, :-1]), 1, np.array([True, False, True]))
    replaced[[7, 20]] = np.column_stack([np.zeros(3), matrix[10:13, :-1]])[[0, 2]]
    assert np.array_equal(dense(some, 30), replaced)
    joined = Weights.joined([rows, Weights.none(2), compressed(new)])
    assert np.array_equal(dense(joined, 30), np.concatenate([matrix, np.zeros((2, 30)), new]))


def test_identity_keeps_every_receiver_its_own():
    order = RNG.permutation(50)
    assert np.array_equal(Weights.identity(order).apply(order.astype(float)), np.arange(50))


def room(albedo=0.5):
    lights = lamp(LightKind.RECTANGLE, 3.0, (0, 0, 0.99), size=(0.5, 0.5))
    block = box(0.3, inwards=False)
    return scene_of(*merge(box(), (block[0] - [0.2, 0.1, 0.7], block[1])), albedo=albedo, lights=lights)


def baked(scene, at, **changes):
    settings = settings_for("draft", n_photons=200_000, **{"n_cache_elements": 5_000, **changes})
    return bake(scene, at, settings, EmbreeTracer(scene))


def test_few_gather_and_all_are_lit_alike():
    """Dense receivers take as much light from few records as if each gathered, at a fraction of the rays."""
    scene, dense = room(), receivers_in_box(4000)
    few = baked(scene, dense, n_gather_rays=128)
    checked = np.arange(0, len(dense), 40)
    all_ = baked(scene, subset(dense, checked), interpolate=False, n_gather_rays=2048)
    assert few.counts["gather_points"] < len(dense) / 2.5
    assert few.gathered.sum() == few.counts["gather_points"] and not all_.interpolated
    assert few.interpolated and few.where(slice(9000, 9500)).interpolated  # however many gather elsewhere
    open_ = all_.value.mean(axis=1) > 0
    off = (few.value[checked] - all_.value).mean(axis=1)[open_] / all_.value.mean()
    assert np.sqrt(np.mean(off**2)) < 0.06 and abs(off.mean()) < 0.01 and np.abs(off).max() < 0.4


def subset(at, k):
    return Receivers(at.position[k], at.normal[k], at.footprint[k])


def test_standard_error_is_calibrated_where_light_is_interpolated():
    """The rms of the error over its estimate is about one: against many rays into the same cache."""
    scene, dense = room(), receivers_in_box(3000)
    checked = np.arange(0, len(dense), 30)
    solution = solve(scene, dense, settings_for("draft", n_photons=200_000), EmbreeTracer(scene))
    extent, tracer = 2 * region_of(dense.position).radius, solution.tracer.surfaces

    def gathered(at, budget, seed):
        light = FinalGather(solution.rays, at, budget, extent, tracer, Workers(seed)).finish().light
        return light.irradiance.mean(axis=1), light.stderr

    truth, known = gathered(subset(dense, checked), SampleBudget(4096, interpolate=False), 0)
    runs = [gathered(dense, SampleBudget(128), seed) for seed in (1, 2, 3)]
    errors = np.stack([light[checked] - truth for light, _ in runs])
    said = np.stack([np.hypot(stderr[checked], known) for _, stderr in runs])
    ratio = errors / np.maximum(said, 1e-3 * truth.mean())
    assert 0.7 < np.sqrt(np.mean(ratio**2)) < 1.35


def test_standard_error_of_few_batches_is_told_by_neighbours():
    """Four batches alone would have every hundredth error at over four times what they say."""
    scene, dense = room(), receivers_in_box(600)
    solution = solve(scene, dense, settings_for("draft", n_photons=200_000), EmbreeTracer(scene))
    extent, checked = 2 * region_of(dense.position).radius, np.arange(0, len(dense), 3)

    def gathered(at, n_rays, seed):
        budget = SampleBudget(n_rays, interpolate=False)
        gather = FinalGather(solution.rays, at, budget, extent, solution.tracer.surfaces, Workers(seed))
        light = gather.finish().light
        return light.irradiance.mean(axis=1), light.stderr

    (few, said), (truth, known) = gathered(dense, 64, 1), gathered(subset(dense, checked), 1024, 0)
    lit = truth > 0.1 * truth.mean()
    ratio = np.abs(few[checked] - truth)[lit] / np.hypot(said[checked], known)[lit]
    assert 0.85 < np.sqrt(np.mean(ratio**2)) < 1.2 and np.percentile(ratio, 99) < 3.3


def test_noise_that_is_asked_for_is_reached_and_said():
    scene, dense = room(), receivers_in_box(2000)
    once, asked = baked(scene, dense), baked(scene, dense, noise=0.01)
    assert asked.relative_noise <= 0.01005 < once.relative_noise
    assert asked.counts["gather_rays"] > once.counts["gather_rays"]


def test_time_that_is_left_is_used(monkeypatch):
    """Where the clock says that there is time, rays are added; where it is gone, the first ones are all."""
    scene, dense = room(), receivers_in_box(300)
    monkeypatch.setattr(SampleBudget, "seconds_left", property(lambda self: 0.0))
    none = baked(scene, dense, time=10.0)
    left = [2.0, 0.5, 0.0]
    monkeypatch.setattr(SampleBudget, "seconds_left", property(lambda self: left.pop(0)))
    some = baked(scene, dense, time=10.0)
    assert left == [] and some.counts["gather_rays"] > 2 * none.counts["gather_rays"]
    assert some.relative_noise < none.relative_noise


def test_little_memory_gives_the_same_light():
    scene, dense = room(), receivers_in_box(500)
    little, much = (baked(scene, dense, memory=memory) for memory in (100, 4000))
    assert np.array_equal(little.value, much.value)


def test_budget_tolerates_what_its_rays_cannot_tell():
    assert SampleBudget(64).tolerance > SampleBudget(2048).tolerance
    assert SampleBudget(64, noise=0.01).tolerance == 0.01


def test_one_receiver_and_equal_receivers():
    scene = room()
    assert np.isfinite(baked(scene, receivers_at([(0, 0, -0.999)], UP)).value).all()
    same = baked(scene, receivers_at(np.tile([(0.5, 0.5, -0.999)], (500, 1)), UP))
    assert same.value.min() > 0 and same.counts["gather_points"] == 1


def crowd(n=120, half=0.02, seed=4):
    """A room with n small cubes in it, and a receiver at each corner of each side of each."""
    random = np.random.default_rng(seed)
    cube = box(half, inwards=False)
    middles_ = random.uniform(-0.8, 0.8, (n, 3)).astype(np.float32)
    scene = scene_of(
        *merge(box(), *[(cube[0] + middle, cube[1]) for middle in middles_]),
        albedo=0.5,
        lights=lamp(LightKind.RECTANGLE, 3.0, (0, 0, 0.99), size=(0.5, 0.5)),
    )
    face = np.array([(x, y, 1.02) for x in (-0.9, 0.9) for y in (-0.9, 0.9)], np.float32)
    sides = [(np.roll(face * sign, axis, axis=1), sign * np.roll(UP, axis)) for axis in range(3) for sign in (1, -1)]
    local = np.concatenate([corners for corners, _ in sides])
    normal = np.concatenate([np.tile(up, (4, 1)) for _, up in sides]).astype(np.float32)
    position = (middles_[:, None] + half * local).reshape(-1, 3)
    return scene, Receivers(position, np.tile(normal, (n, 1)), np.full(len(position), half, np.float32))


def test_many_small_things_send_a_bounded_number_of_rays(monkeypatch):
    """Where there is nothing to interpolate rays are few for each receiver, and the error is as large as it is said."""
    monkeypatch.setattr(sample_budget, "NEVER_SPARED", 0)
    scene, at = crowd()
    sure = baked(scene, at, interpolate=False, n_gather_rays=512)
    bounded, free = (baked(scene, at, gather_share=share) for share in (0.25, 1.0))
    assert free.counts["gather_rays"] > 40 * len(at)
    assert bounded.counts["gather_rays"] < 17 * len(at)
    off = (bounded.value - sure.value).mean(axis=1)
    said = np.hypot(bounded.stderr, sure.stderr)
    assert 0.7 < np.sqrt(np.mean(off**2) / np.mean(said**2)) < 1.4
    assert abs(off.mean()) < 0.02 * sure.value.mean()
    alone = baked(scene, at, gather_share=0.25, n_threads=1)
    assert np.array_equal(alone.value, bounded.value)


def test_few_receivers_are_never_spared():
    scene, at = crowd(40)
    assert np.array_equal(baked(scene, at, gather_share=0.01).value, baked(scene, at, gather_share=1.0).value)


def test_rays_that_run_out_go_to_the_cells_of_most_receivers():
    cell, keys = np.repeat([0, 1, 2], [2, 9, 4]), np.array([0, 1, *[2] * 8, 3, *[4, 5, 6, 7]])
    cut = np.array([True, True, True])
    assert affordable(cut, cell, keys, np.inf).all()
    assert np.array_equal(affordable(cut, cell, keys, 4), [True, True, False])
    assert np.array_equal(affordable(cut, cell, keys, 3), [False, True, False])
