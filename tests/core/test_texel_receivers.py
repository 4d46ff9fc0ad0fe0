"""Receivers at texels: which texels get one, where it lies, and that none starts inside a wall."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.output.lightmap import FinishOptions, finish_lightmaps
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Charts, texel_receivers
from photon_bake.addon.receivers.lightmap.coverage import cells_of, texels_of
from photon_bake.addon.receivers.lightmap.texels import LEAST_SHARE
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, scene_of
from photon_bake.tests.core.unwrapped import look_up, mesh_of, points_on, unwrapped_box, unwrapped_plane

COORDINATE = st.floats(-3, 15)


def touched(corners, size):
    """Share of each texel (row, column) that a triangle covers, from 40 × 40 points each."""
    place = (np.arange(size * 40) + 0.5) / 40
    x, y = np.meshgrid(place, place)
    sides = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        sides.append((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]))
    inside = (np.minimum.reduce(sides) > 0) | (np.maximum.reduce(sides) < 0)
    return inside.reshape(size, 40, size, 40).mean(axis=(1, 3))


def area(corners):
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    return abs(a[0] * b[1] - a[1] * b[0]) / 2


@pytest.mark.parametrize("side", [1, -1])
def test_receivers_are_lifted_to_the_side_that_their_normals_are_on(side):
    """Normals may look away from the side that the winding makes the front; light is wanted where they look."""
    mesh = unwrapped_plane()
    turned = mesh_of(mesh.positions, mesh.uv, side * mesh.normals)
    receivers, _ = texel_receivers([turned], [(16, 16)])
    assert (side * receivers.position[:, 2] > 0).all() and (receivers.normal[:, 2] == side).all()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=3))
def test_coverage_is_what_points_say(corners):
    corners = np.array(corners)
    fragments = texels_of(corners[None], np.array([[12, 12]]), Workers())
    cover = np.zeros((12, 12))
    cover[fragments.texel[:, 1], fragments.texel[:, 0]] = fragments.area
    sampled = touched(corners, 12)
    assert np.abs(cover - sampled).max() < 0.06
    assert not ((sampled > 0) & (cover == 0)).any(), "a texel that the triangle touches has none of it"


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 12), st.floats(0, 12)), min_size=3, max_size=3))
def test_areas_and_centroids_add_up(corners):
    corners = np.array(corners)
    fragments = texels_of(corners[None], np.array([[12, 12]]), Workers())
    assert fragments.area.sum() == pytest.approx(area(corners), abs=1e-9)
    moment = (fragments.area[:, None] * fragments.middle).sum(axis=0)
    assert moment == pytest.approx(corners.mean(axis=0) * area(corners), abs=1e-8)
    cells = cells_of(corners[None], fragments, 3, Workers())
    assert cells.area.sum() == pytest.approx(area(corners), abs=1e-9)


@pytest.mark.parametrize("degrees", [0, 20, 45])
def test_weights_add_up_to_the_charts_area(degrees):
    mesh = unwrapped_plane(0.3, degrees)
    receivers, texels = texel_receivers([mesh], [(30, 40)])
    assert texels.weight.sum() == pytest.approx(0.6 * 30 * 0.6 * 40, rel=2e-3)  # less what is below the least share
    assert np.pi * (receivers.footprint**2).sum() == pytest.approx(4, rel=2e-3)
    assert texels.chart.max() == 0 and texels.weight.min() >= LEAST_SHARE
    assert len(np.unique(np.stack([texels.row, texels.column]), axis=1).T) == len(texels)


def test_receivers_lie_where_they_say_lifted_off_the_surface():
    mesh = unwrapped_plane(0.3, 0)
    receivers, texels = texel_receivers([mesh], [(31, 37)])
    assert np.abs((texels.uv - 0.5) / 0.3 - receivers.position[:, :2]).max() < 1e-5
    assert (receivers.position[:, 2] > 0).all() and receivers.position[:, 2].max() < 1e-3
    whole = texels.weight > 1 - 1e-5
    centre = np.stack([(texels.column + 0.5) / 37, (texels.row + 0.5) / 31], axis=1)
    assert whole.sum() > 300 and np.abs(texels.uv - centre)[whole].max() < 1e-5
    assert (receivers.normal == [0, 0, 1]).all()


def test_mirrored_uvs_do_no_harm():
    mesh = unwrapped_plane(0.3, 20)
    mirrored = mesh_of(mesh.positions, mesh.uv * [-1, 1] + [1, 0])
    _, texels = texel_receivers([mesh], [(32, 32)])
    receivers, others = texel_receivers([mirrored], [(32, 32)])
    assert others.weight.sum() == pytest.approx(texels.weight.sum(), rel=1e-5)
    assert (receivers.position[:, 2] > 0).all()


def test_walls_of_a_box_are_six_charts_and_a_smooth_one_too():
    for smooth in (False, True):
        charts = Charts.of([unwrapped_box(0.02, smooth=smooth)])
        assert charts.chart.max() == 5 and charts.patch.max() == 5 and len(charts.border) == 24


def test_a_folded_chart_has_a_patch_on_each_side_and_a_texel_a_receiver_of_each():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 1), (1, 1, 1)], np.float32)
    triangles = np.array([(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)])
    uv = np.array([(0.1, 0.1), (0.5, 0.1), (0.5, 0.9), (0.1, 0.9), (0.9, 0.1), (0.9, 0.9)])
    mesh = mesh_of(vertices[triangles], uv[triangles])
    charts = Charts.of([mesh])
    assert charts.chart.max() == 0 and charts.patch.tolist() == [0, 0, 1, 1] and len(charts.border) == 6
    receivers, texels = texel_receivers([mesh], [(10, 11)])  # the fold halves the sixth column
    fold = texels.column == 5
    assert np.bincount(texels.row[fold]).max() == 2 and texels.weight[fold] == pytest.approx(0.5, abs=1e-4)
    assert {tuple(normal) for normal in receivers.normal[fold]} == {(0, 0, 1), (-1, 0, 0)}


def test_a_texel_of_many_small_triangles_has_one_receiver_on_the_surface():
    n = 40  # a quarter of a cylinder in 2 × 2 texels
    angle, z = np.linspace(0, np.pi / 2, n + 1), (0.0, 1.0)
    ring = [np.stack([np.cos(angle), np.sin(angle), np.full(n + 1, h)], axis=1) for h in z]
    uv = [np.stack([np.linspace(0.1, 0.9, n + 1), np.full(n + 1, 0.1 + 0.8 * h)], axis=1) for h in z]

    def strip(low, high):
        return np.concatenate(
            [np.stack([low[:-1], low[1:], high[1:]], 1), np.stack([low[:-1], high[1:], high[:-1]], 1)]
        )

    outwards = strip(*[r * [1, 1, 0] for r in ring])
    receivers, _ = texel_receivers([mesh_of(strip(*ring), strip(*uv), outwards)], [(2, 2)])
    assert len(receivers) == 4
    radius = np.linalg.norm(receivers.position[:, :2], axis=1)
    assert (radius > 0.9997).all() and (np.abs(np.linalg.norm(receivers.normal, axis=1) - 1) < 1e-5).all()


def test_a_thin_chart_still_has_receivers():
    corners = np.array([[(0, 0, 0), (1, 0, 0), (1, 1, 0)]], np.float32)
    _, texels = texel_receivers([mesh_of(corners, [[(0.1, 0.5), (0.9, 0.5), (0.9, 0.50001)]])], [(16, 16)])
    assert len(texels) > 0


def test_no_meshes_and_no_area():
    receivers, texels = texel_receivers([], [(8, 8)])
    assert len(receivers) == len(texels) == 0
    point = mesh_of([[(0, 0, 0), (1, 0, 0), (1, 1, 0)]], np.full((1, 3, 2), 0.5))
    assert len(texel_receivers([point], [(8, 8)], EmbreeTracer(scene_of(*plane())))[0]) == 0


def test_images_of_several_sizes():
    meshes = [unwrapped_plane(0.3, 0), mesh_of(unwrapped_plane().positions, unwrapped_plane().uv, image=1)]
    _, texels = texel_receivers(meshes, [(20, 20), (40, 30)])
    assert texels.sizes == ((20, 20), (40, 30))
    weight = np.bincount(texels.image, texels.weight)
    assert weight == pytest.approx([144, 432], rel=1e-3)
    assert texels.row[texels.image == 1].max() == 31 and texels.chart.max() == 1


def post_on_a_floor(inwards=False):
    """A floor from −1 to 1 with a post on it, that covers x and y from −0.3 to 0.3."""
    post = box(0.3, inwards)
    return scene_of(*merge(plane(), (post[0] + np.float32([0, 0, 0.2]), post[1])))


def test_texels_at_a_posts_foot_see_what_is_outside_and_those_under_it_are_dark():
    """Texels are 2/21 m wide; the post's walls stand 0.15 texels into those of rows and columns 7 and 13."""
    tracer = EmbreeTracer(post_on_a_floor())
    receivers, texels = texel_receivers([unwrapped_plane(0.5)], [(21, 21)], tracer)
    hidden = texels.chart == 1
    middle = np.maximum(np.abs(texels.row - 10), np.abs(texels.column - 10))
    assert (middle[hidden] <= 2).all() and (middle[~hidden] >= 2).all()
    assert (np.abs(receivers.position[:, :2]).max(axis=1) > 0.3)[~hidden].all()
    assert (np.abs(receivers.position[:, :2]).max(axis=1) < 0.3)[hidden].all()
    n_receivers = np.zeros((21, 21), int)
    np.add.at(n_receivers, (texels.row, texels.column), 1)
    foot = np.concatenate([n_receivers[7, 8:13], n_receivers[13, 8:13], n_receivers[8:13, 7], n_receivers[8:13, 13]])
    assert (foot > 1).all() and n_receivers[0, 0] == 1 and n_receivers.all()
    assert np.abs((texels.uv - 0.5) * 2 - receivers.position[:, :2]).max() < 1e-5


