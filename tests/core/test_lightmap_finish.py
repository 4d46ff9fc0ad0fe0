"""Lightmaps after the bake: means, empty texels, borders, seams, noise."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.output.lightmap import FinishOptions, finish_lightmaps
from photon_bake.addon.output.lightmap.conjugate_gradients import scaled, solve
from photon_bake.addon.output.lightmap.denoise import denoised
from photon_bake.addon.output.lightmap.dilation import dilated
from photon_bake.addon.output.lightmap.oidn import _passes
from photon_bake.addon.output.lightmap.texel_images import texel_images
from photon_bake.addon.output.oidn import has_oidn
from photon_bake.addon.receivers import Charts, texel_receivers
from photon_bake.addon.receivers.lightmap.seams import seams_of
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, scene_of
from photon_bake.tests.core.unwrapped import look_up, mesh_of, points_on, unwrapped_box, unwrapped_plane
from scipy.sparse import csr_array, random_array

needs_oidn = pytest.mark.skipif(not has_oidn(), reason="without the pyoidn wheel")
CLEAN = FinishOptions(denoiser="none")


def finished(mesh, size, light, options=CLEAN, noise=0.0):
    """The image of light (a function of positions) on a mesh, with noise of a standard deviation."""
    receivers, texels = texel_receivers([mesh], [size])
    values = light(receivers.position)
    values = values + noise * np.random.default_rng(0).normal(size=values.shape)
    stderr = np.full(len(receivers), noise / np.sqrt(3), np.float32)
    return finish_lightmaps(values.astype(np.float32), stderr, receivers, texels, options)[0].light


def ramp(positions):
    return 3 + positions[:, :1] * [1, 0.5, 0] + positions[:, 1:2] * [0, -1, 0.5]


def wave(positions):
    return 1 + 0.8 * np.sin(positions @ np.array([[3, 3, 3], [2, 0.5, -1], [1, 1, 1]]))


@pytest.mark.parametrize("degrees", [0, 20, 45])
def test_a_linear_ramp_looks_up_exactly_to_the_very_border(degrees):
    mesh = unwrapped_plane(0.3, degrees)
    image = finished(mesh, (24, 29), ramp)
    positions, uv = points_on(mesh, 5000)
    assert np.abs(look_up(image, uv) - ramp(positions)).max() < 1e-4


def test_dilation_keeps_known_values_bit_by_bit_and_takes_the_nearest():
    random = np.random.default_rng(0)
    values, known = random.random((20, 30, 3), np.float32), random.random((20, 30)) < 0.1
    whole = dilated(values, known)
    assert np.array_equal(whole[known], values[known])
    places = np.argwhere(known)
    for row, column in np.argwhere(~known):
        distance = np.linalg.norm(places - (row, column), axis=1)
        nearest = places[distance <= distance.min() + 1e-9]
        assert any(np.array_equal(whole[row, column], values[tuple(place)]) for place in nearest)
    padded = dilated(values, known, 2)
    assert np.array_equal(padded[known], values[known])
    assert ((padded == 0).all(axis=2) | (padded == whole).all(axis=2)).all() and (padded == 0).any()
    assert (dilated(values, np.zeros_like(known)) == 0).all()


@pytest.mark.parametrize("padding, reach", [(-1, 20), (0, 0), (1, 1), (3, 3)])
def test_dilation_reaches_as_far_as_it_is_told(padding, reach):
    """Texels whose middles are no farther away; at 3 that is 29 with the known one."""
    known = np.zeros((11, 13), bool)
    known[5, 6] = True
    row, column = np.indices(known.shape)
    filled = dilated(np.full((11, 13, 3), 7, np.float32), known, padding)
    within = np.hypot(row - 5, column - 6) <= reach
    assert (filled[within] == 7).all() and not filled[~within].any()
    assert padding != 3 or within.sum() == 29


def test_texels_are_means_by_weight_with_the_noise_of_means():
    receivers, texels = texel_receivers([unwrapped_plane(0.4, 0)], [(10, 10)])
    twice = replace(
        texels,
        **{name: np.concatenate([getattr(texels, name)] * 2) for name in ("image", "row", "column", "chart", "uv")},
        weight=np.concatenate([texels.weight, 3 * texels.weight]),
    )
    both = replace(
        receivers,
        **{name: np.concatenate([getattr(receivers, name)] * 2) for name in ("position", "normal", "footprint")},
    )
    n = len(receivers)
    values = np.repeat(np.array([[4, 0, 8], [8, 4, 0]], np.float32), n, axis=0)
    (image,) = texel_images(values, np.ones(2 * n, np.float32), both, twice)
    assert image.value[image.covered] == pytest.approx(np.tile([7.0, 3.0, 2.0], (n, 1)))
    assert image.stderr[image.covered] == pytest.approx(np.sqrt(1 / 16 + 9 / 16))
    assert (image.chart[image.covered] == 0).all() and (image.chart[~image.covered] == -1).all()
    assert not image.value[~image.covered].any()


def jumps(mesh, image):
    """Difference between the two sides of seams, over the mean."""
    size = image.shape[:2]
    seams = seams_of(Charts.of([mesh]), (size,))
    a, b = (look_up(image, seams.place[:, side] / size[::-1]) for side in range(2))
    return np.abs(a - b).mean(axis=1) / image.mean()


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_seams_of_a_smooth_cube_do_not_show(noise):
    mesh = unwrapped_box(0.02, inwards=False, degrees=15, smooth=True)
    open_, closed = (
        finished(mesh, (80, 100), wave, FinishOptions("none", stitch=stitch), noise) for stitch in (False, True)
    )
    assert np.quantile(jumps(mesh, closed), 0.99) < 0.02
    assert np.quantile(jumps(mesh, open_), 0.99) > 2 * np.quantile(jumps(mesh, closed), 0.99)
    positions, uv = points_on(mesh, 5000)
    errors = [np.sqrt(np.mean((look_up(image, uv) - wave(positions)) ** 2)) for image in (open_, closed)]
    assert errors[1] < 1.1 * errors[0], "agreement must not cost truth"


def test_a_seam_between_light_and_darkness_stays():
    """As where a wall goes on behind something flush with it."""
    left, right = unwrapped_plane(0.3), unwrapped_plane(0.3)
    right = mesh_of(right.positions + np.array([2, 0, 0]), right.uv, image=1)
    receivers, texels = texel_receivers([left, right], [(20, 20), (20, 20)])
    values = np.where(texels.image == 0, 1.0, 0.01)[:, None] * np.ones(3, np.float32)
    images = finish_lightmaps(values.astype(np.float32), np.zeros(len(values)), receivers, texels, CLEAN)
    lit, dark = (image.light for image in images)
    assert lit == pytest.approx(1) and dark == pytest.approx(0.01)


def test_sharp_edges_are_no_seams():
    mesh = unwrapped_box(0.02, inwards=False)
    assert len(seams_of(Charts.of([mesh]), ((80, 100),)).image) == 0


def test_seams_of_objects_that_meet_and_of_unequal_triangles():
    """A square of two triangles beside one of eight, of another object and in another image."""
    left = unwrapped_plane(0.3)
    x, y = np.meshgrid(np.linspace(-1, 1, 3), np.linspace(-1, 1, 3))
    place = np.stack([x, y, 0 * x], axis=2)
    quads = [place[:-1, :-1], place[:-1, 1:], place[1:, 1:], place[1:, :-1]]
    a, b, c, d = (quad.reshape(-1, 3) for quad in quads)
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    right = mesh_of(corners + np.array([2, 0, 0]), corners[..., :2] * 0.2 + 0.5, image=1)
    seams = seams_of(Charts.of([left, right]), ((20, 20), (30, 30)))
    assert {tuple(pair) for pair in seams.image} == {(0, 1), (1, 0)}
    here, there = seams.place[seams.image[:, 0] == 0].transpose(1, 0, 2)
    assert (
        len(here) >= 20 and np.abs(here[:, 0] - 0.8 * 20).max() < 1e-4 and np.abs(there[:, 0] - 0.3 * 30).max() < 1e-4
    )
    assert np.abs((here[:, 1] / 20 - 0.5) / 0.3 - (there[:, 1] / 30 - 0.5) / 0.2).max() < 1e-4


def test_a_floor_parts_a_wall():
    """Two squares stand on each other; a floor on the one's edge makes their light differ."""
    lower, upper = (unwrapped_plane(0.3 if k else 0.2) for k in range(2))
    upper = mesh_of(upper.positions + np.array([0, 2, 0]), upper.uv, image=1)
    charts, sizes = Charts.of([lower, upper]), ((20, 20), (30, 30))
    vertices, triangles = plane()
    walls = merge((vertices, triangles), (vertices + np.float32([0, 2, 0]), triangles))
    floor = np.array([(-1, 1, 0), (0, 1, 0), (0, 1, 1), (-1, 1, 1)]), np.array([[0, 1, 2], [0, 2, 3]])
    whole = seams_of(charts, sizes, EmbreeTracer(scene_of(*walls)))
    parted = seams_of(charts, sizes, EmbreeTracer(scene_of(*merge(walls, floor))))
    assert len(whole.image) == len(seams_of(charts, sizes).image)
    assert abs(2 * len(parted.image) - len(whole.image)) <= 2
    assert (parted.place[parted.image == 1][:, 0] > 15).all()


