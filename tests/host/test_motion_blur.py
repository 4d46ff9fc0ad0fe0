"""Motion blur: light averaged over the shutter's time, and the file as it was."""

import json

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import shutter_frames, shutter_middle
from photon_bake.addon.core.errors import BakeError, Cancelled
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import VertexRequest

from .cases.motion import moving
from .cases.stage import box, glow, lamp, matte, mesh, quad, room, sky
from .cycles_passes import render_passes

SETTINGS = settings_for("draft", n_photons=40_000, n_gather_rays=1024, n_cache_elements=3_000, n_cache_rays=2)


@pytest.fixture(autouse=True)
def open_shutter(empty_scene):
    """A room at frame 2, whose shutter is open for one frame's time around it."""
    room()
    empty_scene.render.motion_blur_shutter, empty_scene.render.motion_blur_position = 1.0, "CENTER"
    empty_scene.frame_set(2)
    return empty_scene


def sheet(name, n=6):
    """A grid under the lamp that receives light."""
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n)))
    faces = [(i, i + 1, i + n + 1, i + n) for i in range(n * (n - 1)) if i % n < n - 1]
    return mesh(name, np.stack([x, y, np.full(n * n, -1.2)], axis=1), faces, matte((0.7, 0.7, 0.7)))


def prepare(steps, names=("Sheet",), progress=None, requests=None):
    wanted = [VertexRequest(fit=False, denoise=False)] if requests is None else requests
    return BakeJob.prepare(bpy.context, wanted, progress or Progress(), names and list(names), motion_blur=steps)


def solved(job, steps, **settings):
    knobs = {field: getattr(SETTINGS, field) for field in SETTINGS.__dataclass_fields__} | settings
    return job.solve(type(SETTINGS)(**knobs | {"motion_blur": steps}), Progress())


def light_of_vertices(steps, **settings):
    """What the sheet's vertices get, (n, 3) W/m²."""
    (light,) = solved(prepare(steps), steps, **settings).outputs
    values = light.receivers.targets[0].receiver_of_element
    return light.irradiance.value[values]


def state():
    """What a bake must leave alone."""
    bpy.context.view_layer.update()
    scene = bpy.context.scene
    values = {obj.name: (tuple(obj.location), [list(row) for row in obj.matrix_world]) for obj in scene.objects}
    keys = [block.value for key in bpy.data.shape_keys for block in key.key_blocks]
    return scene.frame_current, scene.frame_subframe, values, keys, len(bpy.data.scenes), len(bpy.data.objects)


def tweaked_scene():
    """Things that move, one of them put elsewhere without a key, and one that is driven."""
    moving(lamp("POINT", energy=100, shadow_soft_size=0.1), "location", (-1.5, 0, 0.5), (1.5, 0, 0.5))
    one = sheet("Sheet")
    moving(one, "location", (-0.3, 0, 0), (0.3, 0, 0))
    driven = box("Driven", (0, 0, 0), (0.1, 0.1, 0.1))
    driven.driver_add("location", 1).driver.expression = "frame / 10"
    bpy.context.scene.frame_set(2)
    one.location = (0.05, 0.1, 0.2)  # not keyed
    one["mine"] = 3
    return one


def test_the_file_is_as_it_was_after_success(tmp_path):
    tweaked_scene()
    before = state()
    job = prepare(4)
    assert state() == before and len(job.shutter) == job.counts["shutter_steps"] == 4
    job.write(solved(job, 4), Progress())
    assert state() == before


def test_the_file_is_as_it_was_after_failure(monkeypatch):
    tweaked_scene()
    build = bpy.data.objects["Sheet"].modifiers.new("Build", "BUILD")
    build.frame_start, build.frame_duration = 1, 3
    before = state()
    with pytest.raises(BakeError, match="Object 'Sheet' has other faces at some time within the shutter"):
        prepare(4)
    assert state() == before


