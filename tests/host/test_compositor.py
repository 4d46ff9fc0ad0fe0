"""The pass in the compositor: direct light and the pass together are Cycles' full render."""

import bpy
import numpy as np
import OpenEXR
import pytest
from photon_bake.addon.blender.compositing.files import pass_files
from photon_bake.addon.blender.compositing.nodes import add_pass, frame_of, remove_pass
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest
from photon_bake.tests.host.camera_scenes import add_ball, add_camera, build_room, coloured
from photon_bake.tests.host.cycles_passes import render_passes
from photon_bake.tests.host.leftovers import dump
from photon_bake.tests.host.scenes import set_world


def bake_pass(folder, **settings):
    """The pass of the scene's camera, as a file."""
    job = BakeJob.prepare(bpy.context, [CameraRequest(CameraSettings(**settings), folder)], Progress())
    solved = job.solve(settings_for("draft", n_photons=100_000), Progress())
    job.write(solved, Progress())
    return solved.files[0]


def composed(scene, path, samples):
    """What the compositor makes, (h, w, 3)."""
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = samples, False, False
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.stack([np.array(file.channels()[name].pixels, np.float32) for name in "RGB"], axis=-1)


def nodes_of(scene):
    tree = scene.compositing_node_group if hasattr(scene, "compositing_node_group") else scene.node_tree
    return [] if tree is None else sorted(node.bl_idname for node in tree.nodes)


def switched(scene):
    """The node that adds the pass."""
    tree = scene.compositing_node_group if hasattr(scene, "compositing_node_group") else scene.node_tree
    return next(node for node in tree.nodes if node.label == "Add Indirect Light")


@pytest.mark.parametrize(("balls", "bound"), [(False, 0.02), (True, 0.06)])
def test_direct_light_and_the_pass_are_the_full_render(empty_scene, tmp_path, balls, bound):
    """Means over blocks of 8 × 8 pixels, which are 1 % off by both renders' noise, and 4 % with balls.

    With balls there are a mirror, glass and rough metal besides, and the light comes from the world: of what lamps send
    over mirrors Cycles finds too little to compare with.
    """
    build_room(empty_scene)
    if balls:
        set_world((1, 1, 1))
        bpy.data.objects.remove(bpy.data.objects["Lamp"])
        mirror = coloured("Mirror", (0.9, 0.8, 0.7), "ShaderNodeBsdfAnisotropic", Roughness=0.0)
        glass = coloured("Glass", (1, 1, 1), "ShaderNodeBsdfGlass", Roughness=0.0)
        metal = coloured("Metal", (0.8, 0.8, 0.6), Roughness=0.4, node="ShaderNodeBsdfPrincipled", Metallic=1.0)
        add_ball("Mirror", (0.45, -0.1, -0.6), 0.4, mirror)
        add_ball("Glass", (0.45, -0.1, 0.2), 0.3, glass)
        add_ball("Metal", (-0.4, -0.1, 0.3), 0.4, metal)
    full = render_passes(empty_scene, tmp_path / "full.exr", samples=150)
    full = np.stack([full[f"Combined.{c}"] for c in "RGB"], axis=-1)
    add_pass(empty_scene, [bake_pass(tmp_path)])
    assert empty_scene.cycles.max_bounces == 0
    ours = composed(empty_scene, tmp_path / "ours.exr", 32)

    def blocks(picture):
        return picture.reshape(4, 8, 6, 8, 3).mean(axis=(1, 3))

    off = np.abs(blocks(ours) - blocks(full)).max(axis=2) / blocks(full).mean()
    assert ours.mean() == pytest.approx(full.mean(), rel=0.02)
    assert np.sqrt((off**2).mean()) < bound and off.max() < 3 * bound


def test_file_is_the_same_for_openexr_blender_and_the_compositor(empty_scene, tmp_path):
    build_room(empty_scene, (24, 16))
    path = bake_pass(tmp_path, precision="float", n_pixel_samples=2)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        pixels = {name: np.array(c.pixels, np.float32) for name, c in file.channels().items()}
        header = dict(file.header())
    layer = {name.split(".")[1] for name in pixels}
    assert layer == {
        "Indirect",
        "IndirectDiffuse",
        "Caustics",
        "Glossy",
        "Albedo",
        "Normal",
        "Depth",
        "Error",
    }
    assert "Photon Bake" in header["Software"] and '"seed": 0' in header["PhotonBakeSettings"]
    rgb = {
        name: np.stack([pixels[f"PhotonBake.{name}.{c}"] for c in "RGB"], -1)
        for name in layer - {"Normal"}
        if f"PhotonBake.{name}.R" in pixels
    }
    assert rgb["Indirect"] == pytest.approx(rgb["IndirectDiffuse"] * rgb["Albedo"] + rgb["Caustics"] + rgb["Glossy"])
    assert rgb["Indirect"].mean() > 0.05

    add_pass(empty_scene, [path])
    empty_scene.render.engine = "CYCLES"
    bpy.data.lights[0].energy = 0  # nothing but the pass is left
    assert composed(empty_scene, tmp_path / "composed.exr", 1) == pytest.approx(rgb["Indirect"], abs=1e-6)


def test_taken_out_again_everything_is_as_before(empty_scene, tmp_path):
    add_camera(empty_scene)
    build_room(empty_scene, (8, 8))
    path = bake_pass(tmp_path, n_pixel_samples=1, pass_denoiser="none")
    empty_scene.render.engine, empty_scene.cycles.max_bounces = "CYCLES", 7

    def what_there_is():
        images = [image.name for image in bpy.data.images if image.type != "COMPOSITING"]  # Blender's own viewer
        return nodes_of(empty_scene), images, len(bpy.data.node_groups)

    before = what_there_is()
    for _ in range(2):  # the second one takes the place of the first
        add_pass(empty_scene, [path])
        assert nodes_of(empty_scene).count("CompositorNodeImage") == 1
    assert remove_pass(empty_scene) and not remove_pass(empty_scene)
    assert what_there_is() == before
    assert empty_scene.cycles.max_bounces == 7


