"""Whole bakes against the balance of power: what lamps emit ends in the diffuse walls, whatever it passed on its way.

In a closed room of lossless surfaces and diffuse walls of albedo ρ a lamp of Φ watts makes Φ = (1−ρ) ∫E dA on those
walls, with E the direct and indirect light together.
"""

import numpy as np
import pytest
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.scene import N_VIEWS, Channel, Closures, LightKind, Lobe, Materials, RayKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, grid_on_walls, lamp, merge, plane, receivers_at, scene_of

POWER, RHO = 24.0, 0.5
WHITE = np.ones(3, np.float32)


def materials(**lobes):
    """Material 0 is the matte wall, material 1 has `lobes`."""
    columns = {}
    for name, value in lobes.items():
        if name in ("fresnel_ior", "layer_f0", "glass_ior"):
            columns[name] = np.array([1.5 if name == "glass_ior" else 0, value], np.float32)
        else:
            other = 1 if name in ("coverage", "tint", "roughness") else 0
            columns[name] = Channel.constant(np.array([[other] * 3, np.broadcast_to(value, 3)], np.float32))
    matte = np.array([[RHO] * 3, [0] * 3], np.float32)
    if "diffuse" in columns:
        matte[1] = columns.pop("diffuse").value[1]
    return Materials.of(2, diffuse=Channel.constant(matte), **columns)


def room(material_of_triangle, made_of, mesh=None, **more):
    """Mean total irradiance on the walls of a box; `mesh` stands in it."""
    inside = box() if mesh is None else merge(box(), mesh)
    light = lamp(LightKind.POINT, POWER / (4 * np.pi), position=(0.1, 0.2, 0.3))
    scene = scene_of(*inside, albedo=[RHO, RHO], material=material_of_triangle, lights=light)
    object.__setattr__(scene, "materials", made_of)
    at = grid_on_walls()
    diffuse = wall_of(at) if mesh is None else np.zeros(len(at), bool)
    at = receivers_at(at.position[~diffuse], at.normal[~diffuse])
    given = {"n_photons": 200_000, "n_cache_elements": 5_000, "add_direct": True, "max_bounces": 400}
    settings = settings_for("draft", **given, **more)
    return bake(scene, at, settings, EmbreeTracer(scene))


# The box's walls at x = ±1 are triangles 0, 1, 6 and 7
MIRRORED = [1, 1, 0, 0, 0, 0] * 2


def wall_of(at):
    return np.abs(at.normal[:, 0]) > 0.5


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.3, 0.6])
def test_lossless_metal_walls(roughness):
    result = room(MIRRORED, materials(f0=WHITE, f90=WHITE, roughness=roughness))
    assert result.value.mean() == pytest.approx(POWER / (16 * (1 - RHO)), rel=0.02)


def test_lossless_walls_of_two_metals():
    """A mirror and dull metal in one material: each is followed as it is, and together they lose nothing."""
    channels = {
        "weight": Channel.constant(np.float32([RHO, 0.4, 0.6])),
        "roughness": Channel.constant(np.float32([1, 0.05, 0.6])),
    }
    closures = Closures.of(np.array([0, 1, 3]), np.array([Lobe.DIFFUSE, Lobe.GLOSSY, Lobe.GLOSSY]), **channels)
    result = room(MIRRORED, Materials.of(2, closures=closures))
    assert result.value.mean() == pytest.approx(POWER / (16 * (1 - RHO)), rel=0.02)


def test_lossless_rough_walls():
    """White rough diffuse walls: shadow rays and the light that comes from elsewhere add up to all."""
    closures = Closures.of(
        np.array([0, 1, 2]),
        np.array([Lobe.DIFFUSE, Lobe.ROUGH_DIFFUSE]),
        weight=Channel.constant(np.float32([RHO, 1])),
        f0=Channel.constant(np.ones(2)),
        roughness=Channel.constant(np.float32([1, 0.8])),
    )
    result = room(MIRRORED, Materials.of(2, closures=closures))
    assert result.value.mean() == pytest.approx(POWER / (16 * (1 - RHO)), rel=0.02)


