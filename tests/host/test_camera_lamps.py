"""Lamps that the camera sees over mirrors and through glass: direct light and the pass are Cycles' full render."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import read_camera
from photon_bake.addon.blender.read.camera import read_pixel_filter
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.gather import DirectLight, camera_gloss, reflected_highlights
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.receivers import camera_points
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.host import scenes
from photon_bake.tests.host.camera_scenes import add_camera, coloured
from photon_bake.tests.host.cycles_passes import render_passes

BALL = {"energy": 100, "shadow_soft_size": 0.4}
LAMPS = {
    "disc": ("POINT", BALL),
    "ball": ("POINT", {**BALL, "use_soft_falloff": False}),
    "spot": ("SPOT", {**BALL, "spot_size": 1.0}),
    "spot of a ball": ("SPOT", {**BALL, "use_soft_falloff": False, "spot_size": 0.5, "spot_blend": 1.0}),
    "rectangle": ("AREA", {"energy": 30, "shape": "RECTANGLE", "size": 0.8, "size_y": 0.4}),
    "ellipse": ("AREA", {"energy": 3, "shape": "ELLIPSE", "size": 0.8, "size_y": 0.4, "spread": 1.2}),
    "point": ("POINT", {"energy": 1000, "shadow_soft_size": 0.0}),
    "turned away": ("AREA", {"energy": 30, "size": 0.5}),
}
"""Each with a pixel's height or more in the picture; the last two are not seen."""


