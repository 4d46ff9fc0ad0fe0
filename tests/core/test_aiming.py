"""Photons aimed at what makes caustics carry what all would, and find it far more often."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import Sphere, light_sources, region_of
from photon_bake.addon.emitters.aiming.caustic_makers import caustic_makers
from photon_bake.addon.emitters.aiming.projection_map import ProjectionMap
from photon_bake.addon.photons import PathKind, trace_photons
from photon_bake.addon.scene import Channel, LightKind, Materials, World
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import ball, box, lamp, merge, of_objects, plane, scene_of
from photon_bake.tests.core.test_emission import N, emitted, power_on_plane, source_of

WHITE, NONE = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
LARGEST = 0.8  # m
AIM = ProjectionMap(np.float32([[0.3, 0.2, 0], [-0.5, 0, 0.1]]), np.float32([0.2, 0.1]))
IMAGE = np.random.default_rng(1).uniform(0, 1, (8, 16, 3)).astype(np.float32) ** 4

SOURCES = {
    "point": {"lights": lamp(LightKind.POINT, 2.0, position=(0, 0.3, 1))},
    "point within a ball": {"lights": lamp(LightKind.POINT, 2.0, position=(0.3, 0.2, 0.1))},
    "sphere": {"lights": lamp(LightKind.POINT, 2.0, position=(0, 0, 1), radius=0.3, sphere=True)},
    "spot": {"lights": lamp(LightKind.SPOT, 2.0, position=(0, 0, 1), angle=1.2, blend=0.3)},
    "stretched spot": {
        "lights": lamp(LightKind.SPOT, 2.0, position=(0, 0, 1), angle=1.2, blend=0.5, stretch=(1.6, 0.5))
    },
    "far spot": {"lights": lamp(LightKind.SPOT, 4e4, position=(60, -80, 20), direction=(-60, 80, -20), angle=1.0)},
    "area": {"lights": lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 0.5))},
    "spread": {"lights": lamp(LightKind.ELLIPSE, 2.0, position=(0, 0, 1), size=(1, 0.5), spread=0.6)},
    "far area": {"lights": lamp(LightKind.RECTANGLE, 4e4, position=(0, 60, 80), direction=(0, -3, -4), size=(2, 1))},
    "sun": {"lights": lamp(LightKind.SUN, 4.0, direction=(0.3, 0, -1), angle=0.02)},
    "mesh": {
        "mesh": merge(plane(0.3, z=1.0), plane(2.0, z=-1.0)),
        "albedo": [0, 0],
        "emission": [3.0, 0],
        "material": [0, 0, 1, 1],
    },
    "world": {"world": World(np.array([2, 1, 1], np.float32), IMAGE)},
}


def aimed_and_not(name):
    """Rays of a source whose photons are aimed, and of one whose are not."""
    columns = dict(SOURCES[name])
    world = columns.pop("world", None)
    sources = []
    for aim in (AIM, None):
        if world is None:
            source = source_of(**columns)
        else:
            scene = replace(scene_of(*plane(2.0)), world=world)
            (source,) = light_sources(scene, region_of(scene.vertices))
        if aim:
            source.aim_at(aim)
        sources.append(emitted(source, 4 * N))
    return sources


@pytest.mark.parametrize("name", SOURCES)
def test_aimed_photons_bring_the_light_that_others_would(name):
    """In all, on a square through a ball, and on one beside it."""
    aimed, plain = aimed_and_not(name)
    assert aimed.flux.mean(axis=0) == pytest.approx(plain.flux.mean(axis=0), rel=0.02)
    for half in (0.4, 1.0):
        assert power_on_plane(aimed, half) == pytest.approx(power_on_plane(plain, half), rel=0.025)
    ahead = [through_ball(rays) for rays in (aimed, plain)]
    power = [rays.flux.mean(axis=1) @ hit / len(hit) for rays, hit in zip((aimed, plain), ahead, strict=True)]
    assert power[0] == pytest.approx(power[1], rel=0.04)
    assert (ahead[0] & (aimed.flux[:, 0] > 0)).mean() > 0.03


def through_ball(rays):
    """Which rays pass the first ball ahead of them."""
    away = AIM.centre[0] - rays.origins
    along = np.einsum("ij,ij->i", away, rays.directions)
    return (along > 0) & (np.einsum("ij,ij->i", away, away) - along**2 < AIM.radius[0] ** 2)


def room_with_glass(lights, radius=0.05, half=5.0):
    """A matte room, 10 m wide, and a small ball of glass in it, one object each."""
    glass = ball(radius, (1.0, 0.5, -2.0))
    mesh = merge(box(half), glass) if lights.kind[0] != LightKind.SUN else merge(plane(half, -half), glass)
    n_wall = len(mesh[1]) - len(glass[1])
    material = np.arange(len(mesh[1])) >= n_wall
    scene = of_objects(scene_of(*mesh, albedo=[0.5, 0.0], lights=lights, material=material), material)
    made_of = Materials.of(
        2,
        diffuse=Channel.constant(np.array([[0.5] * 3, NONE], np.float32)),
        glass_reflection=Channel.constant(np.array([NONE, WHITE], np.float32)),
        glass_transmission=Channel.constant(np.array([NONE, WHITE], np.float32)),
        roughness=Channel.constant(np.array([[1] * 3, NONE], np.float32)),
    )
    return replace(scene, materials=made_of)


@pytest.mark.parametrize(
    "lights",
    [
        lamp(LightKind.POINT, 10.0, position=(0, 0, 3)),
        lamp(LightKind.SUN, 3.0, direction=(0.2, 0.1, -1), angle=0.01),
        lamp(LightKind.RECTANGLE, 10.0, position=(0, 0, 3), size=(1, 1)),
    ],
    ids=["point", "sun", "area"],
)
def test_small_glass_in_a_large_room(lights):
    """What passes it is the same, told by very many more photons."""
    scene = room_with_glass(lights)
    tracer, region = TransparencyTracer(scene, EmbreeTracer(scene)), Sphere(np.zeros(3, np.float32), 5.0)
    found = []
    for aim in (True, False):
        sources = light_sources(scene, region)
        assert sources[0].aim is not None
        sources[0].aim = sources[0].aim if aim else None
        n = 50_000 if aim else 1_000_000
        photons = trace_photons(scene, tracer, sources, n, 8, Workers(3))
        found.append(photons.where(photons.kind == PathKind.CAUSTIC))
    aimed, plain = found
    noise = np.sqrt((plain.power[:, 0].astype(float) ** 2).sum())
    assert aimed.power[:, 0].sum() == pytest.approx(plain.power[:, 0].sum(), abs=4 * noise)
    relative = [np.sqrt((f.power[:, 0] ** 2).sum()) / f.power[:, 0].sum() for f in found]
    assert relative[0] < 0.02 and relative[0] ** 2 * 50_000 < 0.05 * relative[1] ** 2 * 1_000_000


def test_only_small_glass_and_smooth_metal_are_aimed_at():
    scene = room_with_glass(lamp(LightKind.POINT, 10.0, position=(0, 0, 3)))
    aim = caustic_makers(scene, LARGEST)
    assert aim.centre == pytest.approx(np.float32([[1.0, 0.5, -2.0]]), abs=1e-3)
    assert aim.radius == pytest.approx([0.05], rel=0.01)
    matte = scene_of(*box())
    assert caustic_makers(matte, LARGEST) is None

    def metal(f0, roughness):
        columns = {"f0": f0, "f90": 1.0, "roughness": roughness}
        pairs = {
            name: Channel.constant(np.array([[1.0 if name == "roughness" else 0.0] * 3, [value] * 3], np.float32))
            for name, value in columns.items()
        }
        return replace(scene, materials=Materials.of(2, **pairs))

    assert caustic_makers(metal(0.9, 0.2), LARGEST) is not None
    assert caustic_makers(metal(0.9, 0.7), LARGEST) is None  # too rough
    assert caustic_makers(metal(0.04, 0.1), LARGEST) is None  # a varnish
    large = room_with_glass(lamp(LightKind.POINT, 10.0, position=(0, 0, 3)), radius=4.9)
    assert caustic_makers(large, LARGEST) is None


def test_very_many_objects_are_aimed_at_in_groups():
    """A thousand small panes: 32 balls that hold all of their corners."""
    random = np.random.default_rng(0)
    panes = merge(box(5.0), *(ball(0.02, centre, 2) for centre in random.uniform(-4, 4, (300, 3))))
    scene = scene_of(*panes, albedo=[0.5, 0.0], material=np.arange(len(panes[1])) >= 12)
    glass = Channel.constant(np.array([NONE, WHITE], np.float32))
    scene = replace(scene, materials=Materials.of(2, glass_transmission=glass))
    aim = caustic_makers(scene, LARGEST)
    assert len(aim.radius) == 32 and aim.radius.max() < 5
    corners = scene.vertices[8:]
    away = np.linalg.norm(corners[:, None] - aim.centre, axis=2)
    assert (away <= aim.radius).any(axis=1).all()
