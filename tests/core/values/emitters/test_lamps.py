"""Points of lamps, and lamps along rays, at single numbers: closed forms in double precision, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.emitters import area, lamps, point, spot, sun
from photon_bake.addon.emitters.lamps import lamp_arrays
from photon_bake.addon.scene import LightKind, Lights, RayKind
from photon_bake.tests.core.scenes import lamp
from photon_bake.tests.core.values.lobe_formulas import (
    NUMBERS,
    f,
    numbers,
    triple,
    unit,
)

AXIS = np.array(unit(0.3, -0.2, -0.9), np.float64)
CENTRE = np.array([0.4, 0.3, 2.0])
PLACE = {"position": CENTRE, "direction": AXIS}
SUN, POINT, BALL, SPOT, SPOT_BALL, RECTANGLE, ELLIPSE, SPREAD, NARROW = range(9)
LIGHTS = Lights.join(
    [
        lamp(LightKind.SUN, (1, 2, 3), angle=0.4, direction=AXIS),
        lamp(LightKind.POINT, (2, 1, 4), radius=0.3, **PLACE),
        lamp(LightKind.POINT, (2, 1, 4), radius=0.3, sphere=True, **PLACE),
        lamp(LightKind.SPOT, (3, 2, 1), radius=0.3, angle=1.1, blend=0.6, stretch=(1.5, 0.7), **PLACE),
        lamp(LightKind.SPOT, (3, 2, 1), radius=0.3, sphere=True, angle=1.1, blend=0.6, **PLACE),
        lamp(LightKind.RECTANGLE, (1, 2, 5), size=(0.6, 1.1), **PLACE),
        lamp(LightKind.ELLIPSE, (1, 2, 5), size=(0.6, 1.1), **PLACE),
        lamp(LightKind.RECTANGLE, (1, 2, 5), size=(0.6, 1.1), spread=2.2, **PLACE),
        lamp(LightKind.ELLIPSE, (1, 2, 5), size=(2.6, 3.1), spread=0.5, **PLACE),
    ]
)
ARRAYS = lamp_arrays(LIGHTS)
X, Y = LIGHTS.axis_x[POINT].astype(np.float64), LIGHTS.axis_y[POINT].astype(np.float64)
POSITIONS = [triple(p) for p in ((0.1, 0.2, 0), (0.9, -0.4, 0.3), (1.0, 0.1, 0.8), (0.7, 0.1, 1.0))]
SHARED = [(p, u, v) for p in POSITIONS for u, v in numbers(NUMBERS)]


def spot_share(direction, angle=1.1, blend=0.6, stretch=(1.5, 0.7)):
    """Cycles' smoothstep over the cosine, in the frame of the stretched cone."""
    d = np.float64(direction)
    x, y, z = X @ d / stretch[0], Y @ d / stretch[1], AXIS @ d
    cos, edge = z / np.sqrt(x * x + y * y + z * z), np.cos(angle / 2)
    t = np.clip((cos - edge) / (blend * (1 - edge)), 0, 1)
    return t * t * (3 - 2 * t)


def slats(direction, spread=2.2):
    """What a grid of slats lets through, scaled to keep the power."""
    d, h = np.float64(direction), spread / 2
    cos = AXIS @ d
    tangent = np.sqrt(1 - cos * cos) / cos
    return max(np.tan(h) - tangent, 0) / (np.tan(h) - h) if cos > 0 else 0.0


# Arrays


