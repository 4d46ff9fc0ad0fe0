"""Measures what Cycles shows in the seconds after an edit, beside live light: its denoised picture.

    python tests/bench/run.py --only live_rival [--scene NAME]

Each edit lets Cycles' viewport begin anew. So the indirect diffuse light of the scene camera's picture is rendered on
all cores for a limited time, and denoised with normals and albedo. Reading the scene and denoising are not in that
time. The truth is two renders x and y of other seeds: over the pixels of a picture z the mean of (z − x)(z − y) is the
square of its error, without the noise of x and y.
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
from figures import table
from live import fifty
from mathutils import Vector

SIZE, SECONDS, TRUE_SAMPLES, MOST_SAMPLES = (960, 540), (1, 10), 64, 1 << 16
HEAD = ["Scene", "Pixels", *(f"Cycles' relative RMSE after {seconds} s" for seconds in SECONDS)]


def rows(name, path):
    """The row of `HEAD` of a scene."""
    if path is None:
        fifty()
        look(bpy.context.scene, (0.5, 0.6, 1.7), (5.2, 4.2, 1.0))
    else:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    prepare(scene)
    truth = [indirect(scene, seed, samples=TRUE_SAMPLES)["raw"] for seed in (1, 2)]
    lit = np.mean(truth, axis=0).mean()
    found = [indirect(scene, 3, seconds=seconds)["denoised"] for seconds in SECONDS]
    errors = [np.sqrt(max(np.mean((z - truth[0]) * (z - truth[1])), 0)) / lit for z in found]
    yield [name, f"{SIZE[0]} × {SIZE[1]}", *(f"{error:.1%}" for error in errors)]


def prepare(scene):
    """Let Cycles render the indirect diffuse light without limits, and the compositor denoise it."""
    scene.render.engine, cycles = "CYCLES", scene.cycles
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *SIZE, 100
    cycles.device, cycles.use_denoising, cycles.use_adaptive_sampling = "CPU", False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    for limit in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(cycles, limit, 32)
    for layer in scene.view_layers:
        layer.use_pass_diffuse_indirect = layer.cycles.denoising_store_passes = True
    denoise_light(scene)


def look(scene, position, at):
    """Give the scene a camera that looks from one place at another."""
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location = position
    scene.camera.rotation_euler = (Vector(at) - Vector(position)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(scene.camera)


def denoise_light(scene):
    """Let the compositor denoise what the render has as indirect diffuse light, and give that as its result."""
    grouped = hasattr(scene, "compositing_node_group")
    if grouped:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    tree.nodes.clear()
    renders, denoise = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeDenoise")
    end = tree.nodes.new("NodeGroupOutput" if grouped else "CompositorNodeComposite")
    names = {socket.name for socket in renders.outputs}
    light = "Diffuse Indirect" if "Diffuse Indirect" in names else "DiffInd"
    for socket, to in ((light, "Image"), ("Denoising Normal", "Normal"), ("Denoising Albedo", "Albedo")):
        tree.links.new(renders.outputs[socket], denoise.inputs[to])
    tree.links.new(denoise.outputs["Image"], end.inputs["Image"])


def indirect(scene, seed, samples=MOST_SAMPLES, seconds=0):
    """The picture of indirect diffuse light as it is and denoised, (h, w, 3) float32 each."""
    scene.cycles.seed, scene.cycles.samples, scene.cycles.time_limit = seed, samples, seconds
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "light.exr")
        bpy.ops.render.render(write_still=True)
        with OpenEXR.File(scene.render.filepath, separate_channels=True) as file:
            channels = {name: np.array(c.pixels) for part in file.parts for name, c in part.channels.items()}

    def picture(layer):
        return np.stack([next(v for name, v in channels.items() if name.endswith(f"{layer}.{c}")) for c in "RGB"], -1)

    return {"raw": picture("DiffInd"), "denoised": picture("Composite.Combined")}


def tables(scenes, options):
    """A Markdown table."""
    chosen = options.scene or [*(name for name in ("cornell", "classroom") if name in scenes), "fifty"]
    found = [cells for name in chosen for cells in rows(name, scenes.get(name))]
    return [table("Cycles so long after it begins anew", HEAD, found)]
