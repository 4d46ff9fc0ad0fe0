"""Single photons where they meet surfaces: scattered, stored, left alone; closed forms as plain Python."""

from dataclasses import fields, replace

import numpy as np
import pytest
from photon_bake.addon.bsdf.mixture import ALL_LOBES
from photon_bake.addon.core.sampling.octahedral import octahedral_code
from photon_bake.addon.core.sampling.path_numbers import path_key, two_numbers
from photon_bake.addon.emitters import Sphere
from photon_bake.addon.photons import Photons, viewers
from photon_bake.addon.photons import region_directed as directed_parts
from photon_bake.addon.photons import store as store_parts
from photon_bake.addon.photons.front import Photon, new_front, photon_at, put_photon
from photon_bake.addon.photons.photons import PathKind
from photon_bake.addon.photons.region_directed import directed, is_directed, target_region
from photon_bake.addon.photons.store import PhotonStore
from photon_bake.addon.scene import Lobe, Materials, RayKind
from photon_bake.addon.scene.hit import hit_at
from photon_bake.tests.core.bsdf_points import closures
from photon_bake.tests.core.scenes import plane, scene_of
from photon_bake.tests.core.values.lobe_formulas import f, triple, unit
from photon_bake.tests.core.values.mixed_closures import THROUGH, WHITE_FLOOR

INTO = unit(0.4, -0.3, -0.7)
REGION = Sphere(np.float32([2.0, 1, 8]), 0.5)
DIFFUSE, GLOSSY, TRANSMITTED, SHADOW = (
    int(k) for k in (RayKind.DIFFUSE, RayKind.GLOSSY, RayKind.TRANSMITTED, RayKind.SHADOW)
)


def photon(**values):
    given = {"origin": triple((0, 0, 1)), "direction": INTO, "power": triple((0.5, 0.4, 0.3)), "path_density": f(0.7)}
    given |= {"gained": f(1), "specular": True, "came_from": -1, "path": 5, "source": 0, "kind": np.uint8(DIFFUSE)}
    return Photon(**given | values)


# In flight and stored


def test_a_front_keeps_what_is_put_into_it():
    front = new_front(4)
    fresh = photon_at(front, 1)
    assert (fresh.path_density, fresh.gained, fresh.specular, fresh.came_from, fresh.kind) == (1, 1, False, -1, DIFFUSE)
    one, other = photon(came_from=3, source=2, kind=np.uint8(GLOSSY), gained=f(1.5)), photon(path=9, specular=False)
    put_photon(front, 2, one)
    put_photon(front, 0, other)
    assert photon_at(front, 2) == one and photon_at(front, 0) == other


STORED = [(False, 0, "DIRECT"), (False, 3, "INDIRECT"), (True, 0, "CAUSTIC"), (True, 300, "CAUSTIC")]


@pytest.mark.parametrize(("specular", "bounce", "kind"), STORED)
def test_a_stored_photon(specular, bounce, kind):
    scene = scene_of(*plane()).arrays
    hit = hit_at(scene, INTO, np.int32(1), f(2), f(0.2), f(0.3))
    rows = PhotonStore().rows(3)
    store_parts.store(rows, 1, hit, photon(specular=specular), bounce)
    photons = Photons(*rows).where(slice(1, 2))
    assert photons.position[0] == pytest.approx(hit.position) and photons.power[0] == pytest.approx((0.5, 0.4, 0.3))
    assert photons.direction[0] == pytest.approx(INTO, abs=1e-4) and photons.normal[0] == pytest.approx((0, 0, 1))
    assert tuple(photons.packed_direction[0]) == octahedral_code(INTO)
    assert (photons.triangle[0], photons.path[0], photons.kind[0]) == (1, 5, PathKind[kind])
    assert photons.path_density[0] == f(0.7) and photons.bounce[0] == min(bounce, 255)
    assert photons.bytes_per_photon == 46 and Photons.none().bytes_per_photon == 0