def test_columns_that_kernels_need():
    arrays = lamp_arrays(LIGHTS)
    assert arrays.reach == pytest.approx(
        [np.sin(0.2), 0.3, 0.3, 0.3, 0.3, *[np.hypot(0.6, 1.1) / 2] * 3, np.hypot(2.6, 3.1) / 2], rel=1e-6
    )
    assert arrays.versine == pytest.approx([1 - np.cos(a / 2) for a in LIGHTS.angle], rel=1e-5, abs=1e-12)
    assert arrays.has_size.all() and arrays.illuminates.shape == (0, 0) and arrays.seen.shape == (len(RayKind), 9)
    assert area.areas_of(LIGHTS)[RECTANGLE:] == pytest.approx([0.66, np.pi / 4 * 0.66, 0.66, np.pi / 4 * 2.6 * 3.1])
    for k in (RECTANGLE, ELLIPSE, SPREAD, NARROW):
        assert area.area_of(ARRAYS, k) == pytest.approx(area.areas_of(LIGHTS)[k], rel=1e-6)
    hidden = replace(LIGHTS, met_by_rays=np.arange(9) % 2 == 0, seen_in_gloss=np.arange(9) == 3)
    assert lamp_arrays(hidden).has_size.tolist() == [k % 2 == 0 for k in range(9)]
    assert lamp_arrays(hidden).seen[RayKind.GLOSSY].tolist() == [k == 3 for k in range(9)]
    flat = replace(LIGHTS, size=LIGHTS.size * [1, 0], radius=0 * LIGHTS.radius, angle=0 * LIGHTS.angle)
    assert not lamps.has_size(flat).any()
    linked = replace(LIGHTS, illuminates=np.eye(9, 2, dtype=bool))
    for object_, lit in ((-1, True), (0, False), (1, True)):
        assert lamps.lights_object(lamp_arrays(linked), 1, object_) == lit
        assert lamps.lights_object(ARRAYS, 1, object_)


def test_columns_of_spreads():
    """tan h, tan h − h and sin² h; what is nearly parallel is a little wide, and π − 2e-3 is as good as none."""
    spreads = np.float32([0.0, 0.006, 0.012, 0.5, 3.0, np.pi - 1.9e-3, np.pi])
    columns = area.spread_columns(spreads)
    h = np.maximum(spreads[:5].astype(np.float64) / 2, 1e-3)
    assert columns["tan_spread"][:5] == pytest.approx(np.tan(h), rel=1e-6)
    assert columns["spread_gap"][3:5] == pytest.approx(np.tan(h[3:]) - h[3:], rel=1e-6)
    assert columns["spread_gap"][:3] == pytest.approx(h[:3] ** 3 / 3, rel=1e-4)
    assert columns["sin2_spread"][:5] == pytest.approx(np.sin(h) ** 2, rel=1e-6)
    for name, none in (("tan_spread", np.inf), ("spread_gap", 1), ("sin2_spread", 1)):
        assert columns[name][5:].tolist() == [none] * 2 and columns[name].dtype == np.float32


# Area lamps


def test_places_on_area_lamps():
    for u, v in numbers(NUMBERS):
        place = np.float64(area.place_on_area(ARRAYS, RECTANGLE, u, v)) - CENTRE
        assert (place @ X, place @ Y, place @ AXIS) == pytest.approx(((u - 0.5) * 0.6, (v - 0.5) * 1.1, 0), abs=1e-5)
        place = np.float64(area.place_on_area(ARRAYS, ELLIPSE, u, v)) - CENTRE
        r = np.sqrt(u) / 2
        expected = r * 0.6 * np.cos(2 * np.pi * v), r * 1.1 * np.sin(2 * np.pi * v), 0
        assert (place @ X, place @ Y, place @ AXIS) == pytest.approx(expected, abs=1e-5)
    for x, y in ((0.49, 0.49), (0.51, 0), (0, 0.51), (-0.51, 0.2), (0.34, 0.34), (0.36, -0.36), (-0.2, 0.4)):
        at = triple(CENTRE + x * 0.6 * X + y * 1.1 * Y)
        assert area.contains(ARRAYS, RECTANGLE, at) == (max(abs(x), abs(y)) <= 0.5)
        assert area.contains(ARRAYS, ELLIPSE, at) == (x * x + y * y <= 0.25)


@pytest.mark.parametrize("k", [RECTANGLE, ELLIPSE, SPREAD])
def test_points_of_area_lamps(k):
    """E = L A cos θ cos θ'/d² of points uniform by area."""
    for position, u, v in SHARED:
        target, way, share = area.sample_area(ARRAYS, k, position, u, v)
        assert target == area.place_on_area(ARRAYS, k, u, v)
        to = np.float64(target) - np.float64(position)
        d = np.linalg.norm(to)
        assert way == pytest.approx(to / d, abs=1e-5)
        cos = -to @ AXIS / d
        falloff = slats(-to / d) if k == SPREAD else 1
        assert share == pytest.approx(float(area.area_of(ARRAYS, k)) * cos / d**2 * falloff, rel=1e-4, abs=1e-6)


