"""Every kind of lamp against Cycles: a small floor's E/π, and the closed form of what was extracted."""

from dataclasses import replace
from math import cos, pi, radians

import numpy as np
import pytest
from photon_bake.addon.blender.read.lamps.lamps import in_light_group
from photon_bake.addon.blender.read.lamps.light_links import link_lights
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.gather import DirectLight
from photon_bake.addon.scene import LightKind, PatternDomain, RayKind, SceneObjects
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
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
    scene = scenes.extracted()
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
    scene = scenes.extracted()
    cycles = scenes.cycles_bake(floor, "DIRECT", 32).mean(0)
    np.testing.assert_allclose(radiant(scene), cycles, rtol=4e-3, atol=1e-6)


def test_a_blackbody_in_a_lamp_s_nodes():
    scenes.add_lamp("POINT", energy=100)
    light = scenes.bpy.data.lights[0]
    if scenes.bpy.app.version < (5, 2, 0):
        light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    body = light.node_tree.nodes.new("ShaderNodeBlackbody")
    body.inputs[0].default_value = 2500
    light.node_tree.links.new(body.outputs[0], emission.inputs["Color"])
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    warnings = []
    scene = scenes.extracted(warnings)
    cycles = scenes.cycles_bake(floor, "DIRECT", 32).mean(0)
    np.testing.assert_allclose(radiant(scene), cycles, rtol=4e-3)
    assert not warnings and len(scenes.bpy.data.lights) == 1


PLACES = [(x, y, 0) for x in (-2, -0.7, 0, 1.3, 3) for y in (-1.5, 0, 0.4, 2)]
N_ESTIMATES = 30_000


def add_places(size=2e-3):
    """A mesh of small squares on the floor at PLACES."""
    h = size / 2
    vertices = [np.add(p, q) for p in PLACES for q in ((-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0))]
    faces = np.arange(len(vertices)).reshape(-1, 4)
    return scenes.add_mesh("Places", vertices, faces, scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])


def compare_at_places(samples=1024):
    """Direct light at all PLACES as we sample it, against Cycles: within 1.5 % and four standard errors."""
    places = add_places()
    scene = linked(scenes.extracted())
    direct = DirectLight(
        scene,
        TransparencyTracer(scene, EmbreeTracer(scene)),
        light_sources(scene, Sphere(np.zeros(3, np.float32), 4.0)),
    )
    at = np.repeat(np.array(PLACES, np.float32) + np.array([0, 0, 1e-4], np.float32), N_ESTIMATES, 0)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), at.shape)
    objects = np.full(len(at), scene.objects.names.index("Places"), np.int32)
    estimates = direct.irradiance(at, up, objects, stream(1)).reshape(len(PLACES), -1, 3).astype(np.float64) / np.pi
    ours, error = estimates.mean(axis=1), estimates.std(axis=1) / N_ESTIMATES**0.5
    cycles = scenes.cycles_bake(places, "DIRECT", samples).reshape(len(PLACES), 4, 3).mean(axis=1)
    assert cycles.max() > 0
    assert (np.abs(ours - cycles) < 0.015 * cycles + 4 * error + 1e-4 * cycles.max()).all()
    return scene


def linked(scene):
    """A scene with its lamps linked, of a file in which each object is itself."""
    data = scenes.bpy.data.objects
    lamps, objects = [data[name] for name in scene.lights.names], [(data[name], None) for name in scene.objects.names]
    return link_lights(scene, lamps, objects)


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
@pytest.mark.parametrize("options", [{}, {"normalize": False}, {"shadow_soft_size": 1.45}])
def test_spheres(kind, options):
    """Soft falloff off: a sphere; one that nearly touches the floor."""
    options = {"energy": 100, "shadow_soft_size": 0.5, "use_soft_falloff": False, **options}
    scenes.add_lamp(kind, location=(0.3, 0, 1.5), **options)
    compare_at_places()


@pytest.mark.parametrize("blend", [0, 0.7])
@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 3, 3), (1, 1, 2), (2, 2, 1), (3, 0.5, 1), (0.4, 2, 0.7)])
def test_cone_of_a_scaled_spot(scale, blend):
    options = {"energy": 100, "spot_size": radians(60), "spot_blend": blend, "shadow_soft_size": 0}
    lamp = scenes.add_lamp("SPOT", location=(0.3, 0.1, 2), scale=scale, **options)
    lamp.rotation_euler = (0.3, -0.2, 0.5)
    compare_at_places()


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("spread", [2, 20, 60, 120, 175])
@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_spread(shape, spread, normalize):
    options = {"energy": 100, "shape": shape, "size": 2, "size_y": 1.0, "spread": radians(spread)}
    scenes.add_lamp("AREA", location=(0.35, 0.1, 2), normalize=normalize, **options)
    compare_at_places()