def test_the_file_is_as_it_was_after_each_cancel():
    tweaked_scene()
    before, asked = state(), []

    class CancelsAfter(Progress):
        def update(self, stage, fraction):
            asked.append(fraction)
            if len(asked) > times:
                self.cancel()
            super().update(stage, fraction)

    times = 10_000
    prepare(3, progress=CancelsAfter())
    assert len(asked) > 8 and asked == sorted(asked)
    for times in range(len(asked)):  # noqa: B007
        asked.clear()
        with pytest.raises(Cancelled):
            prepare(3, progress=CancelsAfter())
        assert state() == before


def test_others_whose_faces_change_stand_still_and_are_told_of():
    lamp("POINT", energy=100)
    sheet("Sheet")
    build = sheet("Other").modifiers.new("Build", "BUILD")
    build.frame_start, build.frame_duration = 1, 3
    job = prepare(4)
    assert [str(one) for one in job.warnings] == [
        "Object 'Other' has other faces at some time within the shutter, and stands still in its light."
    ]


def test_receivers_ride_on_what_moves_turns_and_bends():
    """The mean of bakes at the same times, one by one."""
    lamp("AREA", (1, 0, 1.5), size=0.5, energy=200)
    one = sheet("Sheet")
    moving(one, "rotation_euler", (0, 0, 0), (0, 0.9, 1.5))
    one.shape_key_add(name="Basis")
    key = one.shape_key_add(name="Up")
    key.slider_min, key.slider_max = -1, 2
    for point in key.data:
        point.co.z += 0.4 * point.co.x
    moving(key, "value", 0.0, 1.0)
    scene = bpy.context.scene
    scene.frame_set(2)
    blurred = light_of_vertices(4, add_direct=True)
    frames = shutter_frames(scene, 4)
    still = []
    for frame in frames:
        scene.frame_set(int(frame), subframe=frame % 1)
        still.append(light_of_vertices(0, add_direct=True))
    expected = np.mean(still, axis=0)
    assert np.std(still, axis=0).mean() > 0.05 * expected.mean()  # so that it matters
    error = np.abs(blurred - expected).mean() / expected.mean()
    assert error < 0.03 and abs(blurred.mean() / expected.mean() - 1) < 0.01, error


def test_lightmaps_and_groups_are_averaged(tmp_path):
    """A lightmap of the floor, of each light group apart: its sum is the whole, and the lamp's path is in it."""
    scene = bpy.context.scene
    for name in ("Sun", "Rest"):
        bpy.context.view_layer.lightgroups.add(name=name)
    one, other = lamp("POINT", energy=100, name="A"), lamp("POINT", (0, 1, 1), energy=50, name="B")
    one.lightgroup, other.lightgroup = "Sun", "Rest"
    moving(one, "location", (-1.8, 0, 0.5), (1.8, 0, 0.5))
    scene.frame_set(2)
    wanted = LightmapRequest(LightmapSettings(density=4.0, denoiser="none"), tmp_path, "scene", groups=("Sun", "Rest"))
    job = BakeJob.prepare(bpy.context, [wanted], Progress(), ["Floor"], apart=True, motion_blur=6)
    (light,) = solved(job, 6).outputs
    (whole,) = light.images
    parts = [light.apart[name].images[0] for name in ("Sun", "Rest")]
    np.testing.assert_allclose(np.sum(parts, axis=0), whole, rtol=1e-4, atol=1e-5)
    (still,) = solved(BakeJob.prepare(bpy.context, [wanted], Progress(), ["Floor"], apart=True), 0).outputs
    assert np.allclose(parts[1].mean(), still.apart["Rest"].images[0].mean(), rtol=0.03)
    assert not np.allclose(parts[0].mean(), still.apart["Sun"].images[0].mean(), rtol=0.03)


def test_an_object_whose_own_motion_blur_is_off_stands_still():
    lamp("POINT", (0, 0, 1), energy=100)
    sheet("Sheet")
    screen = quad("Screen", (0, 0, 0), (0.6, 0, 0), (0, 0.6, 0), matte((0.1, 0.1, 0.1)))
    moving(screen, "location", (-3, 0, 0), (3, 0, 0))
    bpy.context.scene.frame_set(2)
    still, moved = light_of_vertices(0), light_of_vertices(4)
    screen.cycles.use_motion_blur = False
    again = light_of_vertices(4)
    assert abs(again.mean() / still.mean() - 1) < 0.02 < abs(moved.mean() / still.mean() - 1)


