"""The pictures of docs/camera_pass.md: a render of direct light, our pass, both together, and Cycles' full render.

.venv/bin/python tests/bench/camera_pictures.py --pictures docs/images [--scenes DIR] [--scene NAME] [--size W H]
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
from camera_pass import open_scene
from figures import scene_options, scenes_in
from photon_bake.addon.blender.compositing.nodes import add_pass
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.png import write_png
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest

SAMPLES = 128


def read(path, layer=""):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: c.pixels for part in file.parts for name, c in part.channels.items()}
    return np.stack([np.array(channels[f"{layer}{c}"], np.float32) for c in "RGB"], axis=-1)


def rendered(scene, path, compose):
    """What Cycles and, if asked, the compositor make."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR", "32"
    scene.render.use_compositing = compose
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read(path)


def add_baked_pass(scene, folder):
    """Bake the pass of the scene's camera at medium into files, which the compositor then adds."""
    job = BakeJob.prepare(bpy.context, [CameraRequest(CameraSettings(), folder)], Progress())
    solved = job.solve(settings_for("medium"), Progress())
    job.write(solved, Progress())
    add_pass(scene, solved.files)
    return solved.files


def pictures(name, path, size, exposure):
    """Direct light, the pass, both, and the full render, in two rows."""
    scene = open_scene(path, *size)
    scene.cycles.samples = SAMPLES
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        full = rendered(scene, folder / "full.exr", compose=False)
        files = add_baked_pass(scene, folder)
        direct = rendered(scene, folder / "direct.exr", compose=False)
        both = rendered(scene, folder / "both.exr", compose=True)
        ours = read(files[0], "PhotonBake.Indirect.")
    print(f"{name}: mean of the sum over that of the full render {both.mean() / full.mean():.4f}")
    rows = np.concatenate([np.concatenate([direct, ours], axis=1), np.concatenate([both, full], axis=1)])
    return (255 * np.clip(rows * 2.0**exposure, 0, 1) ** (1 / 2.2) + 0.5).astype(np.uint8)


if __name__ == "__main__":
    parser = scene_options(__doc__)
    parser.add_argument("--scene", default="cornell")
    parser.add_argument("--size", nargs=2, type=int, default=[320, 240])
    parser.add_argument("--exposure", type=float, default=0.0, help="stops")
    given = parser.parse_args()
    found = pictures(given.scene, scenes_in(given.scenes)[given.scene], given.size, given.exposure)
    write_png(given.pictures / f"camera_pass_{given.scene}.png", found)
