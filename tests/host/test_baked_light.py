"""Baked light shown in materials, and taken out again."""

from pathlib import Path

import bpy
import numpy as np
import photon_bake
import pytest
from photon_bake.addon.blender.read.materials.nodes import SHOWN
from photon_bake.addon.blender.show import Layer, is_shown, leave_baked_light, set_levels, use_baked_light
from photon_bake.addon.blender.show.eevee_world import sky_share
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.lightmap import write_lightmap
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.command_line import command
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import VertexRequest

from .leftovers import differences, dump, handlers, snapshot
from .lightmap_scenes import QUICK, add_room, bake, prepare
from .scenes import add_cube, add_lamp, add_material, add_mesh, add_plane


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


def bake_all(folder, **settings):
    """Bake lightmaps and vertices with hardly any light; returns the light of both."""
    wanted = [LightmapRequest(LightmapSettings(**{"density": 4.0, **settings}), folder, "scene"), VertexRequest()]
    job = BakeJob.prepare(bpy.context, wanted, Progress())
    solved = job.solve(QUICK, Progress())
    job.write(solved, Progress())
    return solved.irradiance.value


def test_nothing_is_left_behind(materials, tmp_path):
    add_plane("Bare", size=1.0)  # has no material
    empty = snapshot(tmp_path)
    bake_all(tmp_path)
    before = snapshot(tmp_path)
    for _ in range(2):  # twice is once
        assert bpy.ops.photon_bake.use_baked_light() == {"FINISHED"}
    assert len(differences(before, snapshot(tmp_path))) > 5
    assert all(any(SHOWN in node for node in one.node_tree.nodes) for one in materials[:2])
    assert any(SHOWN in node for node in bpy.data.node_groups["Inside"].nodes)
    bpy.context.scene.photon_bake.shown.use = False
    bpy.context.scene.photon_bake.shown.use = True
    assert bpy.ops.photon_bake.leave_baked_light() == {"FINISHED"}
    assert differences(before, snapshot(tmp_path)) == []
    bpy.ops.photon_bake.use_baked_light()
    bpy.ops.photon_bake.remove_lightmaps(files=True)
    assert is_shown(bpy.context.scene)  # what vertices have
    bpy.ops.photon_bake.leave_baked_light()
    for mesh in bpy.data.meshes:
        mesh.attributes.remove(mesh.attributes["Indirect"])
        mesh.attributes.active_color_name = ""  # 5.2 keeps a name that is gone
    assert differences(empty, snapshot(tmp_path)) == []


def test_disabling_the_extension_leaves_no_handler(materials, tmp_path):
    photon_bake.unregister()
    try:
        without = handlers()
        photon_bake.register()
        bake_all(tmp_path)
        bpy.ops.photon_bake.use_baked_light()
        photon_bake.unregister()
        assert handlers() == without
        assert any(SHOWN in group for group in bpy.data.node_groups)  # renders go on showing the light
    finally:
        photon_bake.register()


def test_removing_lightmaps_leaves_chosen_uv_maps(empty_scene, tmp_path):
    add_room()
    bpy.data.objects["Box"].data.uv_layers.new(name="Mine")
    bake(tmp_path, names=["Floor"], uv_map="UVMap")
    bpy.ops.photon_bake.remove_lightmaps()
    assert [layer.name for layer in bpy.data.objects["Floor"].data.uv_layers] == ["UVMap"]
    assert len(list(tmp_path.iterdir())) == 1 and len(bpy.data.images) == 0
    assert "lightmap_image" not in bpy.data.objects["Floor"]


def test_a_uv_map_of_an_earlier_version_makes_way(empty_scene, tmp_path):
    add_room()
    floor = bpy.data.objects["Floor"]
    floor.data.uv_layers.new(name="Lightmap")
    floor["lightmap_uv_map"] = "Lightmap"
    bake(tmp_path)
    assert [layer.name for layer in floor.data.uv_layers] == ["UVMap", "Photon Bake"]


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