def test_points_of_narrow_lamps_lie_where_they_shine_from():
    """Of those of which a position sees a part alone: the disc of radius h tan(spread/2) around its foot."""
    tan, n_dark = np.tan(0.25), 0
    for position, u, v in SHARED:
        height = AXIS @ (np.float64(position) - CENTRE)
        target, _, share = area.sample_area(ARRAYS, NARROW, position, u, v)
        offset = np.float64(target) - (np.float64(position) - height * AXIS)
        radius = height * tan
        assert np.linalg.norm(offset) == pytest.approx(np.sqrt(u) * radius, rel=1e-3)
        assert (offset @ X, offset @ Y) == pytest.approx(
            np.sqrt(u) * radius * np.array([np.cos(2 * np.pi * v), np.sin(2 * np.pi * v)]), abs=1e-4
        )
        to = np.float64(target) - np.float64(position)
        d = np.linalg.norm(to)
        on = area.contains(ARRAYS, NARROW, target)
        n_dark += not on
        expected = np.pi * radius**2 * -(to @ AXIS) / d**3 * slats(-to / d, 0.5) * on
        assert share == pytest.approx(expected, rel=2e-3, abs=1e-6)
    assert n_dark < len(SHARED) / 2
    aside = triple(CENTRE + 0.2 * AXIS + 5 * X)
    assert area.sample_area(ARRAYS, NARROW, aside, f(0.3), f(0.4))[2] == 0


def test_a_small_lamp_that_is_narrow():
    """A disc of radius 0.3 around the foot is less than its area, if not by much."""
    arrays = lamp_arrays(lamp(LightKind.RECTANGLE, 1, size=(0.6, 1.1), spread=0.5, **PLACE))
    for height, disc in ((0.3 / np.tan(0.25), True), (0.5 / np.tan(0.25), False)):
        position, u, v = triple(CENTRE + height * AXIS), f(0.3), f(0.6)
        target, _, _ = area.sample_area(arrays, 0, position, u, v)
        assert (target == area.place_on_area(arrays, 0, u, v)) != disc
        if disc:
            assert np.linalg.norm(np.float64(target) - CENTRE) == pytest.approx(0.3 * np.sqrt(0.3), rel=1e-3)


def test_area_lamps_are_dark_behind():
    for k in (RECTANGLE, NARROW):
        behind = triple(CENTRE - 0.5 * AXIS)
        assert area.sample_area(ARRAYS, k, behind, f(0.3), f(0.4))[2] == 0
        assert not area.meet_area(ARRAYS, k, behind, triple(AXIS))[0]
        assert not area.meet_area(ARRAYS, k, triple(CENTRE + AXIS), triple(AXIS))[0]
        assert not area.meet_area(ARRAYS, k, behind, triple(-AXIS))[0]
    assert area.spread_falloff(ARRAYS, RECTANGLE, triple(X), f(0)) == 1
    assert area.spread_falloff(ARRAYS, SPREAD, triple(X), f(0)) == 0


@pytest.mark.parametrize("k", [RECTANGLE, ELLIPSE, SPREAD])
def test_rays_meet_area_lamps_where_points_lie(k):
    for position, u, v in SHARED:
        target, way, share = area.sample_area(ARRAYS, k, position, u, v)
        to = np.float64(target) - np.float64(position)
        d = np.linalg.norm(to)
        met, distance, seen, density = area.meet_area(ARRAYS, k, position, way)
        assert met and distance == pytest.approx(d, rel=1e-4)
        assert seen == pytest.approx(slats(-to / d) if k == SPREAD else 1, rel=1e-3, abs=1e-5)
        assert density == pytest.approx(d**3 / (float(area.area_of(ARRAYS, k)) * -(to @ AXIS)), rel=1e-3)
        assert share == pytest.approx(seen / density, rel=1e-3, abs=1e-6)
    off = np.float64(area.place_on_area(ARRAYS, k, f(0.99), f(0.25))) * 2 - CENTRE
    to = off - np.float64(POSITIONS[0])
    assert not area.meet_area(ARRAYS, k, POSITIONS[0], triple(to / np.linalg.norm(to)))[0]


