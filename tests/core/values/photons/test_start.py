"""How photons start and who gets how many: numbers, pictures, flights, guides; closed forms as plain Python."""

from types import SimpleNamespace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.sobol import sobol_points, sobol_seeds
from photon_bake.addon.emitters import Rays, Sphere, bounding_sphere, light_sources
from photon_bake.addon.photons import bounce_map, emitted_rays, guide_sources, guiding, noise_of_photons, pilots_for
from photon_bake.addon.photons import emission as starts
from photon_bake.addon.photons.bounce_map import View, picture_rays, view_of
from photon_bake.addon.photons.emission import Emission, Pass, PictureEmission, shares
from photon_bake.addon.photons.flights import FlightLog, Flights
from photon_bake.addon.photons.front import new_front, photon_at
from photon_bake.addon.photons.guiding import GuidedSource
from photon_bake.addon.scene import LightKind, Lights
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, scene_of
from photon_bake.tests.core.test_emission import source_of
from photon_bake.tests.core.values.emitters.test_lamps import AXIS, X, Y, spot_share

REGION = Sphere(np.zeros(3, np.float32), 1.7)


def with_importance(*values):
    return [SimpleNamespace(importance=value) for value in values]


def two_sources():
    point = lamp(LightKind.POINT, (3, 2, 1), position=(0, 0.1, 0.5), radius=0.1)
    lights = Lights.join([point, lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 0.5), size=(1, 0.5))])
    return light_sources(scene_of(*box(), lights=lights), REGION)


# Shares and numbers


def test_a_quarter_of_the_photons_is_shared_evenly():
    assert shares(with_importance(1, 3, 0), 1200) == [100 + 225, 100 + 675, 100]
    assert shares(with_importance(0, 0), 10) == [5, 5] and shares([], 10) == []
    assert shares(with_importance(1, 1e9), 2) == [1, 2]
    assert Pass.PHOTONS.value == (1, 2) and Pass.PILOTS.value == (4, 5)


def test_photons_are_numbered_one_source_after_the_other():
    """The i-th of a source starts from the i-th point of its sequence, with the source's power over its number."""
    sources, counts = two_sources(), [5, 7]
    emission = Emission(sources, counts, 3, Pass.PHOTONS)
    assert emission.n == 12
    seeds = sobol_seeds(2, 3, 1)
    points = [sobol_points(seeds, k, 0, n) for k, n in enumerate(counts)]
    for k in range(2):
        assert np.array_equal(emission.points(k), points[k])
    rays = [source.emit(u) for source, u in zip(sources, points, strict=True)]
    for first, n in ((0, 12), (3, 6), (7, 3)):
        front = new_front(n)
        emission.start(front, slice(first, first + n))
        for k in range(n):
            path = first + k
            of, i = (0, path) if path < 5 else (1, path - 5)
            one = photon_at(front, k)
            assert one.path == path and one.source == of and one.came_from == rays[of].objects[i]
            assert one.origin == pytest.approx(rays[of].origins[i]) and one.direction == pytest.approx(
                rays[of].directions[i]
            )
            assert one.power == pytest.approx(rays[of].flux[i] / counts[of], rel=1e-6)
    found = emitted_rays(sources, 12, 3)
    counts = shares(sources, 12)
    assert [len(of.flux) for of in found] == counts
    assert np.array_equal(found[1].flux, sources[1].emit(sobol_points(seeds, 1, 0, counts[1])).flux)
    assert len(Emission([], [], 3, Pass.PHOTONS)._first) == 1


def test_pictures_start_their_photons_through_their_pixels():
    def rays(n, value):
        random = np.random.default_rng(n)
        origins, directions, flux = random.random((3, n, 3)).astype(np.float32)
        return Rays(origins, directions, flux, np.full(n, value, np.int32))

    of = [rays(4, 7), rays(6, 8)]
    emission = PictureEmission(of)
    assert emission.n == 10
    for first, n in ((0, 10), (2, 5), (5, 4), (0, 3)):
        front = new_front(n)
        emission.start(front, slice(first, first + n))
        for k in range(n):
            source, i = (0, first + k) if first + k < 4 else (1, first + k - 4)
            one = photon_at(front, k)
            assert (one.path, one.source, one.came_from) == (first + k, source, (7, 8)[source])
            assert one.origin == pytest.approx(of[source].origins[i])
            assert one.direction == pytest.approx(of[source].directions[i])
            assert one.power == pytest.approx(of[source].flux[i] / (4, 6)[source], rel=1e-6)