def test_seams_know_their_folds_and_no_sheet_is_sewn_to_one_that_lies_on_it():
    cube = unwrapped_box(0.02, inwards=False, smooth=True)
    assert seams_of(Charts.of([cube]), ((80, 100),)).fold == pytest.approx(np.pi / 2)
    left, right = unwrapped_plane(0.3), unwrapped_plane(0.3)
    beside = mesh_of(right.positions + np.array([2, 0, 0]), right.uv, image=1)
    on_it = mesh_of(right.positions, right.uv, image=1)
    sizes = (20, 20), (20, 20)
    flat = seams_of(Charts.of([left, beside]), sizes)
    assert len(flat.image) > 20 and flat.fold == pytest.approx(0, abs=1e-3)
    assert len(seams_of(Charts.of([left, on_it]), sizes).image) == 0


def test_seams_of_a_smooth_cube_are_seen_through():
    """No surface parts the sides of a sharp bend."""
    for inwards in (False, True):
        mesh = unwrapped_box(0.02, inwards, degrees=15, smooth=True)
        charts, sizes = Charts.of([mesh]), ((80, 100),)
        tracer = EmbreeTracer(scene_of(*box(1.0, inwards)))
        assert len(seams_of(charts, sizes, tracer).image) == len(seams_of(charts, sizes).image) > 500


