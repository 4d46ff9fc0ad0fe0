"""The world against Cycles: E/π of small faces that look different ways, from Cycles' bake and from what was read."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from mathutils import Vector
from photon_bake.addon.blender import read_scene
from photon_bake.addon.blender.read.lamps import cycles_world
from photon_bake.addon.blender.read.lamps.world import read_world
from photon_bake.addon.blender.temporary import CyclesError
from photon_bake.addon.blender.warn import Warnings
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.gather import DirectLight
from photon_bake.addon.scene import LightKind, RayKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.host import scenes

NORMALS = [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0.6, 0.3, 0.74)]


@pytest.fixture(autouse=True)
def nothing_kept():
    cycles_world._rendered.clear()


class Tree:
    """The node tree of a new world that ends in a Background, by itself of strength 1."""

    def __init__(self):
        self.background = scenes.set_world((0, 0, 0))
        self.tree = bpy.context.scene.world.node_tree

    def add(self, kind, **properties):
        node = self.tree.nodes.new("ShaderNode" + kind)
        for name, value in properties.items():
            setattr(node, name, value)
        return node

    def link(self, start, end):
        self.tree.links.new(start, end)

    def color(self, output):
        self.link(output, self.background.inputs["Color"])


def picture(height=64, width=128):
    """An image of noise with a bright patch."""
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.random.default_rng(0).uniform(0, 0.5, (height, width, 3))
    pixels[height * 11 // 16 : height * 25 // 32, width // 4 : width * 5 // 16, :3] = (200, 150, 80)
    image = bpy.data.images.new("Picture", width, height, float_buffer=True, alpha=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    return image


def hdri(rotation=(0.3, -0.2, 1.1)):
    tree = Tree()
    environment = tree.add("TexEnvironment", image=picture())
    mapping, coordinates = tree.add("Mapping"), tree.add("TexCoord")
    mapping.inputs["Rotation"].default_value = rotation
    tree.link(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.link(mapping.outputs[0], environment.inputs["Vector"])
    tree.color(environment.outputs[0])
    tree.background.inputs["Strength"].default_value = 0.8
    return tree


def sky(**properties):
    tree = Tree()
    tree.color(tree.add("TexSky", sun_elevation=0.6, sun_rotation=2.0, **properties).outputs[0])
    tree.background.inputs["Strength"].default_value = 0.05
    return tree


def gradient():
    tree = Tree()
    apart, ramp = tree.add("SeparateXYZ"), tree.add("ValToRGB")
    tree.link(tree.add("TexCoord").outputs["Generated"], apart.inputs[0])
    tree.link(apart.outputs[2], ramp.inputs[0])
    elements = ramp.color_ramp.elements
    elements[0].color, elements[1].color = (0.1, 0.02, 0.01, 1), (0.5, 3, 6, 1)
    tree.color(ramp.outputs[0])
    return tree


def seen_by_cameras(other):
    """What a world gives to cameras is red; to light it gives `other`'s."""
    red, mix, path = other.add("Background"), other.add("MixShader"), other.add("LightPath")
    red.inputs["Color"].default_value = (9, 0, 0, 1)
    other.link(path.outputs["Is Camera Ray"], mix.inputs[0])
    other.link(other.background.outputs[0], mix.inputs[1])
    other.link(red.outputs[0], mix.inputs[2])
    other.link(mix.outputs[0], next(n for n in other.tree.nodes if n.type == "OUTPUT_WORLD").inputs["Surface"])


def add_faces():
    """A small triangle a normal, 50 m apart."""
    vertices = []
    for i, normal in enumerate(NORMALS):
        n, at = Vector(normal).normalized(), Vector((50 * i, 0, 0))
        t = n.orthogonal().normalized()
        vertices += [at + 0.2 * t, at - 0.1 * t + 0.2 * n.cross(t), at - 0.1 * t - 0.2 * n.cross(t)]
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return scenes.add_mesh("Faces", vertices, faces, scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])


def read(warnings=None, **options):
    graph = scenes.depsgraph()
    return read_world(graph, **options).world(graph.scene, Warnings(warnings))[0]


def radiant(world):
    """E/π of the faces, (7, 3), by adding up the pixels."""
    height, width = world.image.shape[:2]
    z = -np.cos(np.pi * (np.arange(height) + 0.5) / height)[:, None]
    azimuth, r = np.pi - 2 * np.pi * (np.arange(width) + 0.5) / width, np.sqrt(1 - z * z)
    directions = np.stack(np.broadcast_arrays(r * np.cos(azimuth), r * np.sin(azimuth), z), axis=-1)
    solid_angle = np.diff(-np.cos(np.pi * np.arange(height + 1) / height)) * 2 * np.pi / width
    light = world.image * world.color * solid_angle[:, None, None]
    unit = [np.array(n) / np.linalg.norm(n) for n in NORMALS]
    return np.array([np.einsum("hwc,hw->c", light, np.maximum(directions @ n, 0)) for n in unit]) / np.pi