def rendered(name, samples=4):
    """The colour of the top of an object of the scene, as Cycles sees it from above."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    obj = bpy.data.objects[name]
    camera.location, camera.data.type, camera.data.ortho_scale = (*obj.location[:2], 10), "ORTHO", 1.0
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = samples, False, "CPU"
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
    """A bake reads materials as if nothing were shown, also where more is shown than there is, and no bounces."""
    before = bake_all(tmp_path)
    for image in bpy.data.images:
        paint(image, 100.0)
    bpy.ops.photon_bake.use_baked_light()
    np.testing.assert_array_equal(bake_all(tmp_path), before)


def add_lit(name="Lit", value=(0.5, 0.25, 0.125), material=None):
    """A plane whose vertices have a light."""
    obj = add_plane(name, material=material)
    light = obj.data.attributes.new("Indirect", "FLOAT_COLOR", "POINT")
    light.data.foreach_set("color", [*value, 1.0] * 4)
    return obj


def darken():
    """A black world."""
    bpy.context.scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0, 0):
        bpy.context.scene.world.use_nodes = True
    node = next(node for node in bpy.context.scene.world.node_tree.nodes if node.type == "BACKGROUND")
    node.inputs["Strength"].default_value = 0
    return node


@pytest.mark.parametrize(
    ("node", "inputs", "share"),
    [
        ("Principled", {"Base Color": (0.5, 0.5, 0.5, 1)}, 0.5),
        ("Principled", {"Base Color": (0.5, 0.5, 0.5, 1), "Metallic": 0.25, "Alpha": 0.5}, 0.1875),
        ("Principled", {"Base Color": (1, 1, 1, 1), "Transmission Weight": 0.75}, 0.25),
        ("Diffuse", {"Color": (0.4, 0.4, 0.4, 1)}, 0.4),
        ("Translucent", {"Color": (0.4, 0.4, 0.4, 1)}, 0.4),
        ("Glossy", {"Color": (0.4, 0.4, 0.4, 1)}, 0.0),
    ],
)
def test_shaders_show_what_they_scatter(empty_scene, node, inputs, share):
    darken()
    material, shader = add_material(node=f"ShaderNodeBsdf{node}")
    for name, value in inputs.items():
        shader.inputs[name].default_value = value
    add_lit(material=material)
    use_baked_light(bpy.context.scene, strength=2.0)
    assert rendered("Lit") == pytest.approx(np.array([1.0, 0.5, 0.25]) * share, rel=0.03, abs=1e-6)


def test_what_has_no_material_shows_it_in_grey(empty_scene):
    darken()
    add_lit()
    use_baked_light(bpy.context.scene)
    assert rendered("Lit") == pytest.approx((0.4, 0.2, 0.1), rel=0.01)


@pytest.mark.parametrize("turned", [0.0, 1.2])
def test_principled_keeps_back_what_its_gloss_reflects(empty_scene, turned):
    """Cycles' own diffuse part under a world of radiance 1, against light of 1 everywhere."""
    world = darken()
    world.inputs["Color"].default_value, world.inputs["Strength"].default_value = (1, 1, 1, 1), 1
    material, shader = add_material()
    shader.inputs["Base Color"].default_value = (0.8, 0.8, 0.8, 1)
    shader.inputs["Specular IOR Level"].default_value, shader.inputs["Roughness"].default_value = 0.5, 0.4
    obj = add_lit(value=(1, 1, 1), material=material)
    obj.scale, obj.rotation_euler.x = (9, 9, 9), turned
    bpy.context.scene.cycles.diffuse_bounces = bpy.context.scene.cycles.max_bounces = 0
    whole = rendered("Lit", 256)[0]
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    gloss = rendered("Lit", 256)[0]
    shader.inputs["Base Color"].default_value = (0.8, 0.8, 0.8, 1)
    world.inputs["Strength"].default_value = 0
    use_baked_light(bpy.context.scene)
    assert rendered("Lit")[0] == pytest.approx(whole - gloss, rel=0.04)


def test_levels_are_live(empty_scene):
    scene = bpy.context.scene
    darken()
    obj = add_lit()
    other = obj.data.attributes.new("Lamp", "FLOAT_COLOR", "POINT")
    other.data.foreach_set("color", [1.0, 1.0, 1.0, 1.0] * 4)
    bounces = scene.cycles.diffuse_bounces
    use_baked_light(scene, [Layer(), Layer("Lamp", "Lamp", "lightmap_image_lamp", 0.0)])
    assert scene.cycles.diffuse_bounces == 0 and rendered("Lit") == pytest.approx((0.4, 0.2, 0.1), rel=0.01)
    set_levels(scene, [Layer(strength=0.5), Layer("Lamp", "Lamp", "", 0.25, (1.0, 0.0, 0.0))], strength=2.0)
    assert rendered("Lit") == pytest.approx((0.8, 0.2, 0.1), rel=0.01)
    set_levels(scene, [Layer()], shows=False)
    assert scene.cycles.diffuse_bounces == bounces and rendered("Lit") == (0, 0, 0)
    leave_baked_light()