def test_a_black_border_does_not_turn_negative():
    image = finished(unwrapped_plane(0.3, 20), (24, 24), lambda p: np.maximum(p[:, :1], 0) * [8, 4, 2])
    assert image.min() >= 0


@pytest.mark.parametrize("sizes", [[], [(8, 8)], [(1, 1), (1, 5)]])
@pytest.mark.parametrize("denoiser", ["own", pytest.param("oidn", marks=needs_oidn)])
def test_images_without_receivers_are_black(sizes, denoiser):
    receivers, texels = texel_receivers([], sizes)
    nothing = np.zeros((0, 3), np.float32)
    images = finish_lightmaps(nothing, nothing[:, 0], receivers, texels, FinishOptions(denoiser))
    assert [image.light.shape for image in images] == [(*size, 3) for size in sizes]
    assert not any(image.light.any() for image in images)


def test_light_with_its_slope():
    receivers, texels = texel_receivers([unwrapped_plane(0.3)], [(20, 20)])
    values = np.linspace(-1, 1, 12 * len(receivers), dtype=np.float32).reshape(-1, 12)
    values[:, :3] += 2
    stderr = np.full(len(receivers), 0.01, np.float32)
    for denoiser in ("none", "own", *(["oidn"] if has_oidn() else [])):
        (image,) = finish_lightmaps(values, stderr, receivers, texels, FinishOptions(denoiser))
        assert image.light.shape == (20, 20, 3) and image.slope.shape == (20, 20, 3, 3)
        assert np.isfinite(image.slope).all() and (image.normal == (0, 0, 1)).all()
        own = image.slope[texels.row, texels.column].reshape(-1, 9)
        assert np.abs(own - values[:, 3:])[texels.weight > 0.999].max() < 4.1 * 0.01, "no more than the noise"