# Points, balls and spots


@pytest.mark.parametrize("k", [POINT, SPOT])
def test_discs_face_who_looks(k):
    """L A cos θ'/d² with L = I/(πr²), and a spot's by its cone; rays to the point find it."""
    for position, u, v in SHARED:
        target, way, share = (point.sample_point if k == POINT else spot.sample_spot)(ARRAYS, k, position, u, v)
        offset, to = np.float64(target) - CENTRE, np.float64(target) - np.float64(position)
        axis = np.float64(position) - CENTRE
        away, d = np.linalg.norm(axis), np.linalg.norm(to)
        assert np.linalg.norm(offset) == pytest.approx(0.3 * np.sqrt(u), rel=1e-4)
        assert offset @ axis == pytest.approx(0, abs=1e-5) and way == pytest.approx(to / d, abs=1e-5)
        falloff = 1 if k == POINT else spot_share(-to / d)
        expected = -(to @ axis) / (d * away) / d**2
        assert share == pytest.approx(expected * falloff, rel=1e-3, abs=1e-6)
        met, distance, seen, density = (point.meet_point if k == POINT else spot.meet_spot)(ARRAYS, k, position, way)
        assert met and distance == pytest.approx(d, rel=1e-4)
        assert seen == pytest.approx(falloff / (np.pi * 0.09), rel=1e-3, abs=1e-5)
        assert density == pytest.approx(1 / (expected * np.pi * 0.09), rel=1e-3)


@pytest.mark.parametrize("k", [BALL, SPOT_BALL])
def test_balls_are_seen_as_caps(k):
    """Directions even in the cone of half angle arcsin(r/d), the radiance over its density; points on the near side."""
    for position, u, v in SHARED:
        target, way, share = (point.sample_point if k == BALL else spot.sample_spot)(ARRAYS, k, position, u, v)
        to, axis = np.float64(target) - np.float64(position), CENTRE - np.float64(position)
        away, d = np.linalg.norm(axis), np.linalg.norm(to)
        versine = 1 - np.sqrt(1 - (0.3 / away) ** 2)
        assert np.linalg.norm(np.float64(target) - CENTRE) == pytest.approx(0.3, rel=1e-3)
        assert 1 - to @ axis / (away * d) == pytest.approx(u * versine, rel=1e-2, abs=1e-5)
        assert d < away and way == pytest.approx(to / d, abs=1e-5)
        falloff = 1 if k == BALL else spot_share(-to / d, stretch=(1, 1))
        assert share == pytest.approx(2 * versine / 0.09 * falloff, rel=1e-3, abs=1e-6)
        met, distance, seen, density = (point.meet_point if k == BALL else spot.meet_spot)(ARRAYS, k, position, way)
        assert met and distance == pytest.approx(d, rel=1e-3)
        assert seen == pytest.approx(falloff / (np.pi * 0.09), rel=1e-3, abs=1e-5)
        assert density == pytest.approx(1 / (2 * np.pi * versine), rel=1e-3)


@pytest.mark.parametrize("k", [BALL, SPOT_BALL])
def test_from_inside_a_ball_its_far_side_is_seen(k):
    """All directions, without a spot's cone: 4/r² of the intensity over the density 1/4π."""
    inside = triple(CENTRE + np.array([0.1, -0.05, 0.12]))
    for u, v in numbers(NUMBERS):
        target, way, share, outside = point.sample_ball(ARRAYS, k, inside, u, v)
        assert not outside and share == pytest.approx(4 / 0.09, rel=1e-5)
        assert np.linalg.norm(np.float64(target) - CENTRE) == pytest.approx(0.3, rel=1e-4)
        to = np.float64(target) - np.float64(inside)
        assert to / np.linalg.norm(to) == pytest.approx(way, abs=1e-4)
        if k == SPOT_BALL:
            assert spot.sample_spot(ARRAYS, k, inside, u, v)[2] == share
        met, distance, seen, density = (point.meet_point if k == BALL else spot.meet_spot)(ARRAYS, k, inside, way)
        assert met and distance == pytest.approx(np.linalg.norm(to), rel=1e-4)
        assert seen == pytest.approx(1 / (np.pi * 0.09), rel=1e-5) and density == pytest.approx(1 / (4 * np.pi))


