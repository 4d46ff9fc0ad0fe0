"""Image nodes that are evaluated without Cycles, compared with Cycles."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials import cycles_bake
from photon_bake.tests.host import scenes
from photon_bake.tests.host.node_pictures import (
    PICTURES,
    assert_as_cycles,
    emission_by_cycles,
    emission_of_faces,
    emitter,
    picture,
)
from photon_bake.tests.host.test_extract_materials import quads

pytestmark = pytest.mark.usefixtures("empty_cache")


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("vector_type", ["POINT", "TEXTURE", "VECTOR"])
def test_extension_and_mapping(extension, vector_type):
    material, color = emitter()
    tree = material.node_tree
    mix, mapping, uv = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixRGB", "Mapping", "UVMap"))
    mix.inputs["Color1"].default_value = (0.1, 0.2, 0.9, 1)
    image = picture(material, mix.inputs["Color2"], alpha=0.75)
    image.extension = extension
    mapping.vector_type = vector_type
    if vector_type != "VECTOR":
        mapping.inputs["Location"].default_value = (-0.37, 0.81, 0)
    mapping.inputs["Rotation"].default_value = (0.3, 0, 0.4)
    mapping.inputs["Scale"].default_value = (2.1, 1.7, 1)
    for start, end in ((uv, mapping.inputs["Vector"]), (mapping, image.inputs["Vector"]), (mix, color)):
        tree.links.new(start.outputs[0], end)
    tree.links.new(image.outputs["Alpha"], mix.inputs[0])
    assert_as_cycles(material)


@pytest.mark.parametrize("vector_type", ["POINT", "TEXTURE", "VECTOR", "NORMAL"])
def test_texture_mapping_of_the_node(vector_type):
    material, color = emitter()
    image = picture(material, color)
    mapping = image.texture_mapping
    mapping.vector_type = vector_type
    mapping.translation, mapping.rotation, mapping.scale = (-0.37, 0.81, 0), (0.3, 0, 0.4), (2.1, 1.7, 1)
    mapping.mapping_x, mapping.mapping_y = "Y", "X"
    uv = material.node_tree.nodes.new("ShaderNodeMapping")
    uv.inputs["Rotation"].default_value = (0, 0, 0.5)
    material.node_tree.links.new(material.node_tree.nodes.new("ShaderNodeUVMap").outputs[0], uv.inputs["Vector"])
    material.node_tree.links.new(uv.outputs[0], image.inputs["Vector"])
    assert_as_cycles(material, bakes=vector_type == "NORMAL")


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE", "EDGE"])
@pytest.mark.parametrize("data_type", ["FLOAT2", "FLOAT_VECTOR", "FLOAT_COLOR", "FLOAT", "INT"])
def test_attributes_as_uv_maps(data_type, domain):
    if data_type == "FLOAT2" and domain == "CORNER":
        pytest.skip("that is a UV map")
    material, color = emitter()
    image = picture(material, color)
    uv = material.node_tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "Place"
    material.node_tree.links.new(uv.outputs[0], image.inputs["Vector"])
    obj = quads(material)
    place = obj.data.attributes.new("Place", data_type, domain)
    prop, width = {"FLOAT2": ("vector", 2), "FLOAT_VECTOR": ("vector", 3), "FLOAT_COLOR": ("color", 4)}.get(
        data_type, ("value", 1)
    )
    kind = np.int32 if data_type == "INT" else np.float32
    # The same for all elements of a quad, in the middles of texels
    corners = np.random.default_rng(3).integers(0, 4, (16, width)) * 0.25 + 0.125
    of_quad = {"POINT": 4, "CORNER": 4, "FACE": 1, "EDGE": 4}[domain]
    place.data.foreach_set(prop, np.repeat(corners, of_quad, axis=0).astype(kind).ravel())
    ours = emission_of_faces(scenes.extracted())
    assert not cycles_bake._baked
    np.testing.assert_allclose(ours, emission_by_cycles(obj).reshape(-1, 4, 3).mean(1), atol=2e-3)


def test_bytes_of_other_spaces_are_read_by_cycles():
    material, color = emitter()
    node = scenes.add_image_node(material, color, PICTURES[0])
    node.image.colorspace_settings.name = "Filmic sRGB"
    assert_as_cycles(material, bakes=True)


@pytest.mark.parametrize("stored", ["8 bits", "16 bits in a file", "floats"])
def test_srgb_between_texels(stored, tmp_path):
    """Bytes and files of 16 bits are interpolated with sRGB's curve, floats without."""
    material, color = emitter()
    pixels = PICTURES[0][:1, 1:3].copy()
    pixels[0, :, :3] = [[0, 0.1, 0.2], [1, 0.9, 0.3]]
    node = scenes.add_image_node(material, color, pixels, byte=stored == "8 bits")
    node.interpolation = "Linear"
    if stored == "16 bits in a file":
        scene, path = bpy.context.scene, str(tmp_path / "deep.png")
        settings = scene.render.image_settings
        settings.file_format, settings.color_depth = "PNG", "16"
        scene.view_settings.view_transform = "Standard"
        node.image.save_render(path, scene=scene)
        node.image = bpy.data.images.load(path)
        assert node.image.is_float
    obj = quads(material, 16)
    ours = emission_of_faces(scenes.extracted())
    cycles = emission_by_cycles(obj).reshape(-1, 4, 3).mean(1)
    np.testing.assert_allclose(ours, cycles, atol=0.02)  # the other way round they are 0.2 apart