@pytest.mark.parametrize("size", [20, 21, 22, 23, 24, 27])
def test_light_at_a_posts_foot_does_not_darken(size):
    """Where a floor of light 1 + x ends at a post, dark within: look-ups outside must see the floor alone."""
    mesh = unwrapped_plane(0.5)
    receivers, texels = texel_receivers([mesh], [(size, size)], EmbreeTracer(post_on_a_floor()))
    outside = np.abs(receivers.position[:, :2]).max(axis=1) > 0.3
    values = np.repeat(np.where(outside, 1 + receivers.position[:, 0], 0)[:, None], 3, axis=1).astype(np.float32)
    stderr = np.zeros(len(values), np.float32)
    image = finish_lightmaps(values, stderr, receivers, texels, FinishOptions(denoiser="none"))[0].light
    positions, uv = points_on(mesh, 4000)
    largest = np.abs(positions[:, :2]).max(axis=1)
    around = (largest > 0.3) & (largest < 0.5)
    assert np.abs(look_up(image, uv)[around, 0] - 1 - positions[around, 0]).max() < 0.02
    assert look_up(image, [(0.5, 0.5)])[0, 0] == pytest.approx(0)


def test_what_lies_wholly_in_a_wall_is_pushed_out_if_the_wall_is_near():
    """Two texels: in the one a small triangle under the post's edge, in the other one far away."""
    hidden = np.array([(0.25, -0.02, 0), (0.29, -0.02, 0), (0.25, 0.02, 0)])
    far = hidden + np.array([0.4, 0, 0])
    uv = np.array([(0.1, 0.1), (0.2, 0.1), (0.1, 0.3)])
    uvs = [uv, uv + np.array([0.5, 0])]
    mesh = mesh_of([hidden, far], uvs)
    receivers, texels = texel_receivers([mesh], [(1, 2)], EmbreeTracer(post_on_a_floor()))
    moved = receivers.position[texels.column == 0]
    assert len(moved) > 0 and (moved[:, 0] > 0.3).all() and (moved[:, 0] < 0.32).all()
    deep = mesh_of([hidden - np.array([0.2, 0, 0]), far], uvs)
    receivers, texels = texel_receivers([deep], [(1, 2)], EmbreeTracer(post_on_a_floor()))
    assert (texels.chart[texels.column == 0] >= texels.charts.n_charts).all()
    assert (receivers.position[texels.column == 0, 0] < 0.1).all()


