"""What nodes read of objects, instances, the scene and its view layer, as Cycles renders it."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.meshes.instance_groups import groups_of_instances
from photon_bake.tests.host import scenes

pytestmark = pytest.mark.usefixtures("empty_cache")


def glowing(kind, output="Color", noise=False, **properties):
    """A material that emits what a node reads; with noise, of which only Cycles knows that it is none."""
    material, surface = scenes.add_material("Glow", "ShaderNodeEmission")
    tree = material.node_tree
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in properties.items():
        setattr(node, name, value)
    end = node.outputs[output]
    if noise:
        mix = tree.nodes.new("ShaderNodeMixRGB")
        mix.inputs[0].default_value = 0
        tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], mix.inputs[2])
        tree.links.new(end, mix.inputs[1])
        end = mix.outputs[0]
    tree.links.new(end, surface.inputs["Color"])
    return material


def tile(name, material, at=None):
    """A square of 1 m, in the scene where `at` says it is."""
    obj = scenes.add_plane(name, 1.0, material=material)
    if at is None:
        bpy.context.scene.collection.objects.unlink(obj)
    else:
        obj.location = (at, 0, 0)
    return obj


def points(n, name="Points"):
    """A mesh object of n vertices, 2 m apart along x."""
    return scenes.add_mesh(name, [(2 * i, 0, 0) for i in range(n)], [])


def instanced_by_nodes(obj, n, color_name=""):
    """n instances of an object by geometry nodes, with a random colour attribute where it has a name."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    scatter, info = (group.nodes.new(f"GeometryNode{kind}") for kind in ("InstanceOnPoints", "ObjectInfo"))
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = obj, True
    group.links.new(start.outputs[0], scatter.inputs["Points"])
    group.links.new(info.outputs["Geometry"], scatter.inputs["Instance"])
    last = scatter.outputs[0]
    if color_name:
        store, random = group.nodes.new("GeometryNodeStoreNamedAttribute"), group.nodes.new("FunctionNodeRandomValue")
        store.data_type, store.domain, random.data_type = "FLOAT_COLOR", "INSTANCE", "FLOAT_VECTOR"
        store.inputs["Name"].default_value = color_name
        value = next(one for one in store.inputs if one.name == "Value" and one.enabled)
        group.links.new(last, store.inputs["Geometry"])
        group.links.new(random.outputs[0], value)
        last = store.outputs[0]
    group.links.new(last, end.inputs[0])
    by = points(n)
    by.modifiers.new("Scatter", "NODES").node_group = group
    return by


def instanced_by_points(obj, n):
    by = points(n)
    obj.parent, by.instance_type = by, "VERTS"
    bpy.context.scene.collection.objects.link(obj)
    return by


def instanced_by_collections(obj, n):
    collection = bpy.data.collections.new("Set")
    collection.objects.link(obj)
    for i in range(n):
        by = bpy.data.objects.new("Instance", None)
        by.instance_type, by.instance_collection, by.location = "COLLECTION", collection, (2 * i, 0, 0)
        by["paint"] = (0.1 * i, 0.5, 0.9)
        bpy.context.scene.collection.objects.link(by)


def instanced_by_particles(obj, n):
    by = points(n, "Particles")
    settings = by.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system.settings
    settings.emit_from, settings.count, settings.use_emit_random = "VERT", n, False
    settings.frame_start = settings.frame_end = 1
    settings.lifetime, settings.normal_factor, settings.effector_weights.gravity = 99, 0, 0
    settings.render_type, settings.instance_object, settings.particle_size = "OBJECT", obj, 1
    settings["paint"] = (0.3, 0.6, 0.9)
    bpy.context.scene.frame_set(1)


