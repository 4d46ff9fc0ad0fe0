"""Materials, image textures and the world, compared with what Cycles reads."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials.pictures.texels import MAX_SIDE, StoredImage
from photon_bake.addon.emitters.mesh import radiance_of
from photon_bake.addon.scene import RayKind
from photon_bake.tests.host import scenes

CHECK = np.random.default_rng(3).uniform(0.1, 1, (2, 2, 4))
CHECK[..., 3] = 1


def extract(warnings=None):
    return scenes.extracted(warnings)


def quads(obj_material, n=4):
    """n × n small quads with a UV map, each over a texel's middle of an n × n picture."""
    centres = (np.arange(n) + 0.5) / n
    # The quads are smaller than texels even where a node magnifies them.
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * 0.002 / n
    uv = np.array([np.add((x, y), corner) for y in centres for x in centres for corner in corners])
    positions = np.column_stack([uv, np.zeros(len(uv))])
    obj = scenes.add_mesh("Quads", positions, np.arange(len(uv)).reshape(-1, 4), obj_material)
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.ravel())
    return obj


def albedo_of_faces(scene):
    """Albedo at the middle of every second triangle, one a quad."""
    triangles = np.arange(0, scene.n_triangles, 2)
    third = np.full(len(triangles), 1 / 3)
    return scene.albedo(triangles, third, third)


def assert_as_cycles(obj, tolerance=2e-3):
    scene = extract()
    cycles = scenes.cycles_bake(obj, "COLOR", samples=1).reshape(-1, 4, 3).mean(1)
    np.testing.assert_allclose(albedo_of_faces(scene), cycles, atol=tolerance)


@pytest.mark.parametrize("node", ["ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse"])
def test_constant_colour(node):
    material, surface = scenes.add_material(node=node)
    surface.inputs[0].default_value = (0.7, 0.2, 0.1, 1)
    obj = quads(material)
    np.testing.assert_allclose(scenes.albedo_of(extract().materials), [[0.7, 0.2, 0.1]], atol=1e-6)
    assert_as_cycles(obj)


def test_colour_from_an_rgb_node():
    material, surface = scenes.add_material()
    rgb = material.node_tree.nodes.new("ShaderNodeRGB")
    rgb.outputs[0].default_value = (0.1, 0.6, 0.3, 1)
    material.node_tree.links.new(rgb.outputs[0], surface.inputs["Base Color"])
    assert_as_cycles(quads(material))


@pytest.mark.parametrize("byte", [True, False])
@pytest.mark.parametrize("through_reroute", [True, False])
def test_image(byte, through_reroute):
    material, surface = scenes.add_material(node="ShaderNodeBsdfDiffuse")
    picture = np.random.default_rng(4).uniform(0, 1, (4, 4, 4))
    picture[..., 3] = 1
    scenes.add_image_node(material, surface.inputs["Color"], picture, byte, through_reroute)
    assert_as_cycles(quads(material))


def test_image_that_is_not_colour():
    material, surface = scenes.add_material(node="ShaderNodeBsdfDiffuse")
    node = scenes.add_image_node(material, surface.inputs["Color"], CHECK)
    node.image.colorspace_settings.name = "Non-Color"
    assert_as_cycles(quads(material))


@pytest.mark.parametrize("alpha_is_used", [True, False])
@pytest.mark.parametrize("mode", ["STRAIGHT", "CHANNEL_PACKED", "NONE"])
def test_transparent_texels(mode, alpha_is_used):
    material, surface = scenes.add_material()
    surface.inputs["Specular IOR Level"].default_value = 0
    node = scenes.add_image_node(material, surface.inputs["Base Color"], np.array([[[0.8, 0.5, 0.3, 0.5]]]))
    node.image.alpha_mode = mode
    if alpha_is_used:
        tree = material.node_tree
        tree.links.new(node.outputs["Alpha"], surface.inputs["Roughness"])
    assert_as_cycles(quads(material), tolerance=8e-3)  # Cycles divides 8-bit colours by alpha


def test_uv_map_by_name_and_the_one_active_for_rendering():
    material, surface = scenes.add_material(node="ShaderNodeBsdfDiffuse")
    node = scenes.add_image_node(material, surface.inputs["Color"], CHECK)
    obj = quads(material)
    first = np.empty(len(obj.data.loops) * 2, np.float32)
    obj.data.uv_layers[0].uv.foreach_get("vector", first)
    second = obj.data.uv_layers.new(name="Other")
    second.uv.foreach_set("vector", 1 - first)
    third = obj.data.uv_layers.new(name="Third")
    third.uv.foreach_set("vector", first * 0)
    third.active_render = True
    tree = material.node_tree
    np.testing.assert_allclose(extract().corner_uvs, 0)
    uv_map = tree.nodes.new("ShaderNodeUVMap")
    uv_map.uv_map = "Other"
    tree.links.new(uv_map.outputs[0], node.inputs["Vector"])
    assert_as_cycles(obj)