def test_displaced_vertices_are_displaced_once():
    material = matte((0.5, 0.5, 0.5))
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeDisplacement")
    node.inputs["Height"].default_value, node.inputs["Midlevel"].default_value = 0.5, 0.0
    node.inputs["Scale"].default_value = 1
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"
    lamp("POINT", energy=100)
    one = sheet("Sheet")
    one.data.materials[0] = material
    moving(one, "location", (0, 0, 0), (0.4, 0, 0))
    bpy.context.scene.frame_set(2)
    job = prepare(3)
    for moment, x in zip(job.shutter, (0.4 / 6, 0.2, 0.4 * 5 / 6), strict=True):
        own = moment.movement.vertices[-36:]
        np.testing.assert_allclose(own[:, 2], -0.7, atol=1e-5)
        np.testing.assert_allclose(own[:, 0].mean(), x, atol=1e-5)


def test_a_camera_pass_is_what_cycles_blurs(open_shutter, tmp_path):
    """A glowing panel, which Cycles blurs too, and a camera that moves: by the mean over pixels and in their rows."""
    scene = open_shutter
    panel = quad("Panel", (0, 0, 1), (0.5, 0, 0), (0, -0.5, 0), glow((1, 1, 1), 30))
    moving(panel, "location", (-1.3, 0, 0), (1.0, 0, 0))
    cover = quad("Cover", (0, 0, 1.01), (0.5, 0, 0), (0, 0.5, 0), matte((0.1, 0.1, 0.1)))
    moving(cover, "location", (-1.3, 0, 0), (1.0, 0, 0))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera, camera.data.lens = camera, 20
    camera.rotation_euler = (1.2, 0, 0)
    moving(camera, "location", (-0.4, -1.9, -0.5), (0.4, -1.9, -0.5))
    scene.render.resolution_x, scene.render.resolution_y = 24, 16
    scene.frame_set(2)
    wanted = CameraRequest(CameraSettings(n_pixel_samples=32, pass_denoiser="none"), tmp_path)
    job = prepare(16, None, requests=[wanted])
    (picture,) = solved(job, 16, n_photons=400_000, n_gather_rays=1024, n_cache_elements=10_000).outputs
    ours = picture.passes.indirect
    scene.render.use_motion_blur = True
    for name in ("use_pass_diffuse_indirect", "use_pass_diffuse_color"):
        setattr(bpy.context.view_layer, name, True)
    passes = render_passes(scene, tmp_path / "cycles.exr", samples=1024)
    light, color = ("Diffuse Indirect", "Diffuse Color") if bpy.app.version >= (5, 0, 0) else ("DiffInd", "DiffCol")
    theirs = np.stack([passes[f"{light}.{c}"] * passes[f"{color}.{c}"] for c in "RGB"], axis=2)
    assert abs(ours.mean() / theirs.mean() - 1) < 0.02
    columns, expected = ours.mean(axis=(0, 2)), theirs.mean(axis=(0, 2))
    assert np.abs(columns / expected - 1).max() < 0.08
    job.write(solved(job, 16, n_photons=20_000, n_gather_rays=16), Progress())


def test_the_sun_of_the_world_stands_still(open_shutter):
    tree = sky()
    texture = tree.add("TexSky", sun_elevation=0.6)
    tree.done(tree.add("Background", {"Color": texture, "Strength": 0.05}), "OutputWorld")
    moving(lamp("POINT", energy=100), "location", (-1, 0, 0), (1, 0, 0))
    sheet("Sheet")
    open_shutter.frame_set(2)
    job = prepare(2)
    for moment, x in zip(job.shutter, (-0.5, 0.5), strict=True):
        lights = moment.movement.of(job.scene).lights
        assert lights.position[0, 0] == pytest.approx(x) and lights.names[1] == "Sun of the world"
        np.testing.assert_array_equal(lights.direction[1], job.scene.lights.direction[1])