def test_in_a_room_that_faces_outwards_nothing_is_left_out():
    """All surfaces show their backs to a plane in such a room, which yet is lit."""
    room = box(2.0, inwards=False)
    tracer = EmbreeTracer(scene_of(*merge(plane(), room)))
    receivers, _ = texel_receivers([unwrapped_plane(0.5)], [(10, 10)], tracer)
    assert len(receivers) == 100


def test_same_receivers_whatever_the_threads():
    tracer = EmbreeTracer(post_on_a_floor())
    one, three = (texel_receivers([unwrapped_plane(0.5, 10)], [(30, 30)], tracer, Workers(n_threads=n)) for n in (1, 3))
    for a, b in zip((one[0].position, one[1].weight), (three[0].position, three[1].weight), strict=True):
        assert np.array_equal(a, b)


def test_furnace():
    """In a closed box of 24 m² a lamp of 24 W gives a mean indirect irradiance of ρ/(1−ρ), on its lightmap too."""
    scene = scene_of(*box(), albedo=0.5, lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0)))
    tracer = EmbreeTracer(scene)
    receivers, texels = texel_receivers([unwrapped_box(0.03)], [(24, 36)], tracer)
    light = bake(scene, receivers, settings_for("draft", n_photons=200_000, n_gather_rays=1024, n_cache_rays=4), tracer)
    mean = np.average(light.value, axis=0, weights=receivers.footprint**2)
    assert mean == pytest.approx(np.ones(3), rel=0.02)
    image = finish_lightmaps(light.value, light.stderr, receivers, texels, FinishOptions(denoiser="own"))[0].light
    assert image.shape == (24, 36, 3)
    assert image.min() > 0.4 and image.max() < 1.5