@pytest.mark.parametrize("k", [POINT, BALL])
def test_rays_beside_and_away_from_lamps_miss(k):
    position = np.float64(POSITIONS[0])
    to = CENTRE - position
    away = np.linalg.norm(to)
    aside = np.cross(to, [1, 0, 0]) / np.linalg.norm(np.cross(to, [1, 0, 0]))
    for offset, hits in ((0.28, True), (0.31, False)):
        way = to + aside * offset * (1 if k == POINT else 1 / np.sqrt(1 - (0.3 / away) ** 2))
        way /= np.linalg.norm(way)
        assert point.meet_point(ARRAYS, k, POSITIONS[0], triple(way))[0] == hits
        assert not point.meet_point(ARRAYS, k, POSITIONS[0], triple(-way))[0]


def test_a_ball_without_a_radius_is_a_point():
    small = lamp_arrays(lamp(LightKind.POINT, 2, sphere=True, position=CENTRE))
    target, way, share, outside = point.sample_ball(small, 0, POSITIONS[0], f(0.3), f(0.6))
    d2 = ((CENTRE - np.float64(POSITIONS[0])) ** 2).sum()
    assert outside and target == pytest.approx(CENTRE) and share == pytest.approx(1 / d2, rel=1e-5)
    assert not point.meet_ball(small, 0, POSITIONS[0], way)[0]


def test_falloff_of_spots():
    random = np.random.default_rng(2)
    for _ in range(40):
        d = AXIS + random.normal(size=3) * 0.5
        d /= np.linalg.norm(d)
        assert spot.spot_falloff(ARRAYS, SPOT, triple(d)) == pytest.approx(spot_share(d), abs=2e-5)
    assert spot.spot_falloff(ARRAYS, SPOT, triple(AXIS)) == 1 and spot.spot_falloff(ARRAYS, SPOT, triple(-AXIS)) == 0
    hard = lamp_arrays(lamp(LightKind.SPOT, 1, angle=1.1, blend=0, **PLACE))
    for angle, expected in ((0.549, 1), (0.551, 0)):
        d = np.cos(angle) * AXIS + np.sin(angle) * X
        assert spot.spot_falloff(hard, 0, triple(d)) == expected
    local = triple((0.2, 0.5, -0.3))
    expected = 0.2 * X + 0.5 * Y - 0.3 * AXIS
    assert spot.of_frame(ARRAYS, SPOT, local) == pytest.approx(expected, abs=1e-6)


# Suns


def test_suns():
    """E = πL sin²(α/2): radiance, and beams of E 2/(1 + cos(α/2)) over directions even in the disc."""
    versine = 1 - np.cos(0.2)
    for u, v in numbers(NUMBERS):
        target, way, share = sun.sample_sun(ARRAYS, SUN, POSITIONS[1], u, v, f(50))
        assert 1 + np.float64(way) @ AXIS == pytest.approx(u * versine, rel=1e-2, abs=1e-6)
        assert target == pytest.approx(np.float64(POSITIONS[1]) + 50 * np.float64(way), abs=1e-4)
        assert share == pytest.approx(2 / (1 + np.cos(0.2)), rel=1e-6)
        met, distance, seen, density = sun.meet_sun(ARRAYS, SUN, way)
        assert met and distance == np.finfo(np.float32).max
        assert seen == pytest.approx(1 / (np.pi * np.sin(0.2) ** 2), rel=1e-5)
        assert density == pytest.approx(1 / (2 * np.pi * versine), rel=1e-5)
    for angle, hits in ((0.199, True), (0.201, False)):
        way = -np.cos(angle) * AXIS + np.sin(angle) * Y
        assert sun.meet_sun(ARRAYS, SUN, triple(way))[0] == hits and not sun.meet_sun(ARRAYS, SUN, triple(-way))[0]


# Any lamp