@pytest.mark.parametrize("roughness", [0.0, 0.3])
def test_lossless_glass_block(roughness):
    block = box(0.3, inwards=False)
    glass = materials(glass_reflection=WHITE, glass_transmission=WHITE, glass_ior=1.5, roughness=roughness)
    result = room([0] * 12 + [1] * 12, glass, (block[0] - [0.4, 0.4, 0.4], block[1]))
    assert result.value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.03 if roughness else 0.02)


def test_lossless_translucent_screen():
    result = room([0] * 12 + [1] * 2, materials(translucent=0.6 * WHITE, diffuse=0.4 * WHITE), plane(0.9))
    assert result.value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.02)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_see_through_screen(share):
    """Half a screen's light goes straight through, the rest is scattered by a lossless surface."""
    result = room([0] * 12 + [1] * 2, materials(diffuse=WHITE, coverage=share), plane(0.9))
    assert result.value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.02)


@pytest.mark.parametrize("hidden, share", [(RayKind.SHADOW, 1), (RayKind.DIFFUSE, 0)])
def test_white_box_that_some_rays_do_not_see(hidden, share):
    """Lossless, it takes none of a lamp's light that passes it, and none gets out that only the box would scatter."""
    made_of = Materials.of(
        3,
        diffuse=Channel.constant(np.float32([RHO, 1, 0])),
        coverage=Channel.constant(np.float32([1, 1, 0])),
        seen_as=np.repeat(np.arange(3, dtype=np.int32)[:, None], N_VIEWS, axis=1),
    )
    made_of.seen_as[1, 2 * hidden : 2 * hidden + 2] = 2
    result = room([0] * 12 + [1] * 12, made_of, box(0.5, inwards=False))
    assert result.value.mean() == pytest.approx(share * POWER / (24 * (1 - RHO)), rel=0.02)


def test_black_box_that_only_gloss_shows():
    """Where nothing is glossy it is not there."""
    made_of = Materials.of(
        3, diffuse=Channel.constant(np.float32([RHO, 0, 0])), coverage=Channel.constant(np.float32([1, 0, 1]))
    )
    made_of.seen_as[1, 2 * RayKind.GLOSSY : 2 * RayKind.GLOSSY + 2] = 2
    result = room([0] * 12 + [1] * 12, made_of, box(0.5, inwards=False))
    assert result.value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.02)


def test_walls_of_another_albedo_to_gather_rays():
    """E = E₀ + ρ₁ E₀ / (1 − ρ): light leaves the last wall before a receiver by the albedo that gather rays see."""
    first = 0.9
    made_of = Materials.of(
        3, diffuse=Channel.constant(np.float32([RHO, 0, first])), coverage=Channel.constant(np.float32([1, 0, 1]))
    )
    made_of.seen_as[0, 2 * RayKind.GATHER : 2 * RayKind.GATHER + 2] = 2
    result = room([0] * 12 + [1] * 2, made_of, plane(0.9))
    assert result.value.mean() == pytest.approx(POWER / 24 * (1 + first / (1 - RHO)), rel=0.02)


def test_layered_walls_lose_nothing_between_the_layers():
    """White walls under a dielectric layer reflect all: with the layer's albedo E(cos) and the base's 1 − E(cos)."""
    f0 = np.float32(0.04)
    lossless = materials(diffuse=WHITE, f0=f0, f90=WHITE, fresnel_ior=1.5, layer_f0=f0, roughness=0.5)
    result = room(MIRRORED, lossless)
    assert result.value.mean() == pytest.approx(POWER / (16 * (1 - RHO)), rel=0.02)


@pytest.mark.parametrize("gather", ["final", "density"])
def test_what_lets_all_light_through_covers_no_wall(gather):
    """A box close before the walls, as that around fog may be: closer than photons are looked for."""
    result = room([0] * 12 + [1] * 12, materials(coverage=0.0), box(0.995, inwards=False), gather=gather)
    assert result.value.mean() == pytest.approx(POWER / (24 * (1 - RHO)), rel=0.02)
