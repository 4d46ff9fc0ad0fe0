"""Bakes of several frames: files, playback, and what is refused."""

import json

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.playback import MODIFIER, remove_playback
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.output.vertex_animation import AnimationLayout
from photon_bake.addon.settings.frames import Frames, frame_label, parse_frames
from photon_bake.addon.ui.state import bake_state
from photon_bake.operators.command_line.command import run

from .camera_scenes import add_camera
from .scenes import add_cube, add_lamp, add_plane

QUICK = ["--quality", "draft", "--photons", "5000", "--gather-rays", "32"]


@pytest.fixture
def room(empty_scene):
    """A floor, a box that rises from frame 1 to 3, and a lamp whose power doubles meanwhile."""
    add_plane("Floor", size=8.0)
    box, lamp = add_cube("Box"), add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    for frame, height, power in ((1, 1.0, 1000.0), (3, 2.0, 2000.0)):
        box.location.z, lamp.data.energy = height, power
        box.keyframe_insert("location", frame=frame)
        lamp.data.keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_set(1)


def colors_of(name, attribute="Indirect", evaluated=False):
    obj = bpy.data.objects[name]
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data if evaluated else obj.data
    values = np.empty(4 * len(mesh.attributes[attribute].data), np.float32)
    mesh.attributes[attribute].data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def baked_alone(frame):
    """What a bake of one frame gives the floor."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    assert run([*QUICK, "--attribute", "Alone"]) == 0
    values = colors_of("Floor", "Alone")
    for obj in ("Floor", "Box"):
        mesh = bpy.data.objects[obj].data
        mesh.attributes.remove(mesh.attributes["Alone"])
    scene.frame_set(1)
    return values


def test_vertices_play_back_what_each_frame_bakes_to(room, tmp_path):
    alone = {frame: baked_alone(frame) for frame in (1, 3)}
    assert run([*QUICK, "--frames", "1-3", "--output", str(tmp_path)]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["Scene_Box_Indirect.exr", "Scene_Floor_Indirect.exr"]
    assert bpy.context.scene.frame_current == 1
    for frame, values in alone.items():
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(colors_of("Floor", evaluated=True), values, rtol=1e-5)
    np.testing.assert_allclose(colors_of("Floor"), alone[1], rtol=1e-5)  # the mesh itself has the scene's frame
    assert alone[3].mean() > 1.5 * alone[1].mean()
    assert remove_playback() == 2
    assert not bpy.data.objects["Floor"].modifiers and not bpy.data.node_groups


def test_between_frames_light_is_mixed(room, tmp_path):
    assert run([*QUICK, "--frames", "1-3:2", "--output", str(tmp_path)]) == 0
    scene = bpy.context.scene
    found = []
    for frame, subframe in ((1, 0.0), (2, 0.5), (3, 0.0), (9, 0.0)):
        scene.frame_set(frame, subframe=subframe)
        found.append(colors_of("Box", evaluated=True))
    np.testing.assert_allclose(found[1], 0.25 * found[0] + 0.75 * found[2], rtol=1e-4)
    assert np.array_equal(found[2], found[3])


def test_baking_again_replaces_playback(room, tmp_path):
    for frames in ("1-2", "1-3"):
        assert run([*QUICK, "--frames", frames, "--output", str(tmp_path)]) == 0
    assert [one.name for one in bpy.data.objects["Floor"].modifiers] == [MODIFIER]
    assert len(bpy.data.node_groups) == 2 and len(bpy.data.images) == 2
    bpy.context.scene.frame_set(3)
    first = colors_of("Floor").mean()
    assert colors_of("Floor", evaluated=True).mean() > 1.5 * first


def test_subframes_and_attributes(room):
    assert run([*QUICK, "--frames", "1-2:0.5", "--frames-as", "attributes"]) == 0
    names = {one.name for one in bpy.data.objects["Floor"].data.color_attributes}
    assert names == {"Indirect", "Indirect.0001", "Indirect.0001.5", "Indirect.0002"}
    frames = [colors_of("Floor", f"Indirect.{label}") for label in ("0001", "0001.5", "0002")]
    assert not np.array_equal(frames[0], frames[1]) and not np.array_equal(frames[1], frames[2])
    assert np.array_equal(colors_of("Floor"), frames[0])
    assert not bpy.data.objects["Floor"].modifiers


def test_lightmaps_are_sequences(room, tmp_path):
    options = ["--target", "lightmap", "--size", "32", "--atlas", "shared", "--output", str(tmp_path), "--show"]
    floor = bpy.data.objects["Floor"]
    floor.data.materials.append(bpy.data.materials.new("Grey"))
    floor.data.materials[0].use_nodes = True
    assert run([*QUICK, *options, "--frames", "1-3"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"Scene_Atlas_indirect.000{i}.exr" for i in (1, 2, 3)]
    (image,) = [image for image in bpy.data.images if image.source == "SEQUENCE"]
    node = next(n for g in bpy.data.node_groups for n in g.nodes if n.type == "TEX_IMAGE")
    user = node.image_user
    assert (node.image, user.frame_start, user.frame_duration, user.frame_offset) == (image, 1, 3, 0)
    means = [pixels_of(path).mean() for path in sorted(tmp_path.iterdir())]
    assert means[0] < means[1] < means[2]


def test_lightmaps_of_every_other_frame_hold_the_one_before(room, tmp_path):
    options = ["--target", "lightmap", "--size", "32", "--output", str(tmp_path), "--atlas", "shared"]
    assert run([*QUICK, *options, "--frames", "1-4:2"]) == 0
    pixels = [pixels_of(path) for path in sorted(tmp_path.iterdir())]
    assert len(pixels) == 4
    assert np.array_equal(pixels[0], pixels[1]) and np.array_equal(pixels[2], pixels[3])
    assert not np.array_equal(pixels[0], pixels[2])


def test_the_layout_is_the_first_frame_s(empty_scene, tmp_path):
    box = add_cube("Box")
    add_plane("Floor", size=8.0)
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    for frame, size in ((1, 1.0), (2, 3.0)):  # of its own frame it would have more texels
        box.scale = (size, size, size)
        box.keyframe_insert("scale", frame=frame)
    bpy.context.scene.frame_set(2)
    options = ["--target", "lightmap", "--density", "8", "--output", str(tmp_path), "--atlas", "per_object"]
    assert run([*QUICK, *options, "--frames", "1-2"]) == 0
    shapes = {pixels_of(path).shape for path in tmp_path.iterdir() if "Box" in path.name}
    assert len(shapes) == 1 and bpy.context.scene.frame_current == 2


def test_frames_in_which_nothing_changes_are_baked_once(room, tmp_path):
    report = tmp_path / "report.json"
    targets = ["--target", "vertex", "--target", "lightmap", "--target", "camera", "--size", "32", "--atlas", "shared"]
    add_camera(bpy.context.scene, (0, -6, 3))
    frames = ["--frames", "2-6", "--report", str(report), "--output", str(tmp_path / "out")]
    assert run([*QUICK, *targets, *frames]) == 0
    counts = json.loads(report.read_text())["counts"]
    assert (counts["frames"], counts["repeated_frames"]) == (5, 3)  # all stands still from frame 3 on
    files = sorted(p.name for p in (tmp_path / "out").glob("*Atlas*"))
    assert files == [f"Scene_Atlas_indirect.000{i}.exr" for i in range(2, 7)]
    assert len(list((tmp_path / "out").glob("*_indirect_000*.exr"))) == 5
    bpy.context.scene.frame_set(2)
    moving = colors_of("Floor", evaluated=True)
    bpy.context.scene.frame_set(3)
    still = colors_of("Floor", evaluated=True)
    bpy.context.scene.frame_set(6)
    assert np.array_equal(colors_of("Floor", evaluated=True), still) and not np.array_equal(moving, still)


def test_the_button_bakes_the_scene_s_frames(room, tmp_path):
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 5, 2
    properties = scene.photon_bake
    properties.quality, properties.n_photons, properties.n_gather_rays = "draft", 5000, 32
    properties.frames.use, properties.frames.folder = True, str(tmp_path)
    scene.frame_set(4)
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert bake_state.outcome.places == ["3 frames of Indirect on 2 objects"] and scene.frame_current == 4
    assert {path.parent for path in bake_state.outcome.files} == {tmp_path}
    light = []
    for frame in (1, 2, 3, 5):
        scene.frame_set(frame)
        light.append(colors_of("Floor", evaluated=True))
    np.testing.assert_allclose(light[1], 0.5 * (light[0] + light[2]), rtol=1e-4)
    assert np.array_equal(light[2], light[3])
    assert bpy.ops.photon_bake.remove_playback() == {"FINISHED"}
    assert not bpy.ops.photon_bake.remove_playback.poll()


def test_a_failure_on_the_way_leaves_the_frame(room, tmp_path):
    scene, box = bpy.context.scene, bpy.data.objects["Box"]
    for frame, hidden in ((1, False), (2, True)):
        box.hide_render = hidden
        box.keyframe_insert("hide_render", frame=frame)
    scene.frame_start, scene.frame_end = 1, 2
    properties = scene.photon_bake
    properties.quality, properties.n_photons, properties.n_gather_rays = "draft", 5000, 32
    properties.frames.use, properties.frames.folder = True, str(tmp_path)
    scene.frame_set(7)
    with pytest.raises(RuntimeError, match="Object 'Box' does not take light in all frames"):
        bpy.ops.photon_bake.bake_indirect()
    assert scene.frame_current == 7 and not bpy.data.objects["Floor"].modifiers


def test_an_object_that_is_hidden_later_is_named(room, tmp_path, capfd):
    box = bpy.data.objects["Box"]
    for frame, hidden in ((1, False), (2, True)):
        box.hide_render = hidden
        box.keyframe_insert("hide_render", frame=frame)
    assert run([*QUICK, "--frames", "1-2", "--output", str(tmp_path)]) == 1
    said = capfd.readouterr().err
    assert "Object 'Box' does not take light in all frames, as frame 2 shows" in said
    assert not any(tmp_path.iterdir()) and not bpy.data.objects["Floor"].modifiers
    assert "Indirect" not in bpy.data.objects["Floor"].data.attributes


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--frames", "3-1"], "no frames"),
        (["--frames", "1-3:0"], "no frames"),
        (["--frames", "some"], "are no frames"),
        (["--frames", "1-3:0.5", "--target", "lightmap", "--output", "x"], "Subframes are for vertices alone"),
        (["--frames", "1-3", "--copies", "--output", "x"], "Copies have the light of one frame"),
        (["--frames", "1-3"], "give --output DIR"),
        (["--frames-as", "attributes"], "give --frames"),
    ],
)
def test_bad_frames(room, options, sentence, capfd):
    assert run([*QUICK, *options]) == 2
    assert sentence in " ".join(capfd.readouterr().err.split())


def test_frames():
    assert parse_frames("-3--1").times == [-3, -2, -1]
    assert parse_frames("1-2:0.25").times == [1, 1.25, 1.5, 1.75, 2]
    assert parse_frames("7").times == [7] and str(parse_frames("1-9:2")) == "1-9:2"
    assert [frame_label(time) for time in (7, 7.25, -1)] == ["0007", "0007.25", "-001"]
    frames = Frames(1, 9, 2)
    assert [frames.nearest(frame) for frame in (-5, 1, 2.9, 3, 99)] == [0, 0, 0, 1, 4]


def test_a_frame_of_many_vertices_has_several_rows():
    layout = AnimationLayout(10_000, 3)
    assert (layout.width, layout.rows, layout.height) == (4096, 3, 9)
    values = np.arange(3 * 10_000, dtype=np.float32).reshape(3, -1, 1).repeat(3, axis=2)
    image = layout.image(values)
    assert image[3 + 1, 5, 0] == values[1, 4096 + 5, 0]
    with pytest.raises(BakeError, match="at most 21,666 frames"):
        AnimationLayout(10_000, 30_000).check("A")


def pixels_of(path):
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        return np.array(file.channels()["RGB"].pixels if "RGB" in file.channels() else file.channels()["R"].pixels)