ONES = cycles_world.WorldPicture(np.ones((4, 8, 3), np.float32), [])


def from_sun(sun):
    """E/π of the faces by a small sun, (7, 3)."""
    unit = [np.array(n) / np.linalg.norm(n) for n in NORMALS]
    return np.array([sun.irradiance * max(sun.towards @ n, 0) for n in unit]) / np.pi


WORLDS = {
    "HDRI": hdri,
    "sky": sky,
    "sky without its sun": lambda: sky(sun_disc=False),
    "sky with a small sun": lambda: sky(sun_size=0.003),
    "gradient": gradient,
    "gradient that cameras do not see": lambda: seen_by_cameras(gradient()),
}


@pytest.mark.parametrize("name", WORLDS)
def test_pictures(name):
    WORLDS[name]()
    warnings = []
    graph = scenes.depsgraph()
    world, suns = read_world(graph).world(graph.scene, Warnings(warnings))
    cycles = scenes.cycles_bake(add_faces(), "DIRECT", 4096).reshape(-1, 3, 3).mean(axis=1)
    assert not warnings
    found = radiant(world) + sum(from_sun(sun) for sun in suns)
    np.testing.assert_allclose(found, cycles, rtol=0.01, atol=1e-3 * cycles.max())
    assert len(suns) == ("sun" in name and "without" not in name) + (name == "sky")


def test_the_sun_of_a_sky_is_a_lamp():
    """At its height, as wide as it is, in the world's light group; the picture has nothing of it."""
    sky(sun_size=0.0095)
    bpy.context.view_layer.lightgroups.add(name="Sky")
    bpy.context.scene.world.lightgroup = "Sky"
    reading = scenes.in_graph(read_scene)
    scene = reading.scene(bpy.context.scene)
    lights, image = scene.lights, scene.world.image
    assert lights.names == ("Sun of the world",) and lights.kind[0] == LightKind.SUN
    assert lights.angle[0] == pytest.approx(0.0095)
    assert -lights.direction[0, 2] == pytest.approx(np.sin(0.6), abs=2e-4)
    assert image.max() < 0.01 * lights.emission[0].max() / (np.pi * np.sin(0.0095 / 2) ** 2)
    (group,) = reading.light_groups.apart(scene).values()
    assert len(group.lights) == 1


def test_suns_that_no_rays_see_are_black():
    tree = sky(sun_size=0.0095)
    bpy.context.scene.world.cycles_visibility.diffuse = False
    assert not scenes.extracted().lights.seen_by_diffuse.any()
    tree.background.inputs["Strength"].default_value = 0.0
    assert not scenes.extracted().lights.emission.any()


def test_light_from_a_picture_as_a_bake_finds_it():
    hdri()
    faces = add_faces()
    scene = scenes.extracted()
    sources = light_sources(scene, Sphere(np.zeros(3, np.float32), 1.0))
    direct = DirectLight(scene, TransparencyTracer(scene, EmbreeTracer(scene)), sources)
    cycles = scenes.cycles_bake(faces, "DIRECT", 1024).reshape(-1, 3, 3).mean(axis=1)
    n = 20_000
    normals = np.repeat(scene.normals, n, axis=0)
    at = np.repeat(scene.vertices[scene.triangles].mean(axis=1), n, axis=0) + 1e-3 * normals
    values = direct.irradiance(at, normals, None, stream(3)).reshape(-1, n, 3).mean(axis=1)
    order = np.argsort(scene.vertices[scene.triangles[:, 0], 0])
    np.testing.assert_allclose(values[order] / np.pi, cycles, rtol=0.03, atol=2e-3 * cycles.max())


def blocks():
    """Names of all that is in the file."""
    kinds = ("cameras", "images", "lights", "materials", "meshes", "node_groups", "objects", "scenes", "worlds")
    return {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}


def test_nothing_stays_behind():
    tree = gradient()
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    tree.add("Group").node_tree = group
    seen_by_cameras(tree)
    handlers, told = list(bpy.app.handlers.render_pre), []
    bpy.app.handlers.render_pre.append(told.append)
    before, links = blocks(), len(tree.tree.links)
    try:
        read()
    finally:
        bpy.app.handlers.render_pre.remove(told.append)
    assert blocks() == before and len(tree.tree.links) == links and not told
    assert list(bpy.app.handlers.render_pre) == handlers
    assert bpy.context.scene.name == "Scene"