def test_mapping_node():
    material, surface = scenes.add_material(node="ShaderNodeBsdfDiffuse")
    node = scenes.add_image_node(material, surface.inputs["Color"], CHECK)
    tree = material.node_tree
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Location"].default_value = (0.2, 0.3, 0)
    mapping.inputs["Rotation"].default_value = (0, 0, 0.6)
    mapping.inputs["Scale"].default_value = (2, -1.5, 1)
    tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    assert_as_cycles(quads(material, n=5))


def test_mesh_without_uv_map():
    material, surface = scenes.add_material(node="ShaderNodeBsdfDiffuse")
    scenes.add_image_node(material, surface.inputs["Color"], CHECK)
    obj = quads(material)
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    assert_as_cycles(obj)


def test_slots_of_faces_and_of_objects():
    red, surface = scenes.add_material("Red")
    surface.inputs[0].default_value = (1, 0, 0, 1)
    blue, surface = scenes.add_material("Blue")
    surface.inputs[0].default_value = (0, 0, 1, 1)
    obj = quads(red)
    obj.data.materials.append(None)
    obj.data.polygons.foreach_set("material_index", np.arange(16, dtype=np.int32) % 4)
    obj.material_slots[1].link = "OBJECT"
    obj.material_slots[1].material = blue
    assert_as_cycles(obj)
    assert set(extract().materials.names) == {"Red", "Blue"}


@pytest.mark.parametrize("procedural", [False, True])
def test_local_and_linked_materials_of_one_name(tmp_path, procedural):
    def paint(color):
        material, surface = scenes.add_material("Paint", "ShaderNodeBsdfDiffuse")
        rgb = material.node_tree.nodes.new("ShaderNodeRGB")
        rgb.outputs[0].default_value = color
        if procedural:  # one colour, but only Cycles knows
            noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
            noise.inputs["Detail"].default_value = 0
            mix = material.node_tree.nodes.new("ShaderNodeMixRGB")
            mix.inputs[0].default_value = 1
            material.node_tree.links.new(noise.outputs[0], mix.inputs[1])
            material.node_tree.links.new(rgb.outputs[0], mix.inputs[2])
            rgb = mix
        material.node_tree.links.new(rgb.outputs[0], surface.inputs["Color"])
        return material

    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {paint((0.1, 0.2, 0.7, 1))})
    bpy.data.materials.remove(bpy.data.materials["Paint"])
    with bpy.data.libraries.load(path, link=True) as (_, here):
        here.materials = ["Paint"]
    scenes.add_cube("Linked", material=here.materials[0])
    scenes.add_cube("Local", material=paint((0.8, 0.3, 0.1, 1)))
    np.testing.assert_allclose(albedo_of_faces(extract())[[0, -1]], [[0.1, 0.2, 0.7], [0.8, 0.3, 0.1]], atol=1e-4)


def test_emission():
    emitter, node = scenes.add_material("Emitter", "ShaderNodeEmission")
    node.inputs["Color"].default_value, node.inputs["Strength"].default_value = (1, 0.5, 0.25, 1), 4
    glowing, node = scenes.add_material("Glowing")
    node.inputs["Emission Color"].default_value, node.inputs["Emission Strength"].default_value = (0, 1, 0, 1), 3
    scenes.add_cube("A", material=emitter)
    scenes.add_cube("B", material=glowing)
    materials = extract().materials
    np.testing.assert_allclose(materials.emission.value, [[4, 2, 1], [0, 3, 0]])
    np.testing.assert_allclose(scenes.albedo_of(materials)[0], 0)


def test_emission_is_radiance():
    """A small far emitter against Cycles: E/π = L · area / (π d²)."""
    material, node = scenes.add_material("Emitter", "ShaderNodeEmission")
    node.inputs["Strength"].default_value = 1000
    scenes.add_plane("Emitter", 0.1, material=material).location = (0, 0, 10)
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    scene = extract()
    radiance = scene.materials.emission.value[scene.material_of_triangle[0], 0]
    expected = radiance * 0.1**2 / 10**2 / np.pi
    assert scenes.cycles_bake(floor, "DIRECT").mean() == pytest.approx(expected, rel=0.01)