def test_what_is_shown_follows_materials(empty_scene):
    """A base color that is changed, or linked, while light is shown."""
    darken()
    material, shader = add_material(node="ShaderNodeBsdfDiffuse")
    add_lit(value=(1, 1, 1), material=material)
    use_baked_light(bpy.context.scene)
    shader.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
    bpy.context.view_layer.update()
    assert rendered("Lit") == pytest.approx((0.1, 0.2, 0.3), rel=0.01)
    color = material.node_tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.3, 0.2, 0.1, 1)
    material.node_tree.links.new(color.outputs[0], shader.inputs["Color"])
    bpy.context.view_layer.update()
    assert rendered("Lit") == pytest.approx((0.3, 0.2, 0.1), rel=0.01)


def test_faces_keep_the_numbers_of_slots_that_there_are_not(empty_scene):
    obj = add_lit()
    obj.data.attributes.new("material_index", "INT", "FACE").data[0].value = 3
    before = snapshot()
    use_baked_light(bpy.context.scene)
    leave_baked_light()
    assert differences(before, snapshot()) == [] and obj.data.attributes["material_index"].data[0].value == 3


def test_no_lamps_are_made_of_what_is_shown(empty_scene):
    plain, _ = add_material("Plain")
    shining, shader = add_material("Shining")
    shader.inputs["Emission Strength"].default_value = 1
    for name, material in (("One", plain), ("Two", shining)):
        add_lit(name, material=material)
    use_baked_light(bpy.context.scene)
    assert plain.cycles.emission_sampling == "NONE" and shining.cycles.emission_sampling == "AUTO"


def test_forty_objects_with_images_of_their_own(empty_scene, tmp_path):
    """One material reads all of them by one image node, which takes two of EEVEE's 32 samplers."""
    darken()
    material, shader = add_material()
    shader.inputs["Base Color"].default_value = (1, 1, 1, 1)
    for i in range(40):
        add_plane(f"Plane {i}", size=1.0, material=material).location.x = 2.0 * i
    add_lamp("POINT", location=(1, 1, 4))
    bake(tmp_path, atlas="per_object")
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    for image in bpy.data.images:
        paint(image, (int(image.name.split()[-1]) + 1) / 64)
    use_baked_light(bpy.context.scene)
    group = next(one for one in bpy.data.node_groups if one.name == "Photon Bake Light")
    assert sum(node.type == "TEX_IMAGE" for node in group.nodes) == 1
    for i in (0, 11, 39):
        assert rendered(f"Plane {i}", 1)[0] == pytest.approx((i + 1) / 64, rel=0.01)


def test_images_are_shared_where_many_objects_share_a_material(empty_scene, tmp_path):
    material, _ = add_material()
    for i in range(4):
        add_plane(f"Plane {i}", material=material).location.x = 3.0 * i
    add_lamp("POINT", location=(1, 1, 4))
    assert len(prepare(tmp_path).targets[0].layout.names) == 4
    add_plane("Plane 4", material=material).location.x = 12.0
    assert prepare(tmp_path).targets[0].layout.names == ("Atlas",)


@pytest.mark.parametrize(("roof", "share"), [(None, 1.0), (2.0, 0.002), (20.0, 0.8)])
def test_the_world_is_dimmed_for_eevee_by_what_is_open(empty_scene, roof, share):
    """Over the middle of a floor, a disc of radius r at a height h covers r²/(r² + h²) of the hemisphere."""
    darken()
    obj = add_lit()
    obj.scale = (0.01, 0.01, 1)
    if roof:
        disc = add_mesh("Roof", [(10 * np.cos(a), 10 * np.sin(a), 0) for a in np.arange(64) * np.pi / 32], [range(64)])
        disc.location.z = roof
        share = roof**2 / (roof**2 + 100)
    bpy.context.view_layer.update()
    assert sky_share(bpy.context.scene, [obj]) == pytest.approx(share, abs=0.07)
    before = dump(bpy.context.scene.world.node_tree)
    use_baked_light(bpy.context.scene)
    tree = bpy.context.scene.world.node_tree
    assert tree.get_output_node("EEVEE") != tree.get_output_node("CYCLES")
    leave_baked_light()
    assert dump(tree) == before


def test_nothing_to_show_is_said(empty_scene):
    add_plane()
    before = snapshot()
    with pytest.raises(RuntimeError, match="has baked light to show: bake Vertices or Lightmaps first"):
        bpy.ops.photon_bake.use_baked_light()
    assert differences(before, snapshot()) == []


def test_the_command_shows_light_if_asked(empty_scene):
    add_room()
    quick = ["--quality", "draft", "--photons", "1000", "--gather", "density"]
    assert command.run(quick) == 0 and not is_shown(bpy.context.scene)
    assert command.run([*quick, "--attribute", "Light", "--show"]) == 0 and is_shown(bpy.context.scene)
    assert bpy.context.scene.photon_bake.attribute == "Light"
