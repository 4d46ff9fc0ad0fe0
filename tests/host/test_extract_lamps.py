"""Every kind of lamp against Cycles: a small floor's E/π, and the closed form of what was extracted."""

from math import cos, pi, radians

import numpy as np
import pytest
from photon_bake.addon.blender import extract_scene
from photon_bake.addon.scene import LightKind
from photon_bake.tests.host import scenes

FAR = 100.0


def radiant(scene):
    """E/π that the first lamp of a scene gives a floor at the origin, straight below it and far away."""
    lights = scene.lights
    emission, distance = lights.emission[0].astype(float), float(lights.position[0, 2])
    kind = LightKind(lights.kind[0])
    if kind == LightKind.SUN:
        return emission / pi
    if kind in (LightKind.POINT, LightKind.SPOT):
        return emission / distance**2 / pi
    area = lights.size[0].prod(dtype=float) * (1 if kind == LightKind.RECTANGLE else pi / 4)
    return emission * area / distance**2 / pi


def compare(kind, location, samples=32, **options):
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    lamp = scenes.add_lamp(kind, location=location, **options)
    scene = extract_scene(scenes.depsgraph())
    cycles = scenes.cycles_bake(floor, "DIRECT", samples).mean(0)
    assert cycles.max() > 0
    np.testing.assert_allclose(radiant(scene), cycles, rtol=4e-3)
    return scene, lamp


COMMON = [
    {},
    {"scale": (3, 3, 3)},
    {"scale": (2, 3, 0.5)},
    {"normalize": False},
    {"normalize": False, "scale": (2, 3, 0.5)},
    {"color": (1, 0.5, 0.25)},
    {"exposure": 1.5},
    {"use_temperature": True, "temperature": 3000},
]


@pytest.mark.parametrize("options", COMMON)
@pytest.mark.parametrize("radius", [0, 0.1])
@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_point_and_spot(kind, radius, options):
    compare(kind, (0, 0, 5), energy=100, shadow_soft_size=radius, **options)


@pytest.mark.parametrize("options", COMMON)
@pytest.mark.parametrize("angle", [0, 0.1])
def test_sun(angle, options):
    scene, _ = compare("SUN", (0, 0, 5), energy=3, angle=angle, **options)
    assert scene.lights.angle[0] == pytest.approx(angle)


@pytest.mark.parametrize("options", COMMON)
@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_area(shape, options):
    compare("AREA", (0, 0, FAR), energy=1e6, shape=shape, size=0.5, size_y=0.3, **options)


def test_a_lamp_s_nodes_multiply_its_power():
    scenes.add_lamp("POINT", energy=100)
    light = scenes.bpy.data.lights[0]
    if scenes.bpy.app.version < (5, 0, 0):
        light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Strength"].default_value = 2
    emission.inputs["Color"].default_value = (1, 0.5, 0, 1)
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    scene = extract_scene(scenes.depsgraph())
    cycles = scenes.cycles_bake(floor, "DIRECT", 32).mean(0)
    np.testing.assert_allclose(radiant(scene), cycles, rtol=4e-3, atol=1e-6)


@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 3, 3), (1, 1, 2), (2, 2, 1)])
def test_cone_of_a_scaled_spot(scale):
    """Just inside the extracted cone Cycles is bright, just outside dark."""
    lamp = scenes.add_lamp("SPOT", energy=100, scale=scale, spot_size=radians(60), spot_blend=0, shadow_soft_size=0)
    half = extract_scene(scenes.depsgraph()).lights.angle[0] / 2
    for tilt, lit in ((half - 0.03, True), (half + 0.03, False)):
        floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
        lamp.rotation_euler = (tilt, 0, 0)
        assert (scenes.cycles_bake(floor, "DIRECT", 4).mean() > 0.1) == lit
        scenes.bpy.data.objects.remove(floor)


def test_frame_of_a_rotated_lamp():
    lamp = scenes.add_lamp("AREA", location=(1, 2, 3), shape="RECTANGLE", size=2, size_y=1, scale=(1, 3, 1))
    lamp.rotation_euler = (radians(90), 0, 0)  # shines along +y
    lights = extract_scene(scenes.depsgraph()).lights
    np.testing.assert_allclose(lights.position, [[1, 2, 3]])
    np.testing.assert_allclose(lights.direction, [[0, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(lights.axis_x, [[1, 0, 0]], atol=1e-6)
    np.testing.assert_allclose(lights.axis_y, [[0, 0, 1]], atol=1e-6)
    np.testing.assert_allclose(lights.size, [[2, 3]], rtol=1e-6)
    assert lights.emission.dtype == np.float32


def test_sun_at_an_angle():
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    scenes.add_lamp("SUN", energy=2, angle=0).rotation_euler = (radians(60), 0, 0)
    lights = extract_scene(scenes.depsgraph()).lights
    expected = lights.emission[0, 0] * -lights.direction[0, 2] / pi
    assert expected == pytest.approx(2 * cos(radians(60)) / pi, rel=1e-5)
    assert scenes.cycles_bake(floor, "DIRECT", 4).mean() == pytest.approx(expected, rel=1e-3)


def test_what_diffuse_surfaces_do_not_see():
    scenes.add_lamp("POINT").visible_diffuse = False
    scenes.add_lamp("AREA").data.cycles.is_portal = True
    assert len(extract_scene(scenes.depsgraph()).lights) == 0


def test_warnings():
    scenes.add_lamp("AREA", "Grid", spread=0.5)
    scenes.add_lamp("POINT", "NoShadow", use_shadow=False)
    warnings = []
    extract_scene(scenes.depsgraph(), warnings)
    assert len(warnings) == 2
    assert "'Grid'" in warnings[0] or "'Grid'" in warnings[1]