def test_emission_texture():
    material, node = scenes.add_material("Screen")
    node.inputs["Emission Strength"].default_value = 2
    image = scenes.add_image_node(material, node.inputs["Emission Color"], CHECK, byte=False)
    image.image.colorspace_settings.name = "Non-Color"
    quads(material, 2)
    scene = extract()
    triangle, third = np.arange(0, scene.n_triangles, 2), np.full(4, 1 / 3, np.float32)
    np.testing.assert_allclose(
        radiance_of(scene.arrays, triangle, third, third), CHECK.reshape(4, 4)[:, :3] * 2, rtol=1e-3
    )


def test_emission_texture_without_strength_is_not_read(tmp_path):
    material, node = scenes.add_material("Screen")
    node.inputs["Emission Strength"].default_value = 0
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs["Color"], node.inputs["Emission Color"])
    quads(material)
    assert not len(extract().materials.textures.width)


def test_shader_that_is_not_known_is_diffuse_and_warns_once():
    material, surface = scenes.add_material("Door", "ShaderNodeBsdfRayPortal")
    surface.inputs["Color"].default_value = (0.3, 0.2, 0.1, 1)
    scenes.add_cube("A", material=material)
    scenes.add_cube("B", material=material)
    warnings = []
    np.testing.assert_allclose(scenes.albedo_of(extract(warnings).materials), [[0.3, 0.2, 0.1]], atol=1e-6)
    assert warnings == ["Material 'Door': its Ray Portal BSDF is baked as diffuse."]


def test_surface_without_shader_is_black():
    material, surface = scenes.add_material()
    material.node_tree.nodes.remove(surface)
    scenes.add_cube(material=material)
    np.testing.assert_allclose(scenes.albedo_of(extract().materials), 0)


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="materials always have nodes there")
def test_material_without_nodes():
    material = bpy.data.materials.new("Old")
    material.diffuse_color = (0.3, 0.2, 0.1, 1)
    assert_as_cycles(quads(material))


def test_material_override():
    red, surface = scenes.add_material("Red")
    surface.inputs[0].default_value = (1, 0, 0, 1)
    bpy.context.view_layer.material_override = red
    scenes.add_cube()
    assert extract().materials.names == ("Red",)


def test_image_file_is_read_and_its_memory_given_back(tmp_path):
    material, surface = scenes.add_material("Wall", "ShaderNodeBsdfDiffuse")
    node = scenes.add_image_node(material, surface.inputs["Color"], CHECK)
    path = str(tmp_path / "bricks.png")
    node.image.filepath_raw, node.image.file_format = path, "PNG"
    node.image.save()
    node.image = bpy.data.images.load(path)
    obj = quads(material)
    assert_as_cycles(obj)


def test_reduction_keeps_the_mean():
    picture = np.random.default_rng(5).uniform(0, 1, (3, 2 * MAX_SIDE + 2 * 37, 4)).astype(np.float32)
    reduced = StoredImage(picture, False, False).shown("Closest", "REPEAT")
    assert reduced.shape == (3, MAX_SIDE, 4)
    np.testing.assert_allclose(reduced.mean((0, 1)), picture.mean((0, 1)), rtol=5e-3)


def test_world():
    assert not extract().world.color.any()
    scenes.set_world((0.5, 0.25, 0.125), 2)
    floor = scenes.add_plane("Floor", 1e-3, material=scenes.add_material(node="ShaderNodeBsdfDiffuse")[0])
    world = extract().world.color
    np.testing.assert_allclose(world, [1, 0.5, 0.25])
    # E/π under an unhidden sky of radiance L is L.
    np.testing.assert_allclose(scenes.cycles_bake(floor, "DIRECT", 256).mean(0), world, rtol=0.02)


def test_negative_world():
    """It takes light away, as in Cycles: of a lamp's, here."""
    background = scenes.set_world((0.5, 0.25, 0.125), -0.2)
    np.testing.assert_allclose(extract().world.color, [-0.1, -0.05, -0.025])
    tree = bpy.context.scene.world.node_tree
    gradient = tree.nodes.new("ShaderNodeTexGradient")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], gradient.inputs["Vector"])
    tree.links.new(gradient.outputs["Color"], background.inputs["Color"])
    picture = extract().world.image
    assert picture.max() <= 0 and picture.min() < -0.19


def test_world_that_diffuse_rays_do_not_see():
    scenes.set_world((1, 1, 1))
    bpy.context.scene.world.cycles_visibility.diffuse = False
    world = extract().world
    assert world.color.all() and world.hidden_from == {RayKind.DIFFUSE}