# Pictures


def test_pixels_are_points_of_the_hypercube():
    view = View(SimpleNamespace())
    view.n_faces = 6
    assert view.side(6 * 9) == 3 and view.side(6 * 9 + 1) == 4 and View(SimpleNamespace()).side(10) == 4
    points = view.points(50, 3, 1)
    assert len(points) == 54
    row, column = np.divmod(np.arange(54), 18)
    assert points[:, 0] == pytest.approx((column + 0.5) / 18) and points[:, 1] == pytest.approx((row + 0.5) / 3)
    assert np.array_equal(points[:, 2:], sobol_points(sobol_seeds(1, 3, 3, 1), 0, 0, 54)[:, 2:])


PLACE = {"position": (0, 0.1, 0.5), "direction": AXIS}
CUBE = [(1, 2, 0), (1, 2, 0), (0, 1, 2), (0, 1, 2), (2, 0, 1), (2, 0, 1)]


@pytest.mark.parametrize(("angle", "half"), [(1.1, 1.5 * np.tan(0.55)), (2.2, None)])
def test_pictures_of_lamps(angle, half):
    """A spot's frustum, or a cube of six faces: I dx dy/(1 + x² + y²)^(3/2) by the size of the plane."""
    source = source_of(lamp(LightKind.SPOT, 2.0, angle=angle, blend=0.6, stretch=(1.5, 0.7), **PLACE))
    view = view_of(source)
    n_faces, side = (1, 2 * half) if half else (6, 2)
    assert view.n_faces == n_faces
    u = view.points(n_faces * 9, 1, 0)
    rays = view.emit(u)
    assert np.linalg.norm(rays.directions, axis=1) == pytest.approx(1, abs=1e-5) and (rays.objects == -1).all()
    for k in range(len(u)):
        face = int(u[k, 0] * n_faces)
        x, y = side * (u[k, 0] * n_faces - face - 0.5), side * (u[k, 1] - 0.5)
        d = rays.directions[k].astype(np.float64)
        if half:
            expected = x * X + y * Y + AXIS
        else:
            axes = np.roll(np.eye(3), face // 2, axis=0)
            expected = x * axes[0] + y * axes[1] + (1 - 2 * (face % 2)) * axes[2]
        assert d == pytest.approx(expected / np.linalg.norm(expected), abs=1e-5)
        flux = 2 * n_faces * side**2 / (1 + x * x + y * y) ** 1.5 * spot_share(d, angle)
        assert rays.flux[k] == pytest.approx([flux] * 3, rel=1e-3, abs=1e-5)
        assert rays.origins[k] == pytest.approx((0, 0.1, 0.5))


def test_pictures_of_point_lamps_start_at_their_discs():
    source = source_of(lamp(LightKind.POINT, 2.0, radius=0.2, **PLACE))
    view = view_of(source)
    u = view.points(6 * 16, 1, 0)
    rays = view.emit(u)
    assert rays.flux.mean() == pytest.approx(8 * np.pi, rel=0.02)
    offset = rays.origins - np.float32(PLACE["position"])
    assert np.linalg.norm(offset, axis=1) == pytest.approx(0.2 * np.sqrt(u[:, 2]), rel=1e-3, abs=1e-5)
    assert np.einsum("ij,ij->i", offset, rays.directions) == pytest.approx(0, abs=1e-5)


def test_pictures_of_suns():
    """A square around the scene, across the rays: E 2/(1 + cos(α/2)) times its area."""
    source = source_of(lamp(LightKind.SUN, (1, 2, 3), angle=0.6, direction=AXIS))
    whole, view = bounding_sphere(source.surroundings.scene), view_of(source)
    u = view.points(25, 1, 0)
    rays = view.emit(u)
    beam = np.array([1, 2, 3]) * 2 / (1 + np.cos(0.3)) * 4 * whole.radius**2
    assert rays.flux == pytest.approx(np.tile(beam, (25, 1)), rel=1e-5) and (rays.objects == -1).all()
    for k in range(25):
        d, away = rays.directions[k].astype(np.float64), rays.origins[k] - whole.centre
        assert d @ AXIS == pytest.approx(1 - u[k, 2] * (1 - np.cos(0.3)), abs=1e-5)
        assert away @ d == pytest.approx(-whole.radius, rel=1e-4)
        plane_ = away - away @ d * d
        expected = np.hypot(*(2 * u[k, :2] - 1)) * whole.radius
        assert np.linalg.norm(plane_) == pytest.approx(expected, abs=1e-4)


def test_bounce_maps_are_what_pictures_meet():
    sources = two_sources()
    scene = sources[0].surroundings.scene
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    of = bounce_map(tracer, sources[0], 20, seed=2)
    assert of.side == 2 and len(of.rays.flux) == 24 and of.hits.hit.all()
    hits = tracer.closest_hit(of.rays.origins, of.rays.directions, photons_to=np.zeros(24, np.uint8))
    assert np.array_equal(hits.triangle, of.hits.triangle)
    pictures = picture_rays(sources, [20, 5], 2)
    assert [len(rays.flux) for rays in pictures] == [24, 9]
    assert np.array_equal(pictures[0].directions, of.rays.directions)
    area = view_of(sources[1])
    assert type(area) is View and np.array_equal(pictures[1].flux, sources[1].emit(area.points(5, 2, 1)).flux)
    assert not np.array_equal(
        pictures[0].origins, view_of(sources[0]).emit(view_of(sources[0]).points(20, 3, 0)).origins
    )


# Flights


def flights(origins, directions, length, specular):
    n = len(origins)
    directions = np.float32(directions) / np.linalg.norm(directions, axis=1, keepdims=True)
    power = np.arange(3 * n, dtype=np.float32).reshape(n, 3)
    return Flights(np.float32(origins), directions.astype(np.float32), np.float32(length), power, np.array(specular))


def test_flights_are_cut_to_a_ball():
    """Of each the part between where it enters and where it leaves or ends."""
    of = flights(
        [(-3, 0, 1), (1, 0, 1.5), (-3, 0.6, 1), (-3, 0, 1), (-3, 5, 1), (3, 0, 1), (1, 0, 1)],
        [(1, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0), (0, 1, 0)],
        [np.inf, np.inf, 4.0, 2.9, np.inf, np.inf, 0.5],
        [True, True, True, True, True, True, False],
    )
    ball = Sphere(np.float32([1, 0, 1]), 1.0)
    starts_at = [(0, 0, 1), (1, 0, 1.5), (0.2, 0.6, 1), (1, 0, 1)]
    lengths = [2, 0.5, 0.8, 0.5]
    for scattered, kept in ((False, 3), (True, 4)):
        log = FlightLog(ball, scattered)
        log.take(0, of)
        found = log.flights()
        assert found.origin == pytest.approx(np.float32(starts_at[:kept]), abs=1e-5)
        assert found.length == pytest.approx(lengths[:kept], abs=1e-5)
        assert (
            found.power[:, 0].tolist() == [0, 3, 6, 18][:kept]
            and found.specular.tolist() == ([True] * 3 + [False])[:kept]
        )
        assert np.array_equal(found.direction, of.direction[[0, 1, 2, 6]][:kept])


def test_flights_of_batches_come_in_their_order():
    log = FlightLog(Sphere(np.zeros(3, np.float32), 9.0), True)
    one = flights([(0, 0, 0), (1, 0, 0)], [(0, 0, 1), (0, 1, 0)], [1, 1], [True, False])
    assert len(log.flights()) == 0 and len(Flights.none()) == 0
    log.take(7, one)
    log.take(2, one.where(np.array([False, True])))
    log.take(7, one.where(np.array([0])))
    assert log.flights().origin[:, 0].tolist() == [1, 0, 1, 0]
    none = Flights.none()
    assert none.origin.shape == none.direction.shape == none.power.shape == (0, 3) and none.specular.dtype == bool
    joined = Flights.join([one, none, one.where(np.array([1]))])
    assert joined.origin[:, 0].tolist() == [0, 1, 1] and joined.specular.tolist() == [True, False, False]


# Guides


def guided(u, importance, n_cells, one_more=0.0):
    source = source_of(lamp(LightKind.POINT, 2.0, position=(0, 0, 1)))
    source.n_cells = n_cells
    return GuidedSource(source, np.float32(u), np.array(importance), one_more), source


def test_a_guide_by_what_its_pilots_found():
    """Mean squares of cells, each as if eight photons had said before what the larger cell around it says."""
    u = np.zeros((5, 5))
    u[:, 0], u[:, 1] = [0.05, 0.3, 0.6, 0.61, 0.97], [0.1, 0.9, 0.4, 0.6, 0.7]
    importance, shape = np.array([1.0, 4, 0, 3, 2]), (12, 3, 1, 1, 1)
    of, source = guided(u, importance, shape, one_more=5.0)
    squares = importance**2
    mean = np.full(shape[:2], squares.mean())
    cells = np.minimum((u[:, :2] * shape[:2]).astype(int), np.array(shape[:2]) - 1)
    for merged in (8, 4, 2, 1):
        sums, counts = np.zeros(shape[:2]), np.zeros(shape[:2])
        for i in range(12):
            for j in range(3):
                there = (cells // merged == np.array([i, j]) // merged).all(axis=1)
                sums[i, j], counts[i, j] = squares[there].sum(), there.sum()
        mean = (sums + 8 * mean) / (counts + 8)
    guided_by = np.sqrt(mean)
    density = 0.25 + 0.75 * guided_by / guided_by.mean()
    assert of.guide.density[..., 0, 0, 0] == pytest.approx(density / density.mean(), rel=1e-6)
    assert of.importance == pytest.approx(np.sqrt(squares.sum() / 5))
    assert of.deviation == pytest.approx(np.sqrt((squares.sum() + 25) / 6))
    assert of.name == source.name and of.power is source.power and of.kind == source.kind
    nothing, _ = guided(np.zeros((0, 5)), [], shape)
    assert nothing.importance == 0 and nothing.guide.density == pytest.approx(1)
    even, _ = guided(u, 0 * importance, shape)
    assert even.guide.density == pytest.approx(1) and even.deviation == 0


def test_how_many_pilots_and_what_noise():
    assert [pilots_for(n) for n in (1, 400, 1 << 30)] == [1, 100, 1 << 17]
    of = [SimpleNamespace(importance=1.0, deviation=2.0), SimpleNamespace(importance=3.0, deviation=5.0)]
    a, b = shares(of, 100)
    assert noise_of_photons(of, 100) == pytest.approx(np.sqrt(4 / a + 25 / b))


def test_flux_towards_the_region():
    """The mean of rays that meet the ball or start in it; of all if none does."""
    origins = np.float32([(0, 0, -3), (0, 0, 3), (0.9, 0, -3), (1.1, 0, -3), (0.2, 0, 0)])
    directions = np.float32([(0, 0, 1)] * 4 + [(1, 0, 0)])
    rays = Rays(origins, directions, np.float32([[1, 2, 3], [-9, 9, 0], [4, 4, 4], [7, 7, 7], [-6, 6, 0]]), np.zeros(5))
    ball = Sphere(np.zeros(3, np.float32), 1.0)
    assert guiding._flux_towards(ball, rays) == pytest.approx((2 + 4 + 4) / 3)
    assert guiding._flux_towards(None, rays) == pytest.approx((2 + 6 + 4 + 7 + 4) / 5)
    aside = Sphere(np.float32([50, 0, 0]), 1.0)
    assert guiding._flux_towards(Sphere(np.float32([0, 70, 0]), 1.0), rays) == pytest.approx(23 / 5)
    assert guiding._flux_towards(aside, rays) == pytest.approx(4)


def test_sources_are_guided_by_their_own_pilots():
    sources = two_sources()
    scene = sources[0].surroundings.scene
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    seen = {}

    def importance(photons):
        seen["path"], seen["value"] = photons.path, photons.power.sum(axis=1)
        return seen["value"]

    found = guide_sources(scene, tracer, sources, 24, 2, importance, Workers(3), importance_of_watt=0.5)
    counts, start = shares(sources, 24), 0
    points = starts.emitted_points(sources, 24, 3, Pass.PILOTS)
    for source, of, n, u in zip(sources, found, counts, points, strict=True):
        value = np.bincount(seen["path"], seen["value"], sum(counts))[start : start + n] * n
        flux = np.abs(source.emit(u).flux).mean(axis=1).mean()
        assert len(u) == n and of.name == source.name
        assert of.importance == pytest.approx(np.sqrt((value**2).mean()), rel=1e-5)
        assert of.deviation == pytest.approx(np.sqrt(((value**2).sum() + (0.5 * flux) ** 2) / (n + 1)), rel=1e-4)
        start += n
