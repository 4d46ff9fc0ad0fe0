"""What the benchmarks share: scenes with their receivers and camera, recorded rays, figures against truth, output."""

import argparse
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from photon_bake.addon.blender import bake_objects, in_render_graph, read_camera, read_scene, receiver_meshes
from photon_bake.addon.receivers import vertex_receivers
from photon_bake.addon.scene import RayKind
from photon_bake.addon.tracing.embree import EmbreeTracer

ROOT = Path(__file__).resolve().parents[2]
SCENES = ("cornell", "classroom", "oa_bases3")


class RecordingTracer(EmbreeTracer):
    """Keeps every ray it is asked for."""

    def __init__(self, scene):
        super().__init__(scene)
        self.asked = []

    def closest_hit(self, origins, directions, t_max=np.inf, kind=RayKind.DIFFUSE):
        self.asked.append((origins.copy(), directions.copy()))
        return super().closest_hit(origins, directions, t_max, kind)


def scene_options(doc):
    """A parser of the options that all benchmarks of scenes have."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--scenes", type=Path, default=ROOT.parent / "shared/scenes")
    parser.add_argument("--pictures", type=Path, help="write pictures into this folder")
    return parser


def scenes_in(folder):
    """Paths by name of the scenes that a folder has."""
    paths = {name: folder / name / f"{name}.blend" for name in SCENES}
    return {name: path for name, path in paths.items() if path.exists()}


def rendered_scene():
    """The open scene as renders show it."""
    return in_render_graph(bpy.context.scene, bpy.context.view_layer, read_scene).scene(bpy.context.scene)


def load(path):
    """Scene, receivers of all objects, and those of the probes where there are some."""
    bpy.ops.wm.open_mainfile(filepath=str(path))

    def read(depsgraph):
        objects = bake_objects(depsgraph)
        chosen = [[o for o in objects if (o.name == "Probes") == probes] for probes in (False, True)]
        return read_scene(depsgraph), *(vertex_receivers(receiver_meshes(some, depsgraph)) for some in chosen)

    reading, *receivers = in_render_graph(bpy.context.scene, bpy.context.view_layer, read)
    return reading.scene(bpy.context.scene), *receivers


def camera_of_scene(width, height):
    """The camera of Blender's scene with so many pixels, as wide an angle of view as it has."""
    camera = read_camera(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    left, right, *_ = camera.window
    half = (right - left) / 2 * height / width
    return replace(camera, window=(left, right, -half, half), width=width, height=height)


def relative_rmse(value, truth):
    """RMS error over the mean, the truth's own noise taken out; value and truth are E/π at the probes."""
    keep = truth["keep"]
    error2 = np.mean((value[keep] - truth["mean"][keep]) ** 2) - np.mean(truth["stderr"][keep] ** 2)
    return float(np.sqrt(max(error2, 0)) / truth["mean"][keep].mean())


def figures(value, truth):
    """Cells: relative RMSE, deviation of the mean, and the median of a probe's error over its own truth."""
    got, mean = value[truth["keep"]], truth["mean"][truth["keep"]]
    own = np.linalg.norm(got - mean, axis=1) / np.maximum(np.linalg.norm(mean, axis=1), 1e-9)
    return f"{relative_rmse(value, truth):.2%}", f"{got.mean() / mean.mean() - 1:+.2%}", f"{np.median(own):.1%}"


def table(title, head, rows):
    lines = [f"## {title}", "", "| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    text = "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows), ""])
    print(text, flush=True)
    return text


def write_png(path, pixels):
    """Write a picture (height, width, 3), or a grey one (height, width), of values in [0, 1] as they are."""
    rgba = np.ones((*pixels.shape[:2], 4), np.float32)
    rgba[..., :3] = pixels.reshape(*pixels.shape[:2], -1)
    image = bpy.data.images.new(path.stem, rgba.shape[1], rgba.shape[0], alpha=False, is_data=True)
    image.pixels.foreach_set(rgba[::-1].ravel())
    image.filepath_raw, image.file_format = str(path.absolute()), "PNG"
    image.save()
    bpy.data.images.remove(image)