def collection_of(included=(), excluded=()):
    """A collection outside the scene, for linking lights."""
    collection = scenes.bpy.data.collections.new("Linked")
    for obj in (*included, *excluded):
        collection.objects.link(obj)
    for obj, entry in zip(collection.objects, collection.collection_objects, strict=True):
        entry.light_linking.link_state = "INCLUDE" if obj in included else "EXCLUDE"
    return collection


def test_light_linking():
    """Of two lamps one does not light the places; a collection that only excludes lights all the rest."""
    other = scenes.add_cube("Other")
    other.location = (20, 0, 0)
    one, two, three = (
        scenes.add_lamp("POINT", name, location=(x, 0, 2), energy=100, color=color)
        for name, x, color in (("A", -1, (1, 0, 0)), ("B", 1, (0, 1, 0)), ("C", 0, (0, 0, 1)))
    )
    one.light_linking.receiver_collection = collection_of(included=[other])
    two.light_linking.receiver_collection = collection_of(excluded=[other])
    scene = compare_at_places()
    of = {name: i for i, name in enumerate(scene.objects.names)}
    assert scene.lights.illuminates[:, of["Other"]].tolist() == [True, False, True]
    assert scene.lights.illuminates[:, of["Places"]].tolist() == [False, True, True]
    assert scene.lights.blocked_by is None and three