def add_lamps():
    """Rows of four lamps that shine to −y, and a sun behind them."""
    for i, (name, (kind, settings)) in enumerate(LAMPS.items()):
        lamp = scenes.add_lamp(kind, name, location=(i % 4 - 1.5, 6, 4.5 - i // 4), **settings)
        lamp.rotation_euler = (-1.5708 if name != "turned away" else 1.5708, 0, 0)
    sun = scenes.add_lamp("SUN", "Sun", energy=0.03, angle=0.1)
    sun.rotation_euler = (-1.5708, 0, 0)


def behind_mirrors(scene):
    """A periscope."""
    mirror = coloured("Mirror", (0.9, 0.8, 0.7), "ShaderNodeBsdfAnisotropic", Roughness=0.0)
    for z in (0, 4):
        plane = scenes.add_plane(f"Mirror {z}", 8, material=mirror)
        plane.location, plane.rotation_euler = (0, 2, z), (np.pi / 4, 0, 0)
    add_camera(scene, location=(0, 0, 0), lens=60)


def behind_glass(scene):
    """A pane of glass."""
    pane = scenes.add_cube("Pane", material=coloured("Glass", (0.9, 1, 0.9), "ShaderNodeBsdfGlass", Roughness=0.0))
    pane.location, pane.scale, pane.rotation_euler = (0, 2, 4), (4, 0.1, 4), (0.2, 0, 0)
    add_camera(scene, location=(0, 0, 4), lens=50)


def combined(scene, path, **options):
    passes = render_passes(scene, path, **options)
    return np.stack([passes[f"Combined.{c}"] for c in "RGB"], axis=-1)


def points_seen(scene, n_samples):
    """The scene as it was read, its tracer, and what the camera sees of it."""
    extracted = scenes.extracted(for_camera=True)
    tracer = TransparencyTracer(extracted, EmbreeTracer(extracted))
    camera, pixel_filter = scenes.in_graph(lambda graph: read_camera(scene, graph)), read_pixel_filter(scene)
    return extracted, tracer, camera_points(extracted, tracer, camera, pixel_filter, n_samples, Workers())


def highlights(scene):
    """What the pass has of direct light on gloss in mirrors."""
    extracted, tracer, points = points_seen(scene, 4)
    direct = DirectLight(extracted, tracer, light_sources(extracted, region_of(points.seen.position)))
    return points.picture(reflected_highlights(extracted, points, direct, tracer, 1024, Workers())[0])


def hide(names):
    for name in names:
        lamp = bpy.data.objects[name]
        lamp.visible_glossy = lamp.visible_transmission = False


@pytest.mark.parametrize("build", [behind_mirrors, behind_glass])
def test_lamps_are_seen_as_cycles_shows_them(empty_scene, tmp_path, build):
    """Nothing else is lit, so that what Cycles' direct light lacks is lamps alone; each in its own place.

    A fifth of the pixels has a lamp's edge, where samples differ; in glass, one more in twenty mirrors itself inside.
    """
    empty_scene.render.resolution_x, empty_scene.render.resolution_y = 48, 32
    add_lamps()
    build(empty_scene)
    hide(["ball"])
    bpy.data.lights["rectangle"].cycles.use_multiple_importance_sampling = build is not behind_glass
    full = combined(empty_scene, tmp_path / "full.exr", samples=64)
    direct = combined(empty_scene, tmp_path / "direct.exr", samples=4, bounces=0)
    ours = points_seen(empty_scene, 64)[2].beyond  # by Cycles' filter
    blocks = tuple(picture.reshape(4, 8, 6, 8, 3).mean(axis=(1, 3)) for picture in (ours, full - direct))
    assert blocks[0] == pytest.approx(blocks[1], rel=0.06, abs=0.02 * float(full.mean()))
    assert ours.mean() == pytest.approx((full - direct).mean(), rel=0.02) and full.mean() > 0.1


def build_metal_in_a_mirror(scene, roughness):
    """Behind the camera, which sees it in a mirror, a metal plane with a lamp of each kind that shines on it."""
    mirror = coloured("Mirror", (0.9, 0.8, 0.7), "ShaderNodeBsdfAnisotropic", Roughness=0.0)
    metal = coloured("Metal", (0.8, 0.9, 0.7), "ShaderNodeBsdfAnisotropic", Roughness=roughness)
    for y, turned, material in ((2, 1.5708, mirror), (-3, -1.5708, metal)):
        plane = scenes.add_plane(material.name, 6, material=material)
        plane.location, plane.rotation_euler = (0, y, 0), (turned, 0, 0)
    for i, (name, (kind, settings)) in enumerate(LAMPS.items()):
        lamp = scenes.add_lamp(kind, name, location=(i % 4 - 1.5, -1, 0.7 - i // 4), **settings)
        lamp.rotation_euler = (-1.5708 if name == "turned away" else 1.5708, 0, np.pi)
    emitter = scenes.add_plane("Emitter", 0.5, material=coloured("Glow", (1, 1, 1), "ShaderNodeEmission", Strength=20))
    emitter.location, emitter.rotation_euler = (0, -1.5, 0), (1.5708, 0, 0)
    scenes.set_world((0.2, 0.3, 0.4))
    add_camera(scene, location=(0, 0, 0), lens=30)


@pytest.mark.parametrize("roughness", [0.3, 0.5])
def test_highlights_in_mirrors_are_those_of_cycles(empty_scene, tmp_path, roughness):
    """One bounce more than direct light has, by the same samples; noise is 3 % of a block."""
    empty_scene.render.resolution_x, empty_scene.render.resolution_y = 48, 32
    build_metal_in_a_mirror(empty_scene, roughness)
    full = combined(empty_scene, tmp_path / "full.exr", samples=64, bounces=1)
    direct = combined(empty_scene, tmp_path / "direct.exr", samples=64, bounces=0)
    ours, theirs = highlights(empty_scene), full - direct
    blocks = tuple(picture.reshape(4, 8, 6, 8, 3).mean(axis=(1, 3)) for picture in (ours, theirs))
    assert blocks[0] == pytest.approx(blocks[1], rel=0.1, abs=0.02 * float(full.mean()))
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.03)


def behind_frosted_glass(scene, world):
    """A pane of rough glass before a world that is a picture, or before lamps."""
    frosted = coloured("Frosted", (0.9, 1, 0.9), "ShaderNodeBsdfGlass", Roughness=0.3)
    pane = scenes.add_cube("Pane", material=frosted)
    pane.location, pane.scale = (0, 2, 4), (4, 0.1, 4)
    floor = scenes.add_plane("Floor", material=coloured("Floor", (0.5, 0.5, 0.5)))
    floor.location = (0, 20, -10)
    add_camera(scene, location=(0, 0, 4), lens=50)
    if not world:
        add_lamps()
        bpy.data.lights["point"].energy = 0
        return
    background = scenes.set_world((1, 1, 1))
    tree = background.id_data
    direction, positive = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    positive.operation = "ABSOLUTE"
    tree.links.new(direction.outputs["Generated"], positive.inputs[0])
    tree.links.new(positive.outputs[0], background.inputs["Color"])


@pytest.mark.parametrize("world", [True, False])
def test_rough_glass_shows_lamps_and_worlds(empty_scene, tmp_path, world):
    """A lamp's light passes rough facets twice: 1 or 2 % of noise in a block on both sides."""
    empty_scene.render.resolution_x, empty_scene.render.resolution_y = 48, 32
    behind_frosted_glass(empty_scene, world)
    full = combined(empty_scene, tmp_path / "full.exr", samples=256)
    direct = combined(empty_scene, tmp_path / "direct.exr", samples=4, bounces=0)
    scene, tracer, points = points_seen(empty_scene, 4)
    solution = solve(scene, points.receivers(scene), settings_for("draft", n_photons=10_000), tracer.surfaces)
    ours = points.picture(camera_gloss(scene, points, solution.rays, 256, Workers())[0])
    theirs = full - direct
    blocks = tuple(picture.reshape(2, 16, 3, 16, 3).mean(axis=(1, 3)) for picture in (ours, theirs))
    assert blocks[0] == pytest.approx(blocks[1], rel=0.05, abs=0.05 * float(full.mean()))
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.02)