@pytest.mark.parametrize("denoiser", ["own", pytest.param("oidn", marks=needs_oidn)])
class TestDenoisers:
    """On a cube whose walls are charts close to each other, each much brighter than the last."""

    @staticmethod
    def images(noise, light):
        mesh = unwrapped_box(0.01, inwards=False)
        receivers, texels = texel_receivers([mesh], [(120, 150)])
        truth = light(receivers.position, texels.chart)
        stderr = (noise * truth.mean(axis=1)).astype(np.float32)
        noisy = truth + np.sqrt(3) * stderr[:, None] * np.random.default_rng(0).normal(size=truth.shape)
        return (texel_images(v.astype(np.float32), stderr, receivers, texels)[0] for v in (truth, noisy))

    def test_noise_goes(self, denoiser):
        truth, noisy = self.images(0.1, lambda position, chart: ramp(position))
        (clean,) = denoised([noisy], denoiser, Workers())
        before, after = (np.sqrt(np.mean((image.value - truth.value) ** 2)) for image in (noisy, clean))
        assert after < before / 3

    def test_what_has_no_noise_stays(self, denoiser):
        truth, _ = self.images(0.0, lambda position, chart: wave(position))
        (clean,) = denoised([truth], denoiser, Workers())
        assert np.abs(clean.value - truth.value).max() < 1e-3

    def test_nothing_bleeds_from_chart_to_chart(self, denoiser):
        truth, noisy = self.images(0.03, lambda position, chart: np.repeat(4.0 ** chart[:, None], 3, axis=1))
        (clean,) = denoised([noisy], denoiser, Workers())
        error = np.abs(clean.value / np.maximum(truth.value, 1e-9) - 1)[truth.covered]
        assert error.max() < 0.2 and np.sqrt(np.mean(error**2)) < 0.03

    def test_same_whatever_the_threads(self, denoiser):
        _, noisy = self.images(0.1, lambda position, chart: wave(position))
        one, three = (denoised([noisy], denoiser, Workers(n_threads=n))[0].value for n in (1, 3))
        assert np.array_equal(one, three)


def test_close_charts_are_denoised_apart():
    chart = np.full((40, 60), -1, np.int32)
    for k in range(6):
        chart[2:38, 10 * k + 1 : 10 * k + 9] = k
    passes = _passes(chart)
    assert passes.min() == 0 and passes.max() >= 1 and all(passes[k] != passes[k + 1] for k in range(5))


def test_a_missing_denoiser_is_said(monkeypatch):
    monkeypatch.setattr("photon_bake.addon.output.lightmap.denoise.has_oidn", lambda: False)
    assert denoised([], "auto", Workers()) == []
    with pytest.raises(BakeError, match="choose our own denoiser"):
        denoised([], "oidn", Workers())


def test_conjugate_gradients_solve_what_elimination_does():
    """Of a random system, three right sides at once, one of which is solved from the start."""
    random = np.random.default_rng(0)
    factor = random_array((80, 50), density=0.1, random_state=random)
    whole = (factor.T @ factor).toarray() + np.eye(50)
    matrix, scale = scaled(csr_array(whole))
    right, start = random.normal(size=(50, 3)).astype(np.float32), np.zeros((50, 3), np.float32)
    truth = np.linalg.solve(whole, right / scale[:, None])
    start[:, 1] = truth[:, 1] / scale
    steps = []
    found = solve(matrix, right, start, 1e-5, 100, lambda: steps.append(1)) * scale[:, None]
    assert found == pytest.approx(truth, abs=1e-4 * np.abs(truth).max())
    assert 0 < len(steps) < 40