@pytest.mark.parametrize("interpolation", ["Linear", "Cubic", "Smart"])
@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_interpolation_of_small_pictures(interpolation, extension):
    material, color = emitter()
    tree = material.node_tree
    image = picture(material, color)
    image.interpolation, image.extension = interpolation, extension
    mapping, uv = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeUVMap")
    mapping.inputs["Location"].default_value = (-0.37, 0.21, 0)
    mapping.inputs["Scale"].default_value = (1.5, 0.7, 1)
    tree.links.new(uv.outputs[0], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], image.inputs["Vector"])
    obj = quads(material)
    ours = emission_of_faces(scenes.extracted())
    cycles = emission_by_cycles(obj).reshape(-1, 4, 3).mean(1)
    np.testing.assert_allclose(ours, cycles, atol=0.02)
    assert bool(cycles_bake._baked) == (extension == "CLIP")  # which fades out a little outside


def test_pictures_of_different_sizes():
    material, color = emitter()
    node = material.node_tree.nodes.new("ShaderNodeMixRGB")
    picture(material, node.inputs[1])
    small = scenes.add_image_node(material, node.inputs[2], PICTURES[1][:2, :2], byte=False)
    small.image.colorspace_settings.name = "Non-Color"
    material.node_tree.links.new(node.outputs[0], color)
    assert_as_cycles(material)


@pytest.mark.parametrize("difference", ["uv_map", "extension", "mapping"])
def test_pictures_that_share_no_grid_are_baked(difference):
    material, color = emitter()
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixRGB")
    _, other = (picture(material, mix.inputs[1 + i], i) for i in range(2))
    tree.links.new(mix.outputs[0], color)
    uv = tree.nodes.new("ShaderNodeUVMap")
    tree.links.new(uv.outputs[0], other.inputs["Vector"])
    if difference == "uv_map":
        uv.uv_map = "Missing"
    elif difference == "extension":
        other.extension = "CLIP"
    else:
        mapping = tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = (3, 3, 3)
        tree.links.new(uv.outputs[0], mapping.inputs[0])
        tree.links.new(mapping.outputs[0], other.inputs["Vector"])
    obj = quads(material)
    warnings = []
    ours = emission_of_faces(scenes.extracted(warnings))
    np.testing.assert_allclose(ours, emission_by_cycles(obj).reshape(-1, 4, 3).mean(1), atol=5e-3)
    assert not warnings