def test_photons_are_chosen_and_joined():
    none = Photons.none()
    store = PhotonStore()
    rows = store.rows(3)
    for column in rows:
        column[:] = (np.arange(3)).reshape(-1, *[1] * (column.ndim - 1))
    store.n = 3
    photons = store.photons()
    for chosen in (np.array([True, False, True]), np.array([0, 2]), slice(0, 3, 2)):
        assert photons.where(chosen).path.tolist() == [0, 2] == photons.where(chosen).power[:, 1].tolist()
    joined = Photons.join([photons, none, photons.where(slice(1))])
    assert len(joined) == 4 and len(none) == 0
    for field in fields(Photons):
        column = getattr(joined, field.name)
        assert column.reshape(4, -1)[:, 0].tolist() == [0, 1, 2, 0]
        assert column.dtype == getattr(none, field.name).dtype
        assert column.shape[1:] == getattr(none, field.name).shape[1:]


def test_room_for_photons_grows_as_they_come():
    store = PhotonStore()
    assert len(store.rows(5).path) == 5
    store.n = 5
    store.rows(1).path[:5] = range(5)
    assert len(store.rows(1).path) == 10 and len(store.rows(20).path) == 25
    assert store.photons().path.tolist() == [0, 1, 2, 3, 4]
    other = PhotonStore()
    other.add(store.photons(), 0.25)
    assert len(other.rows(0).path) == 22 and other.n == 5  # 5/0.25 and a tenth
    other.add(store.photons(), 0.5)
    assert other.photons().path.tolist() == [*range(5), *range(5)] and len(other.rows(0).path) == 22


# The region


def test_where_photons_are_directed_to_a_region():
    region = target_region(REGION)
    assert region.centre == pytest.approx(REGION.centre) and region.radius == 0.5
    assert target_region(None) == ((0, 0, 0), 0)
    for height, gained, goes in ((1.01, 1, True), (0.99, 1, False), (3, 1.99, True), (3, 2, False)):
        place = triple(REGION.centre + np.float32([0, 0, -height]))
        assert is_directed(region, f(gained), place) == goes
    assert not is_directed(target_region(None), f(1), triple((9, 9, 9)))


@pytest.mark.parametrize("choice", [0.2, 0.8])
def test_directed_photons_carry_the_cosine_over_the_mixture(choice):
    region, position, up = target_region(REGION), triple((0.1, 0.2, 0)), triple((0, 0, 1))
    way = REGION.centre - np.float64(position)
    d = np.linalg.norm(way)
    versine = 1 - np.sqrt(1 - (0.5 / d) ** 2)
    for onward in (unit(0.3, 0.2, 0.7), triple(way / d), unit(0.3, 0.2, -0.7)):
        for u, v in ((0.3, 0.6), (0.9, 0.1)):
            to, ratio = directed(region, position, up, onward, f(choice), f(u), f(v))
            there = 1 - np.float64(to) @ way / d
            if choice < 0.5:
                assert there == pytest.approx(u * versine, rel=1e-2, abs=1e-6)
            else:
                assert to == onward
            by_cosine = max(to[2], 0) / np.pi
            by_cone = (there <= versine) / (2 * np.pi * versine)
            assert ratio == pytest.approx(by_cosine / (by_cosine / 2 + by_cone / 2) if by_cosine else 0, rel=1e-3)
    assert directed_parts.MOST_GAIN == 2 == 1 / directed_parts.SHARE


# Who sees them


def views(shadow=False, lobe=False, sampled=1):
    """Viewers of two materials, where shadow rays see the second for the first, or glossy rays do."""
    seen_as = np.tile(np.int32([[0], [1]]), (1, 12))
    if shadow:
        seen_as[0, 2 * SHADOW : 2 * SHADOW + 2] = 1
    if lobe:
        seen_as[0, 2 * GLOSSY : 2 * GLOSSY + 2] = 1
    of = replace(closures(WHITE_FLOOR, THROUGH), start=np.int32([0, 1, 2]))
    return viewers.viewers_of(Materials.of(2, closures=of, seen_as=seen_as))