@pytest.mark.parametrize(("position", "opens"), [("START", 2.0), ("CENTER", 1.75), ("END", 1.5)])
def test_times_of_the_shutter(open_shutter, position, opens):
    render = open_shutter.render
    render.motion_blur_shutter, render.motion_blur_position = 0.5, position
    np.testing.assert_allclose(shutter_frames(open_shutter, 4), opens + 0.5 * np.array([1, 3, 5, 7]) / 8, atol=1e-5)
    assert shutter_middle(open_shutter) == opens + 0.25


def test_a_shutter_curve_lets_more_light_in_where_it_is_higher(open_shutter):
    """Light by 2t from 0 to 1: the middle of it has come by t = √½."""
    curve = open_shutter.render.motion_blur_shutter_curve
    points = curve.curves[0].points
    while len(points) > 2:
        points.remove(points[1])
    for point, at in zip(points, ((0, 0), (1, 1)), strict=True):
        point.location, point.handle_type = at, "VECTOR"
    curve.update()
    times = np.array(shutter_frames(open_shutter, 3)) - 1.5
    np.testing.assert_allclose(times, np.sqrt(np.array([1, 3, 5]) / 6), atol=0.01)


def test_simulations_have_to_be_baked(open_shutter):
    """Bodies in the memory of the scene would lose their place."""
    lamp("POINT", energy=100)
    sheet("Sheet")
    falling = box("Falling", (0, 0, 1), (0.2, 0.2, 0.2))
    with bpy.context.temp_override(object=falling, active_object=falling, selected_objects=[falling]):
        bpy.ops.rigidbody.world_add()
        bpy.ops.rigidbody.object_add()
    for frame in range(1, 9):
        open_shutter.frame_set(frame)
    before = state()
    assert before[2]["Falling"][1][2][3] < -0.01
    with pytest.raises(BakeError, match="rigid bodies of scene 'Scene' is not baked: bake it"):
        prepare(4)
    assert state() == before
    open_shutter.rigidbody_world.point_cache.frame_end = 12
    with bpy.context.temp_override(point_cache=open_shutter.rigidbody_world.point_cache):
        bpy.ops.ptcache.bake(bake=True)
    open_shutter.frame_set(8)
    before = state()
    heights = [moment.movement.vertices[-8:, 2].mean() for moment in prepare(4).shutter]
    assert state() == before and np.all(np.diff(heights) < -0.01)


def test_cloth_has_to_be_baked():
    sheet("Sheet").modifiers.new("Cloth", "CLOTH")
    with pytest.raises(BakeError, match="cache of modifier 'Cloth' of object 'Sheet' is not baked: bake it"):
        prepare(4)


def test_the_command_and_its_report(tmp_path, capfd):
    tweaked_scene()
    quick = ["--quality", "draft", "--photons", "8000", "--gather-rays", "16", "--objects", "Sheet"]
    assert run([*quick, "--motion-blur", "--report", str(tmp_path / "a.json")]) == 0
    assert run([*quick, "--motion-blur", "3", "--report", str(tmp_path / "b.json")]) == 0
    assert run([*quick, "--report", str(tmp_path / "c.json")]) == 0
    reports = [json.loads((tmp_path / f"{name}.json").read_text()) for name in "abc"]
    assert [one["settings"]["motion_blur"] for one in reports] == [8, 3, 0]
    assert [one["counts"].get("shutter_steps") for one in reports] == [8, 3, None]
    assert all(0 < one["relative_noise"] < 0.5 for one in reports)


def test_the_button(open_shutter):
    tweaked_scene()
    properties = open_shutter.photon_bake
    properties.quality = "draft"
    properties.n_photons, properties.n_gather_rays, properties.use_motion_blur = 8000, 16, True
    assert properties.motion_blur == 8
    before = state()
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    after = state()
    assert after == before and bpy.data.objects["Sheet"].data.color_attributes["Indirect"]