def pixels_of_result(path, scene):
    bpy.data.images["Render Result"].save_render(str(path), scene=scene)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels)
    bpy.data.images.remove(image)
    return pixels


def test_the_user_s_render_stays(tmp_path):
    hdri()
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 1, "CPU"
    scene.render.resolution_x, scene.render.resolution_y = 32, 16
    scene.render.image_settings.file_format = "OPEN_EXR"
    bpy.ops.render.render()
    before = pixels_of_result(tmp_path / "before.exr", scene)
    read()
    assert np.array_equal(pixels_of_result(tmp_path / "after.exr", scene), before) and before.any()


def test_pictures_are_kept_until_the_world_changes(monkeypatch):
    renders = []
    monkeypatch.setattr(cycles_world, "_render", lambda *_: renders.append(1) or ONES)
    tree = hdri()
    read()
    read()
    assert len(renders) == 1
    tree.background.inputs["Strength"].default_value = 0.5
    read()
    image = bpy.data.images["Picture"]
    image.pixels[0] = 3
    image.update()
    read()
    assert len(renders) == 3


@pytest.mark.parametrize("animated", [False, True])
def test_animated_worlds_are_rendered_at_each_frame(animated, monkeypatch):
    renders = []
    monkeypatch.setattr(cycles_world, "_render", lambda *_: renders.append(1) or ONES)
    tree = hdri()
    if animated:
        tree.background.inputs["Strength"].keyframe_insert("default_value", frame=1)
    for frame in (1, 2, 1):
        bpy.context.scene.frame_set(frame)
        read()
    assert len(renders) == (2 if animated else 1)


def test_one_color():
    scenes.set_world((0.5, 0.25, 0.125), 2)
    world = read()
    assert world.image is None
    np.testing.assert_allclose(world.color, [1, 0.5, 0.25])


def test_mixed_backgrounds_of_one_color():
    tree = Tree()
    tree.background.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1)
    seen_by_cameras(tree)
    world = read()
    assert world.image is None
    np.testing.assert_allclose(world.color, [0.5, 0.25, 0.125])


def test_black_worlds():
    gradient()
    visibility = bpy.context.scene.world.cycles_visibility
    visibility.diffuse = False
    assert read().hidden_from == {RayKind.DIFFUSE}
    visibility.glossy = visibility.transmission = False
    assert read().black
    visibility.diffuse = visibility.glossy = visibility.transmission = True
    bpy.context.view_layer.lightgroups.add(name="Key")
    assert read(light_group="Key").black
    bpy.context.scene.world.lightgroup = "Key"
    assert not read(light_group="Key").black


def test_without_cycles(monkeypatch):
    def no_cycles(*_):
        raise CyclesError("Cycles is not enabled")

    monkeypatch.setattr(cycles_world, "_render", no_cycles)
    hdri().background.inputs["Color"].default_value = (1, 0.5, 0, 1)
    warnings = []
    world = read(warnings)
    np.testing.assert_allclose(world.color, [0.8, 0.4, 0])
    assert world.image is None and len(warnings) == 1 and "'World'" in warnings[0]


def test_pictures_of_one_color_are_one_color(monkeypatch):
    monkeypatch.setattr(cycles_world, "_render", lambda *_: replace(ONES, image=np.full((4, 8, 3), 0.5, np.float32)))
    gradient()
    world = read()
    assert world.image is None and world.color.tolist() == [0.5] * 3


@pytest.mark.parametrize("n_lamps", [1, 6])
def test_small_lamps_in_a_picture_keep_their_light(n_lamps):
    """Of ∫ L dω over a picture with lamps of two by two texels, a quarter of a pixel of ours each."""
    height, width = 1024, 2048
    pixels = np.full((height, width, 4), (0.05, 0.05, 0.05, 1), np.float32)
    places = [(700 + 40 * (k % 3), 300 * k + 101 + k) for k in range(n_lamps)]
    for row, column in places:
        pixels[row : row + 2, column : column + 2, :3] = (72_000, 54_000, 36_000)
    image = bpy.data.images.new("Lamps", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    tree = Tree()
    tree.color(tree.add("TexEnvironment", image=image).outputs["Color"])
    z = -np.cos(np.pi * np.arange(height + 1) / height)
    expected = np.einsum("ijk,i->k", pixels[..., :3], np.diff(z), dtype=np.float64) * 2 * np.pi / width
    assert read().integral == pytest.approx(expected, rel=0.02)