def add_plate(name, z, half=0.5):
    plate = scenes.add_plane(name, 2 * half, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    plate.location = (0.3, 0.2, z)
    return plate


@pytest.mark.parametrize("include", [True, False])
def test_shadow_linking(include):
    plates = add_plate("Blocks", 1, 0.2), add_plate("Passes", 0.5, 1)
    lamp = scenes.add_lamp("POINT", location=(0, 0, 2), energy=100, shadow_soft_size=0)
    links = {"included": plates[:1]} if include else {"excluded": plates[1:]}
    lamp.light_linking.blocker_collection = collection_of(**links)
    compare_at_places()


def test_no_shadow():
    add_plate("Plate", 1, 1)
    scenes.add_lamp("POINT", location=(0, 0, 2), energy=100, shadow_soft_size=0, use_shadow=False)
    scenes.add_lamp("POINT", "Other", location=(1, 1, 2), energy=50, shadow_soft_size=0)
    compare_at_places()


def test_collections_in_linked_collections():
    """Objects of a collection in the collection follow what is said of it, and what is said of themselves counts."""
    a, b, c = (scenes.add_cube(name) for name in "ABC")
    inner, outer = scenes.bpy.data.collections.new("Inner"), collection_of(included=[c])
    for obj in (a, b, c):
        inner.objects.link(obj)
    outer.children.link(inner)
    outer.collection_children[0].light_linking.link_state = "EXCLUDE"
    lamp = scenes.add_lamp("POINT")
    lamp.light_linking.receiver_collection = outer
    lights = linked(scenes.extracted()).lights
    assert lights.illuminates.tolist() == [[False, False, True]]


def test_instances_are_linked_by_what_instances_them():
    cube, instancer = scenes.add_cube("Cube"), scenes.bpy.data.objects.new("Instancer", None)
    lamp = scenes.add_lamp("POINT")
    scene = scenes.extracted()
    scene = replace(scene, objects=SceneObjects.seen_by_all(("Cube", "Cube")))
    placed = [(cube, None), (cube, instancer)]
    lamp.light_linking.receiver_collection = collection_of(included=[cube])
    assert link_lights(scene, [lamp], placed).lights.illuminates.tolist() == [[True, True]]
    lamp.light_linking.receiver_collection = collection_of(included=[cube], excluded=[instancer])
    assert link_lights(scene, [lamp], placed).lights.illuminates.tolist() == [[True, False]]


def test_light_groups():
    lamp, instancer = scenes.add_lamp("POINT"), scenes.bpy.data.objects.new("Instancer", None)
    scenes.bpy.context.view_layer.lightgroups.add(name="Key")
    instancer.lightgroup = "Key"
    assert in_light_group(lamp, None, "") and not in_light_group(lamp, None, "Key")
    assert in_light_group(lamp, instancer, "Key")
    lamp.lightgroup = "Fill"
    assert not in_light_group(lamp, instancer, "Key") and in_light_group(lamp, instancer, "Fill")


def test_frame_of_a_rotated_lamp():
    lamp = scenes.add_lamp("AREA", location=(1, 2, 3), shape="RECTANGLE", size=2, size_y=1, scale=(1, 3, 1))
    lamp.rotation_euler = (radians(90), 0, 0)  # shines along +y
    lights = scenes.extracted().lights
    np.testing.assert_allclose(lights.position, [[1, 2, 3]])
    np.testing.assert_allclose(lights.direction, [[0, 1, 0]], atol=1e-6)
    np.testing.assert_allclose(lights.axis_x, [[1, 0, 0]], atol=1e-6)
    np.testing.assert_allclose(lights.axis_y, [[0, 0, 1]], atol=1e-6)
    np.testing.assert_allclose(lights.size, [[2, 3]], rtol=1e-6)
    assert lights.emission.dtype == np.float32


def test_sun_at_an_angle():
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    scenes.add_lamp("SUN", energy=2, angle=0).rotation_euler = (radians(60), 0, 0)
    lights = scenes.extracted().lights
    expected = lights.emission[0, 0] * -lights.direction[0, 2] / pi
    assert expected == pytest.approx(2 * cos(radians(60)) / pi, rel=1e-5)
    assert scenes.cycles_bake(floor, "DIRECT", 4).mean() == pytest.approx(expected, rel=1e-3)


def test_what_surfaces_do_not_see():
    unseen = scenes.add_lamp("POINT")
    unseen.visible_diffuse = False
    scenes.add_lamp("AREA").data.cycles.is_portal = True
    lights = scenes.extracted().lights
    assert not lights.seen_by(RayKind.DIFFUSE)[0] and lights.seen_by(RayKind.GLOSSY).tolist() == [True]
    unseen.visible_glossy = unseen.visible_transmission = False
    assert len(scenes.extracted().lights) == 0


def with_strength(light, kind, output=0, **inputs):
    """Make the strength of a lamp's Emission node that of a new node; returns the node."""
    if scenes.bpy.app.version < (5, 2, 0):
        light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    node = light.node_tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    light.node_tree.links.new(node.outputs[output], emission.inputs["Strength"])
    return node


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA"])
def test_lamps_with_a_texture_give_what_cycles_has_of_them(kind):
    lamp = scenes.add_lamp(kind, "Gobo", location=(0.4, 0.2, 2), energy=100)
    node = with_strength(lamp.data, "ShaderNodeTexNoise", Scale=3.0)
    tree = lamp.data.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV" if kind == "AREA" else "Normal"], node.inputs[0])
    scene = compare_at_places()
    pattern = scene.lights.patterns[0]
    assert np.ptp(pattern.values) > 0.1 and (pattern.domain == PatternDomain.PLACES) == (kind == "AREA")


def test_an_ies_profile_gives_what_cycles_has_of_it():
    lamp = scenes.add_lamp("POINT", location=(0.4, 0.2, 2), energy=100)
    profile = scenes.bpy.data.texts.new("Profile")
    profile.write("IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 5 5 1 2 0 0 0\n1 1 1\n0 30 60 90 180\n0 90 180 270 360\n")
    profile.write("200 180 150 120 100\n200 200 180 150 100\n200 160 120 90 100\n200 170 140 110 100\n")
    profile.write("200 180 150 120 100\n")
    with_strength(lamp.data, "ShaderNodeTexIES").ies = profile
    assert compare_at_places().lights.patterns[0].angle == pytest.approx(pi)


@pytest.mark.parametrize("output", ["Quadratic", "Linear", "Constant"])
@pytest.mark.parametrize("kind", ["POINT", "AREA"])
def test_light_falls_off_as_in_cycles(kind, output):
    lamp = scenes.add_lamp(kind, location=(0.4, 0.2, 2), energy=100)
    with_strength(lamp.data, "ShaderNodeLightFalloff", output, Strength=1.5, Smooth=0.7)
    scene = compare_at_places()
    assert scene.lights.patterns == (None,) and scene.lights.smoothing[0] == pytest.approx(0.7)


def test_a_fall_off_that_cannot_be_told_is_named():
    light = scenes.add_lamp("POINT", "Odd").data
    node = with_strength(light, "ShaderNodeLightFalloff", "Linear")
    value = light.node_tree.nodes.new("ShaderNodeTexNoise")
    light.node_tree.links.new(value.outputs[0], node.inputs["Smooth"])
    warnings = []
    scenes.extracted(warnings)
    assert len(warnings) == 1 and "'Odd'" in warnings[0] and "distance" in warnings[0]


def test_nothing_of_a_rendered_lamp_is_left():
    with_strength(scenes.add_lamp("AREA").data, "ShaderNodeTexNoise")
    before = {name: len(getattr(scenes.bpy.data, name)) for name in ("lights", "objects", "scenes", "meshes", "images")}
    scenes.extracted()
    assert {name: len(getattr(scenes.bpy.data, name)) for name in before} == before


def test_emissive_objects_are_linked():
    material, _ = scenes.add_material(node="ShaderNodeEmission")
    glow, other = (scenes.add_plane(name, material=material) for name in ("Glow", "Other"))
    glow.light_linking.receiver_collection = collection_of(included=[glow])
    scene = linked(scenes.extracted())
    k, other = scene.objects.names.index("Glow"), scene.objects.names.index("Other")
    links = scene.objects.links
    assert links.group[other] == -1 and links.illuminates[links.group[k]].tolist() == [i == k for i in range(2)]
    assert links.blocked_by.all()
