"""Baked light shown in materials, and taken out again."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.nodes import SHOWN
from photon_bake.addon.output.lightmap import write_lightmap

from .lightmap_scenes import add_room, bake
from .scenes import add_cube, add_material


def dump(tree):
    """All that a node tree says: nodes with their settings and sockets, and links."""
    nodes = {}
    for node in tree.nodes:
        sockets = [(s.identifier, value_of(s), s.hide) for s in [*node.inputs, *node.outputs]]
        settings = {
            name: repr(getattr(node, name))
            for name in node.bl_rna.properties.keys()  # noqa: SIM118
            if name not in {"inputs", "outputs", "internal_links", "rna_type"}
        }
        nodes[node.name] = (settings, sockets, sorted(node.keys()))
    links = sorted(
        (a.from_node.name, a.from_socket.identifier, a.to_node.name, a.to_socket.identifier, a.is_muted)
        for a in tree.links
    )
    return nodes, links, tree.nodes.active.name if tree.nodes.active else None


def value_of(socket):
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def dump_all():
    trees = {m.name: dump(m.node_tree) for m in bpy.data.materials if m.node_tree}
    groups = {g.name: dump(g) for g in bpy.data.node_groups}
    sampling = {m.name: m.cycles.emission_sampling for m in bpy.data.materials}
    owned = [{one.name: sorted(one.keys()) for one in blocks} for blocks in (bpy.data.objects, bpy.data.materials)]
    return trees, groups, sampling, owned


@pytest.fixture
def materials(empty_scene):
    """A plain material; one that mixes two shaders of a textured colour; one whose shader is in a group."""
    add_room()
    plain, shader = add_material("Plain")
    shader.inputs["Base Color"].default_value = (0.5, 0.25, 0.125, 1)
    mixed, diffuse = add_material("Mixed", "ShaderNodeBsdfDiffuse")
    tree = mixed.node_tree
    colour, mix, glossy = (
        tree.nodes.new(kind) for kind in ("ShaderNodeRGB", "ShaderNodeMixShader", "ShaderNodeBsdfGlossy")
    )
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(colour.outputs[0], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], mix.inputs[1])
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    grouped, unused = add_material("Grouped")
    tree = grouped.node_tree
    tree.nodes.remove(unused)
    group = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
    group.interface.new_socket("Shader", socket_type="NodeSocketShader", in_out="OUTPUT")
    inner, end = group.nodes.new("ShaderNodeBsdfDiffuse"), group.nodes.new("NodeGroupOutput")
    group.links.new(inner.outputs[0], end.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    bpy.data.objects["Floor"].data.materials.append(mixed)
    bpy.data.objects["Box"].data.materials.append(plain)
    add_cube("Second", material=grouped).location = (2.5, 2, 1)
    return plain, mixed, grouped


def test_nothing_is_left_behind(materials, tmp_path):
    bake(tmp_path)
    before = dump_all()
    assert bpy.ops.photon_bake.use_baked_light() == {"FINISHED"}
    assert dump_all() != before
    for material in materials:
        assert any(SHOWN in node for node in material.node_tree.nodes) or material.name == "Grouped"
    assert any(SHOWN in node for node in bpy.data.node_groups["Inside"].nodes)
    bpy.ops.photon_bake.use_baked_light()  # twice is once
    assert bpy.ops.photon_bake.leave_baked_light() == {"FINISHED"}
    assert dump_all() == before


@pytest.mark.parametrize(
    "settings", [{}, {"atlas": "shared"}, {"file_format": "rgbm"}, {"file_format": "rgbd"}], ids=str
)
def test_a_render_shows_base_colour_times_lightmap(materials, tmp_path, settings):
    bake(tmp_path, **settings)
    scene = bpy.context.scene
    for obj in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    for image in bpy.data.images:
        paint(image, 0.25 if "Box" in image.name else 0.5)
    bpy.ops.photon_bake.use_baked_light()
    light = 0.5 if "atlas" in settings else 0.25
    assert rendered("Box") == pytest.approx((light * 0.5, light * 0.25, light * 0.125), rel=0.02)


def paint(image, value):
    """Give all texels of a lightmap's file one value."""
    width, height = image.size
    texels = np.full((height, width, 3), value, np.float32)
    write_lightmap(Path(bpy.path.abspath(image.filepath)), texels, image["lightmap_encoding"], image["lightmap_range"])
    image.reload()


def rendered(name):
    """The colour of the top of an object of the scene, as Cycles sees it from above."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    obj = bpy.data.objects[name]
    camera.location, camera.data.type, camera.data.ortho_scale = (*obj.location[:2], 10), "ORTHO", 1.0
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 4, False, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = bpy.app.tempdir + "render.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath, check_existing=False)
    pixels = np.empty(8 * 8 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return tuple(pixels.reshape(-1, 4)[:, :3].mean(axis=0))


def test_what_is_shown_is_not_baked_again(materials, tmp_path):
    """The camera alone sees it, so light does not; also where it shows more than there is."""
    _, before = bake(tmp_path)
    bpy.ops.photon_bake.use_baked_light()
    for image in bpy.data.images:
        paint(image, 100.0)
    _, after = bake(tmp_path)
    for one, other in zip(before.products[0].images, after.products[0].images, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-5)