def test_nodes_that_are_there_stay_linked(empty_scene, tmp_path):
    """Between a render and a blur the pass comes in, and goes out again."""
    build_room(empty_scene, (8, 8))
    path = bake_pass(tmp_path, n_pixel_samples=1, pass_denoiser="none")
    if hasattr(empty_scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("Mine", "CompositorNodeTree")
        empty_scene.compositing_node_group = tree
    else:
        empty_scene.use_nodes = True
        tree = empty_scene.node_tree
    render, blur = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeBlur")
    tree.links.new(render.outputs["Image"], blur.inputs[0])
    add_pass(empty_scene, [path])
    assert blur.inputs[0].links[0].from_node.bl_idname == "ShaderNodeMix"
    remove_pass(empty_scene)
    assert blur.inputs[0].links[0].from_node == render


def test_what_is_no_pass_is_refused(empty_scene, tmp_path):
    with pytest.raises(BakeError, match="is not there"):
        add_pass(empty_scene, [tmp_path / "indirect_0001.exr"])
    picture = bpy.data.images.new("Picture", 2, 2)
    picture.filepath_raw, picture.file_format = str(tmp_path / "picture.png"), "PNG"
    picture.save()
    with pytest.raises(BakeError, match="is no camera's pass"):
        add_pass(empty_scene, [tmp_path / "picture.png"])
    assert empty_scene.cycles.max_bounces > 0 and nodes_of(empty_scene) == []


@pytest.mark.parametrize(("name", "frame"), [("a_0012", 12), ("b7_", 7), ("none", 1)])
def test_frame_is_the_last_number_in_the_name(tmp_path, name, frame):
    assert frame_of(tmp_path / f"{name}.exr") == frame


def test_another_engine_makes_no_doubled_light(empty_scene, tmp_path):
    """The pass was added while EEVEE was chosen; whoever turns Cycles' bounces on has them, and no pass on top."""
    build_room(empty_scene, (16, 16))
    path = bake_pass(tmp_path, n_pixel_samples=1, pass_denoiser="none")
    eevee = "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"
    empty_scene.render.engine, empty_scene.cycles.max_bounces = eevee, 5
    empty_scene.eevee.use_raytracing = True

    def factor():
        bpy.context.view_layer.update()
        return switched(empty_scene).inputs[0].default_value

    add_pass(empty_scene, [path])
    assert not empty_scene.eevee.use_raytracing and factor() == 1
    empty_scene.eevee.use_raytracing = True
    assert factor() == 0
    empty_scene.render.engine = "CYCLES"
    assert factor() == 1
    both = composed(empty_scene, tmp_path / "both.exr", 16)
    assert empty_scene.cycles.max_bounces == 0
    empty_scene.cycles.max_bounces = 5
    full = composed(empty_scene, tmp_path / "full.exr", 16)
    remove_pass(empty_scene)
    assert empty_scene.cycles.max_bounces == 5 and empty_scene.eevee.use_raytracing
    assert full == pytest.approx(composed(empty_scene, tmp_path / "alone.exr", 16), abs=1e-6)
    assert both.mean() == pytest.approx(full.mean(), rel=0.05)


def test_eevee_has_the_share_of_the_sky_that_is_seen(empty_scene, tmp_path):
    """In a closed room none; the world is as before once the pass is out."""
    set_world((1, 1, 1))
    build_room(empty_scene, (8, 8))
    path = bake_pass(tmp_path, n_pixel_samples=1, pass_denoiser="none")
    tree = empty_scene.world.node_tree
    before = dump(tree)
    add_pass(empty_scene, [path])
    surface = tree.get_output_node("EEVEE").inputs["Surface"].links[0].from_node
    assert surface.inputs[0].links[0].from_node.inputs[1].default_value < 0.3
    assert tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node.type == "BACKGROUND"
    remove_pass(empty_scene)
    assert dump(tree) == before


def test_a_scene_takes_its_own_pass_alone(empty_scene, tmp_path):
    """Not that of another scene, nor of another file in the same folder; its own it finds where the bake wrote it."""
    add_camera(empty_scene)
    build_room(empty_scene, (8, 8))
    path = bake_pass(tmp_path, n_pixel_samples=1, pass_denoiser="none")
    assert pass_files(empty_scene, tmp_path, "{file}_{scene}_indirect_####") == [path]
    assert pass_files(empty_scene, None, "other_####") == [path]
    other = bpy.data.scenes.new("Other")
    with pytest.raises(BakeError, match=r"is the pass of scene 'Scene.*' of a file that was never saved"):
        pass_files(other, tmp_path, path.stem.removesuffix("0001"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mine.blend"))
    assert pass_files(empty_scene, tmp_path / "passes", "{file}_{scene}_indirect_####") == [path]
    mine = bake_pass(tmp_path / "passes", n_pixel_samples=1, pass_denoiser="none")
    assert mine.name == f"mine_{empty_scene.name}_indirect_0001.exr"
    add_pass(empty_scene, [mine])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "yours.blend"))
    del empty_scene["photon_bake_pass"]
    with pytest.raises(BakeError, match=r"of mine\.blend"):
        pass_files(empty_scene, mine.parent, mine.stem.removesuffix("0001"))