@pytest.mark.parametrize("k", range(len(LIGHTS)))
def test_any_lamp_by_its_own_file(k):
    """Its emission times its share and the cosine at the surface; along rays its emission times its share."""
    normal = unit(0.1, 0.2, 0.9)
    emission = LIGHTS.emission[k].astype(np.float64)
    files = {LightKind.POINT: point.sample_point, LightKind.SPOT: spot.sample_spot}
    meets = {LightKind.POINT: point.meet_point, LightKind.SPOT: spot.meet_spot}
    kind = LightKind(LIGHTS.kind[k])
    for position in POSITIONS[:2]:
        u, v = f(0.3), f(0.6)
        if kind == LightKind.SUN:
            target, way, share = sun.sample_sun(ARRAYS, k, position, u, v, f(30))
            met, distance, seen, density = sun.meet_sun(ARRAYS, k, way)
        else:
            target, way, share = files.get(kind, area.sample_area)(ARRAYS, k, position, u, v)
            met, distance, seen, density = meets.get(kind, area.meet_area)(ARRAYS, k, position, way)
        at, light = lamps.sample_lamp(ARRAYS, k, position, normal, u, v, f(30))
        assert at == target and light == pytest.approx(emission * share * np.dot(way, normal), rel=1e-4)
        found = lamps.meet_lamp(ARRAYS, k, position, way)
        if met:
            assert found[0] == distance and found[2] == density and found[1] == pytest.approx(emission * seen, rel=1e-5)
        else:
            assert found == (np.inf, (0, 0, 0), np.inf)
        _, dark = lamps.sample_lamp(ARRAYS, k, position, triple(-np.array(normal)), u, v, f(30))
        assert dark == (0, 0, 0)
        assert lamps.meet_lamp(ARRAYS, k, position, triple(-np.array(way))) == (np.inf, (0, 0, 0), np.inf)


def test_lamps_below_the_horizon():
    """As far as they reach over it."""
    normal = triple(-AXIS)
    for k, reach in ((POINT, 0.3), (RECTANGLE, np.hypot(0.6, 1.1) / 2)):
        for height, below in ((-reach - 0.01, True), (-reach + 0.01, False)):
            position = triple(CENTRE + height * AXIS)
            assert lamps._below_horizon(ARRAYS, k, position, normal) == below
    for angle, below in ((0.19, False), (0.21, True)):
        tilted = np.cos(angle) * X + np.sin(angle) * AXIS
        assert lamps._below_horizon(ARRAYS, SUN, POSITIONS[0], triple(tilted)) == below


def test_lamps_along_a_ray():
    """The sum of those that are met before a surface, that the ray sees, and that light its object."""
    position = POSITIONS[0]
    to = CENTRE - np.float64(position)
    way = triple(to / np.linalg.norm(to))
    infinite, diffuse = f(np.inf), int(RayKind.DIFFUSE)

    def seen(arrays, far=infinite, kind=diffuse, object_=0, least=infinite):
        return np.float64(lamps.radiance_of_lamps(arrays, position, way, far, kind, object_, least))

    each = [lamps.meet_lamp(ARRAYS, k, position, way) for k in range(9)]
    whole = sum(np.float64(light) for _, light, _ in each)
    assert seen(ARRAYS) == pytest.approx(whole, rel=1e-5)
    assert seen(ARRAYS, f(2.0)) == pytest.approx(sum(np.float64(x) for d, x, _ in each if d < 2), rel=1e-5)
    least = sorted(d for *_, d in each)[3]
    assert seen(ARRAYS, least=least) == pytest.approx(sum(np.float64(x) for *_, x, d in each if d < least), rel=1e-5)
    hidden = lamp_arrays(replace(LIGHTS, seen_in_gloss=np.arange(9) == RECTANGLE))
    assert seen(hidden, kind=int(RayKind.GLOSSY)) == pytest.approx(each[RECTANGLE][1], rel=1e-5)
    linked = lamp_arrays(replace(LIGHTS, illuminates=np.eye(9, dtype=bool)))
    assert seen(linked, object_=BALL) == pytest.approx(each[BALL][1], rel=1e-5)
    unmet = lamp_arrays(replace(LIGHTS, met_by_rays=np.arange(9) == ELLIPSE))
    assert seen(unmet) == pytest.approx(each[ELLIPSE][1], rel=1e-5)