def ours(n, warnings=None):
    """What the tiles 2 m apart emit, (n, 3)."""
    scene = scenes.extracted(warnings)
    third = np.full(scene.n_triangles, 1 / 3, np.float32)
    triangles = np.arange(scene.n_triangles)
    tile_of = np.rint(scene.points(triangles, third, third)[:, 0] / 2).astype(int)
    emission = scene.look_up(scene.materials.emission, triangles, third, third)
    return np.stack([emission[tile_of == i].mean(axis=0) for i in range(n)])


def cycles(n, tmp_path):
    """What Cycles renders of them, (n, 3)."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 16
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", 2.0 * n
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = (n - 1, 0, 5)
    scene.collection.objects.link(scene.camera)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 4 * n, 4, 100
    render.filepath = str(tmp_path / "tiles.exr")
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.cycles.pixel_filter_type, scene.cycles.use_denoising = "BOX", False
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    pixels = np.empty(16 * n * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(4, n, 4, -1)[1:3, :, 1:3, :3].mean(axis=(0, 2))


def assert_as_cycles(n, tmp_path, differ=True):
    values = ours(n)
    expected = cycles(n, tmp_path)
    np.testing.assert_allclose(values, expected, atol=2e-3)
    assert not differ or np.ptp(expected, axis=0).max() > 0.01


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("output", ["Random", "Location", "Color", "Alpha", "Object Index", "Material Index"])
def test_object_info(output, noise, tmp_path):
    material = glowing("ObjectInfo", output, noise)
    material.pass_index = 3
    for i in range(3):
        obj = tile(f"Tile{'ä' * i}", material, 2 * i)
        obj.color, obj.pass_index = (0.2 * i, 0.5, 0.9, 0.3 * i), i
    assert_as_cycles(3, tmp_path, differ=output != "Material Index")


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("output", ["Random", "Location", "Color"])
@pytest.mark.parametrize("instanced", [instanced_by_nodes, instanced_by_points, instanced_by_collections])
def test_object_info_of_instances(instanced, output, noise, tmp_path):
    obj = tile("Tile", glowing("ObjectInfo", output, noise))
    obj.color = (0.2, 0.4, 0.6, 1)
    instanced(obj, 3)
    assert_as_cycles(3, tmp_path, differ=output != "Color")


@pytest.mark.parametrize("output", ["Color", "Vector", "Fac", "Alpha"])
def test_attributes_of_instances(output, tmp_path):
    material = glowing("Attribute", output, attribute_type="INSTANCER", attribute_name="paint")
    instanced_by_nodes(tile("Tile", material), 3, "paint")
    assert_as_cycles(3, tmp_path, differ=output != "Alpha")


@pytest.mark.parametrize("instanced", [instanced_by_collections, instanced_by_points, instanced_by_particles])
def test_attributes_of_instancers(instanced, tmp_path):
    obj = tile("Tile", glowing("Attribute", attribute_type="INSTANCER", attribute_name="paint"))
    instanced(obj, 2)
    assert_as_cycles(2, tmp_path, differ=instanced == instanced_by_collections)
    assert ours(2).any() == (instanced != instanced_by_points)


@pytest.mark.parametrize("kind", ["INSTANCER", "OBJECT"])
@pytest.mark.parametrize("on", ["instancer", "object", "mesh", "nothing"])
def test_attributes_of_objects(on, kind, tmp_path):
    obj = tile("Tile", glowing("Attribute", "Color", attribute_type=kind, attribute_name='the "paint"'))
    by = instanced_by_nodes(obj, 2)
    owner = {"instancer": by, "object": obj, "mesh": obj.data}.get(on)
    if owner is not None:
        owner['the "paint"'] = (0.3, 0.6, 0.9)
    values = ours(2)
    np.testing.assert_allclose(values, cycles(2, tmp_path), atol=1e-3)
    assert values.any() == (on in {"object", "mesh"} or (on, kind) == ("instancer", "INSTANCER"))


@pytest.mark.parametrize("name", ["paint", "frame_current", "world.color", "nothing"])
@pytest.mark.parametrize("on", ["layer", "scene", "world"])
@pytest.mark.parametrize("noise", [False, True])
def test_attributes_of_the_view_layer(name, on, noise, tmp_path):
    if on != "layer" and name != "paint":
        pytest.skip("asked already")
    tile("Tile", glowing("Attribute", "Color", noise, attribute_type="VIEW_LAYER", attribute_name=name), 0)
    scenes.set_world((0.5, 0.25, 0.125), 0)
    scene = bpy.context.scene
    scene.frame_current, scene.world.color = 3, (0.1, 0.2, 0.3)
    owner = {"layer": bpy.context.view_layer, "scene": scene, "world": scene.world}[on]
    owner["paint"] = 0.7 if on == "scene" else (0.3, 0.6)
    assert_as_cycles(1, tmp_path, differ=False)


def test_attributes_of_the_view_layer_in_a_world():
    background = scenes.set_world((1, 1, 1), 2)
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "VIEW_LAYER", "sky"
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    for sky in ((0.1, 0.2, 0.3), (0.3, 0.2, 0.1)):
        bpy.context.scene["sky"] = sky
        np.testing.assert_allclose(scenes.extracted().world.color, np.multiply(sky, 2), rtol=1e-5)
    gradient = tree.nodes.new("ShaderNodeMixRGB")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], gradient.inputs[2])
    gradient.inputs[0].default_value = 0
    tree.links.new(node.outputs["Color"], gradient.inputs[1])
    tree.links.new(gradient.outputs[0], background.inputs["Color"])
    for sky in ((0.1, 0.2, 0.3), (0.3, 0.2, 0.1)):  # a picture by Cycles, kept no longer than it is right
        bpy.context.scene["sky"] = sky
        np.testing.assert_allclose(scenes.extracted().world.color, np.multiply(sky, 2), rtol=1e-3)


def test_picture_times_what_is_read():
    """Each object has its own share of a picture."""
    material, surface = scenes.add_material("Glow", "ShaderNodeEmission")
    tree = material.node_tree
    mix, info = tree.nodes.new("ShaderNodeMixRGB"), tree.nodes.new("ShaderNodeObjectInfo")
    mix.blend_type, mix.inputs[0].default_value = "MULTIPLY", 1
    scenes.add_image_node(material, mix.inputs[1], np.full((2, 2, 4), 0.5), byte=False).interpolation = "Closest"
    tree.links.new(info.outputs["Color"], mix.inputs[2])
    tree.links.new(mix.outputs[0], surface.inputs["Color"])
    for i in range(2):
        tile(f"Tile{i}", material, 2 * i).color = (0.2 + 0.6 * i, 0.4, 0.4, 1)
    np.testing.assert_allclose(ours(2), [[0.1, 0.2, 0.2], [0.4, 0.2, 0.2]], atol=1e-3)


def test_very_many_values_are_grouped():
    warnings = []
    obj = tile("Tile", glowing("ObjectInfo", "Random"))
    instanced_by_nodes(obj, 200)
    scene = scenes.extracted(warnings)
    assert len(scene.materials) == 64 and scene.n_triangles == 400
    values = scene.materials.emission.value[scene.material_of_triangle[::2], 0]
    assert values.mean() == pytest.approx(0.5, abs=0.06)
    assert len(warnings) == 1 and "'Tile'" in warnings[0] and "64 groups" in warnings[0]


def test_groups_keep_the_mean():
    values = np.random.default_rng(1).uniform(0, 1, (1000, 4)).astype(np.float32)
    group, of_group = groups_of_instances(values, 16)
    assert of_group.shape == (16, 4) and np.bincount(group).min() >= 62
    np.testing.assert_allclose(of_group[group].mean(axis=0), values.mean(axis=0), rtol=1e-5)
    assert np.abs(of_group[group][:, 0] - values[:, 0]).max() < 0.1
    group, of_group = groups_of_instances(np.repeat(values[:3], 5, axis=0), 16)
    np.testing.assert_array_equal(of_group[group], np.repeat(values[:3], 5, axis=0))
