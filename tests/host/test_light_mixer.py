"""Light groups baked each apart, and mixed again in materials and in the compositor."""

import bpy
import numpy as np
import OpenEXR
import pytest
from photon_bake.addon.blender.read.lamps.light_layers import group_names
from photon_bake.addon.core.errors import BakeError
from photon_bake.operators.command_line.command import run
from photon_bake.tests.host.camera_scenes import build_room
from photon_bake.tests.host.scenes import add_lamp, set_world
from photon_bake.tests.host.test_compositor import composed

QUICK = ["--quality", "draft", "--photons", "30000", "--gather-rays", "64"]
SMOOTH = ["--quality", "draft", "--photons", "200000", "--gather-rays", "512"]
GROUPS = ("Key", "Fill", "Other")


@pytest.fixture
def room(empty_scene):
    """Two lamps in two groups, and a world in none."""
    build_room(empty_scene, (24, 16))
    layer = bpy.context.view_layer
    for name in ("Key", "Fill", "Empty"):
        layer.lightgroups.add(name=name)
    bpy.data.objects["Lamp"].lightgroup = "Key"
    fill = add_lamp("POINT", "Second", (0.6, -0.5, -0.5), energy=4, color=(0.3, 0.5, 1))
    fill.lightgroup = "Fill"
    set_world((0.2, 0.2, 0.2))
    return empty_scene


def colors(name, attribute):
    """A color attribute of an object, (e, 3)."""
    data = bpy.data.objects[name].data.attributes[attribute].data
    values = np.empty(len(data) * 4, np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def test_vertices_have_each_group_and_all_light(room):
    """Each group is what it is alone, and all together are all light; sliders reach the materials without a rebuild."""
    assert run([*SMOOTH, "--light-groups", "--show"]) == 0
    objects = [obj.name for obj in room.objects if obj.type == "MESH"]
    assert [layer.name for layer in room.photon_bake.mixer] == list(GROUPS)
    apart = {group: np.concatenate([colors(name, f"Indirect.{group}") for name in objects]) for group in GROUPS}
    together = np.concatenate([colors(name, "Indirect") for name in objects])
    assert sum(apart.values()) == pytest.approx(together, rel=1e-5)
    assert bpy.data.objects["Floor"].data.attributes.active_color_name == "Indirect"

    light = next(group for group in bpy.data.node_groups if group.name.startswith("Photon Bake Light"))
    node = light.nodes["Layer 2 Strength"]
    room.photon_bake.mixer["Fill"].strength = 2.5
    assert node.outputs[0].default_value == 2.5
    room.photon_bake.mixer["Fill"].use = False
    assert light.nodes["Layer 2 Strength"].outputs[0].default_value == 0
    bpy.ops.photon_bake.reset_mixer()
    assert light.nodes["Layer 2 Strength"].outputs[0].default_value == 1 and node.id_data == light
    bpy.ops.photon_bake.leave_baked_light()

    assert run([*SMOOTH, "--light-group", "Key"]) == 0
    assert not room.photon_bake.mixer
    alone = np.concatenate([colors(name, "Indirect") for name in objects])
    assert apart["Key"].mean(axis=0) == pytest.approx(alone.mean(axis=0), rel=0.03)
    assert run(SMOOTH) == 0
    whole = np.concatenate([colors(name, "Indirect") for name in objects])
    assert together.mean(axis=0) == pytest.approx(whole.mean(axis=0), rel=0.03)


def test_lightmaps_of_each_group(room, tmp_path):
    options = ["--target", "lightmap", "--output", str(tmp_path), "--size", "16", "--denoise", "none"]
    assert run([*QUICK, *options, "--light-groups", "--object", "Floor"]) == 0
    floor = bpy.data.objects["Floor"]
    assert floor["lightmap_image.Key"].endswith("_Floor_indirect.Key.exr")
    pixels = {}
    for name in ("", *(f".{group}" for group in GROUPS)):
        with OpenEXR.File(str(tmp_path / floor[f"lightmap_image{name}"]), separate_channels=True) as file:
            pixels[name] = np.stack([np.array(file.channels()[c].pixels, np.float32) for c in "RGB"])
    assert pixels.pop("") == pytest.approx(sum(pixels.values()), rel=3e-3, abs=1e-4)
    assert len({image.get("photon_bake_lightmap") for image in bpy.data.images} - {None}) == 4
    assert run([*QUICK, *options, "--object", "Floor"]) == 0
    assert "lightmap_image" in floor and "lightmap_image.Key" not in floor


def test_the_compositor_mixes_the_layers_of_a_pass(room, tmp_path):
    """With a group off, the picture loses what that group's layer has, and no more."""
    options = ["--target", "camera", "--output", str(tmp_path), "--pass-denoise", "none", "--precision", "float"]
    assert run([*QUICK, *options, "--light-groups"]) == 0
    (path,) = tmp_path.glob("*.exr")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name.removeprefix("PhotonBake."): np.array(c.pixels) for name, c in file.channels().items()}
    layers = {
        name: np.stack([channels[f"{name}.{c}"] for c in "RGB"], axis=-1)
        for name in ("Indirect", *(f"Indirect_{group}" for group in GROUPS))
    }
    total = layers.pop("Indirect")
    assert sum(layers.values()) == pytest.approx(total, rel=1e-4, abs=1e-6)
    room.photon_bake.camera.folder = str(tmp_path)
    assert bpy.ops.photon_bake.add_pass() == {"FINISHED"}
    for lamp in bpy.data.lights:
        lamp.energy = 0
    room.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0  # nothing but the pass is left
    assert composed(room, tmp_path / "all.exr", 1) == pytest.approx(total, rel=1e-4, abs=1e-5)
    mixer = room.photon_bake.mixer
    mixer["Key"].use, mixer["Fill"].color, mixer["Fill"].strength = False, (1, 0.5, 0), 3
    expected = layers["Indirect_Fill"] * np.float32((3, 1.5, 0)) + layers["Indirect_Other"]
    assert composed(room, tmp_path / "mixed.exr", 1) == pytest.approx(expected, rel=1e-4, abs=1e-5)
    assert run([*QUICK, *options]) == 0  # nothing is apart any more
    assert composed(room, tmp_path / "together.exr", 1) == pytest.approx(np.zeros_like(total), abs=1e-5)
    assert not room.photon_bake.mixer
    bpy.ops.photon_bake.remove_pass()


def test_layers_that_cannot_be_are_refused(room):
    layer = bpy.context.view_layer
    assert group_names(layer, "Indirect") == ("Key", "Fill", "Empty", "Other")
    layer.lightgroups["Empty"].name = "other"
    with pytest.raises(BakeError, match="is in no group"):
        group_names(layer)
    layer.lightgroups["other"].name = "L" * 56
    with pytest.raises(BakeError, match="too long"):
        group_names(layer, "Indirect")
    for group in list(layer.lightgroups):
        layer.active_lightgroup_index = 0
        bpy.ops.scene.view_layer_remove_lightgroup()
        del group
    with pytest.raises(BakeError, match="has no light groups"):
        group_names(layer)


def test_the_old_property_still_chooses_one_group(room):
    properties = room.photon_bake
    assert properties.light_groups == "together"
    properties.light_group = "Key"
    assert properties.light_groups == "one"
    properties.light_groups = "apart"
    assert properties.light_group == "" and properties.light_groups == "apart"
    properties.light_groups = "one"
    with pytest.raises(RuntimeError, match="No light group is chosen"):
        bpy.ops.photon_bake.bake_indirect()