def test_lobes_by_the_rays_that_they_send():
    for by in (views(), views(shadow=True)):
        assert by.lobes.tolist() == [ALL_LOBES] * len(RayKind) and not by.by_lobe
    assert not views().in_shadow and views(shadow=True).in_shadow and views(lobe=True).in_shadow
    by = views(lobe=True)
    gloss, through = 1 << Lobe.GLOSSY | 1 << Lobe.GLOSSY_TOON, 1 << Lobe.GLASS | 1 << Lobe.PANE | 1 << Lobe.FIBRE
    assert by.by_lobe and by.lobes[GLOSSY] == gloss and by.lobes[TRANSMITTED] == through
    assert by.lobes[DIFFUSE] == ALL_LOBES - gloss - through and by.lobes[SHADOW] == ALL_LOBES
    for kind, reflects in ((DIFFUSE, True), (GLOSSY, False), (TRANSMITTED, False), (SHADOW, True)):
        assert viewers.reflects_to(by, kind) == reflects
    kinds = np.array([DIFFUSE, GLOSSY, TRANSMITTED])
    assert viewers.which_reflect_to(by, kinds).tolist() == [True, False, False]


def test_the_next_viewer_and_its_chance():
    plain, by = views(), views(lobe=True)
    assert viewers.next_viewer(plain, TRANSMITTED, f(0.99)) == (DIFFUSE, 1)
    for kind, choice, expected, chance in (
        (DIFFUSE, 0.79, DIFFUSE, 0.8),
        (DIFFUSE, 0.81, GLOSSY, 0.1),
        (DIFFUSE, 0.91, TRANSMITTED, 0.1),
        (TRANSMITTED, 0.49, DIFFUSE, 0.5),
        (TRANSMITTED, 0.51, GLOSSY, 0.1),
        (TRANSMITTED, 0.61, TRANSMITTED, 0.4),
    ):
        assert viewers.next_viewer(by, kind, f(choice)) == (expected, pytest.approx(chance, abs=1e-6))
    shadow = views(shadow=True)
    for of, sampled, choice, expected, chance in (
        (by, False, 0.85, GLOSSY, 0.1),
        (shadow, True, 0.49, SHADOW, 0.5),
        (shadow, True, 0.51, TRANSMITTED, 0.5),
        (by, True, 0.49, SHADOW, 0.5),
        (by, True, 0.74, GLOSSY, 0.25),
        (by, True, 0.76, TRANSMITTED, 0.25),
    ):
        assert viewers._first_viewer(of, sampled, f(choice)) == (expected, pytest.approx(chance, abs=1e-6))


def test_photons_choose_their_first_viewer():
    """By the pair of numbers 2¹⁵ of their path, the power over the chance."""
    by, key, front = views(lobe=True), path_key(3, 2), new_front(3)
    front.power[:], front.path[:], front.source[:] = 2, [7, 8, 9], [0, 1, 0]
    viewers.choose_first_viewers(by, key, np.array([True, False]), front, 2)
    for k in range(2):
        choice, _ = two_numbers(key, front.path[k], 1 << 15)
        kind, chance = viewers._first_viewer(by, k == 0, choice)
        assert front.kind[k] == kind and front.power[k] == pytest.approx(np.full(3, 2 / chance))
    assert front.kind[2] == DIFFUSE and (front.power[2] == 2).all()
    for shadow, kind, specular, is_way in (
        (False, SHADOW, True, True),
        (True, SHADOW, True, False),
        (True, SHADOW, False, True),
        (True, GLOSSY, True, True),
        (True, GLOSSY, False, False),
    ):
        assert viewers.is_way_of_lamplight(views(shadow=shadow), kind, specular) == is_way
