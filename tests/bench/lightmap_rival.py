"""Measures lightmaps at equal error: ours, and Cycles' image bake with OpenImageDenoise's lightmap filter after it.

    python tests/bench/run.py --only lightmap_speed
    python tests/bench/lightmap_rival.py [--scenes DIR] [--scene NAME…] [--texels N…] [--quality Q…]

All objects of a scene, but for the ground outside of classroom, become one with one lightmap, and both bake to the same
image through the same UV map, which is the one that our bake makes. Errors are those of the lightmap read bilinearly
where the probes are, as a shader reads it, so that they hold what its texels cannot show. Probes that no light reaches
lie inside of solids, which nobody sees: the error is that of the others, and in a column of its own that of all. Our
seconds are those of placing receivers and solving, and of finishing with the filter or without it; reading the scene
stands beside them. Beyond Cycles' measured errors its time is extrapolated by 1/√n, which flatters it: what a filter
leaves falls more slowly, and what it has in texels whose middle lies in other geometry is black with any number. Where
charts are small, that is most of its RMS error: time is compared at the same median of the errors as well.
"""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
import pyoidn
from cycles_bakes import bake_indirect
from figures import scene_options, scenes_in, table
from lightmap_uvs import left_out
from lightmaps import under
from own_scenes import OWN_SCENES
from photon_bake.addon.blender.lightmap.meshes import write_uv_map
from photon_bake.addon.blender.lightmap.reading import LightmapReading
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest
from rivals import Rival
from truth import Truth, open_scene

SIZES = (200_000, 1_000_000)
QUALITIES = ("draft", "medium")
SCENES = {"cornell": (SIZES, QUALITIES), "classroom": (SIZES[-1:], QUALITIES[-1:])}
"""Scenes of `make bench`, the sizes of their lightmaps in texels, and our bakes' qualities."""

DENOISERS = ("oidn", "none")
SAMPLES = (1, 4, 16, 64)
MOST_SAMPLES = 2e7  # in one bake of Cycles, for all pixels: it takes half a minute
TITLE = "Lightmaps' time at equal error, against Cycles' image bake and OpenImageDenoise"
HEAD = ["Scene", "Texels", "Image", "Bake", "Read, s", "Bake, s", "Relative RMSE without filter", "Filter or finish, s"]
HEAD += ["Relative RMSE", "Inside solids too", "Mean", "Median", "Cycles to the same error, s", "Speed-up"]
HEAD += ["Cycles to the same median, s", "Speed-up"]
UV_MAP = "Both"
USUAL_USE = 0.6  # share of an image that charts cover


@dataclass(frozen=True)
class Lightmap:
    """An object with all surfaces of a scene, its image, and where the n probes are in it.

    Attributes
    ----------
    obj, image : bpy.types.Object, bpy.types.Image
    uv : (n, 2) float64
        NaN where no surface is under a probe.
    n_texels : int
        That charts cover.
    """

    obj: bpy.types.Object
    image: bpy.types.Image
    uv: np.ndarray
    n_texels: int

    def bake(self, n_samples):
        """Pixels of Cycles' bake, (side, side, 3) float32, and its seconds."""
        seconds = bake_indirect(self.obj, n_samples, target="IMAGE_TEXTURES")
        pixels = np.empty(self.image.size[0] * self.image.size[1] * 4, np.float32)
        self.image.pixels.foreach_get(pixels)
        return np.ascontiguousarray(pixels.reshape(self.image.size[1], self.image.size[0], 4)[..., :3]), seconds

    def at_probes(self, pixels):
        """Pixels read bilinearly at the probes, for each of their three vertices, (3n, 3)."""
        height, width = pixels.shape[:2]
        x, y = (np.nan_to_num(self.uv) * (width, height) - 0.5).T
        column, row = np.clip(np.floor([x, y]).astype(int), 0, [[width - 2], [height - 2]])
        across, up = (x - column)[:, None], (y - row)[:, None]
        low = pixels[row, column] * (1 - across) + pixels[row, column + 1] * across
        high = pixels[row + 1, column] * (1 - across) + pixels[row + 1, column + 1] * across
        return (low * (1 - up) + high * up).repeat(3, axis=0)


def filtered(pixels):
    """Pixels after OpenImageDenoise's filter for lightmaps, and its seconds."""
    start = perf_counter()
    result = pyoidn.denoise(pixels, hdr=True, filter_type=pyoidn.OIDN_FILTER_TYPE_RT_LIGHTMAP)
    return result, perf_counter() - start


def make_lightmap(scene, n_texels):
    """Join the meshes of Blender's scene, called `scene`, into one with a lightmap of about so many texels."""
    probes = bpy.data.objects["Probes"]
    meshes = [obj for obj in bpy.context.view_layer.objects if obj.type == "MESH" and obj != probes]
    obj = _joined([obj for obj in meshes if not left_out(scene, obj)])
    side = round(np.sqrt(n_texels / USUAL_USE))
    graph = bpy.context.evaluated_depsgraph_get()
    layout = LightmapReading(graph, LightmapSettings(size=side)).objects([obj.name]).layout
    write_uv_map(obj.data, UV_MAP, layout.made[obj.data.name])
    obj.data.uv_layers.active = obj.data.uv_layers[UV_MAP]
    corners, uv = _triangles(obj.data)
    ab, ac = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    covered = np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).sum() / 2
    at = _uv_under(probes, corners, uv)
    return Lightmap(obj, _image_in_all_materials(obj, side), at, round(covered * side**2))


def _joined(objects):
    """One object of all, modifiers applied."""
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.convert(target="MESH")
    bpy.ops.object.transform_apply()
    bpy.ops.object.join()
    bpy.context.view_layer.update()
    return objects[0]


def _triangles(mesh):
    """Each triangle's corners: in space (t, 3, 3), and their places in the lightmap, (t, 3, 2) float64."""
    mesh.calc_loop_triangles()
    vertices, loops = (np.empty(len(mesh.loop_triangles) * 3, np.int32) for _ in range(2))
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.loop_triangles.foreach_get("loops", loops)
    positions, uv = np.empty(len(mesh.vertices) * 3, np.float32), np.empty(len(mesh.loops) * 2, np.float32)
    mesh.vertices.foreach_get("co", positions)
    mesh.uv_layers[UV_MAP].uv.foreach_get("vector", uv)
    return positions.reshape(-1, 3)[vertices.reshape(-1, 3)], uv.reshape(-1, 2)[loops.reshape(-1, 3)].astype(np.float64)


def _image_in_all_materials(obj, side):
    image = bpy.data.images.new("Lightmap", side, side, alpha=False, float_buffer=True, is_data=True)
    for slot in obj.material_slots:
        nodes = slot.material.node_tree.nodes
        node = nodes.active = nodes.new("ShaderNodeTexImage")
        node.image = image
    return image


def _uv_under(probes, corners_of_triangle, uv_of_triangle):
    """Where the surfaces under the probes are in the lightmap, (n, 2); NaN where there is none."""
    corners = np.empty(len(probes.data.vertices) * 3, np.float32)
    probes.data.vertices.foreach_get("co", corners)
    a, b, c = corners.reshape(-1, 3, 3).swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    triangle, weights = under((a + b + c) / 3, normal, corners_of_triangle)
    at = np.einsum("nk,nkd->nd", weights, uv_of_triangle[triangle])
    return np.where(triangle[:, None] >= 0, at, np.nan)


@dataclass(frozen=True)
class Judge:
    """Tells the errors of lightmaps: the truth of all probes, and of those that are not inside of solids."""

    everywhere: Truth
    seen: Truth

    @staticmethod
    def of(truth):
        return Judge(truth, replace(truth, keep=truth.keep & (truth.mean.max(axis=1) > 0)))

    def error(self, value):
        return self.seen.relative_rmse(value)

    def median(self, value):
        """Of a vertex' error over its own truth."""
        return self.seen.median(value)

    def cells(self, value):
        """Cells of `HEAD` from "Relative RMSE" to "Median"."""
        return [
            f"{self.error(value):.2%}",
            f"{self.everywhere.relative_rmse(value):.2%}",
            f"{self.seen.bias(value):+.2%}",
            f"{self.median(value):.1%}",
        ]


def measure_cycles(lightmap, judge):
    """Cells of `HEAD` from "Bake" on for each number of samples; the `Rival` by the error, and by its median."""
    n_pixels = lightmap.image.size[0] * lightmap.image.size[1]
    samples = [n for n in SAMPLES if n * n_pixels <= MOST_SAMPLES]
    filtered(lightmap.bake(1)[0])  # what is done only once, such as loading the library
    rows, errors, medians, times, filter_times = [], [], [], [], []
    for n in samples:
        pixels, seconds = lightmap.bake(n)
        smooth, filter_seconds = filtered(pixels)
        value = lightmap.at_probes(smooth)
        errors.append(judge.error(value))
        medians.append(judge.median(value))
        times.append(seconds)
        filter_times.append(filter_seconds)
        raw = judge.error(lightmap.at_probes(pixels))
        cells = [f"Cycles, {n} a pixel", "", f"{seconds:.1f}", f"{raw:.2%}", f"{filter_seconds:.1f}"]
        rows.append([*cells, *judge.cells(value), *[""] * 4])
    per_sample, start = np.polyfit(samples, times, 1, w=1 / np.array(times))
    start = max(start, 0) + np.mean(filter_times)
    name, n = "Cycles and OpenImageDenoise", np.array(samples, float)
    return rows, [Rival(name, n, np.array(curve), start, per_sample) for curve in (errors, medians)]


def measure_ours(lightmap, judge, quality, rivals):
    """Cells of `HEAD` from "Bake" on, with each of `DENOISERS`."""
    settings = settings_for(quality)
    workers = Workers(settings.seed, settings.n_threads)
    began = perf_counter()
    job = _our_job(lightmap)
    start = perf_counter()
    tracer = EmbreeTracer(job.scene)
    points = job.targets[0].samples(job.scene, tracer, workers, [])
    light = bake(job.scene, points.receivers, settings, tracer)
    seconds = perf_counter() - start
    for denoiser in DENOISERS:
        of_target = replace(points.target, settings=replace(points.target.settings, denoiser=denoiser))
        finishing = perf_counter()
        (pixels,) = replace(points, target=of_target).finish(light, workers).images
        more = perf_counter() - finishing
        value = lightmap.at_probes(pixels)
        cells = [f"ours, {quality}, {denoiser}", f"{start - began:.1f}", f"{seconds:.1f}", "", f"{more:.1f}"]
        gains = zip(rivals, (judge.error(value), judge.median(value)), strict=True)
        faster = [cell for rival, error in gains for cell in _gain(rival, error, seconds + more)]
        yield [*cells, *judge.cells(value), *faster]


def _gain(rival, error, seconds):
    """Two cells of `HEAD`: the rival's seconds, and how often ours are in them."""
    needed, extrapolated = rival.to_reach(error)
    return f"{needed:,.0f}", f"{needed / seconds:.1f}{' (extrapolated)' if extrapolated else ''}"


def _our_job(lightmap):
    """What a bake of ours to the same image needs."""
    settings = LightmapSettings(uv_map=UV_MAP, size=lightmap.image.size[0])
    with tempfile.TemporaryDirectory() as folder:
        wanted = LightmapRequest(settings, Path(folder), bpy.context.scene.name)
        return BakeJob.prepare(bpy.context, [wanted], Progress(), [lightmap.obj.name])


def measure(name, path, n_texels, qualities):
    """Rows of `HEAD`."""
    truth = open_scene(name, path)
    lightmap = make_lightmap(name, n_texels)
    judge = Judge.of(replace(truth, keep=truth.keep & ~np.isnan(lightmap.uv).any(axis=1)))
    rows, rivals = measure_cycles(lightmap, judge)
    rows += [row for quality in qualities for row in measure_ours(lightmap, judge, quality, rivals)]
    size = f"{lightmap.image.size[0]}²"
    return [[name, f"{lightmap.n_texels:,}", size, *row] for row in rows]


def tables(scenes, wanted=SCENES):
    """The table of `make bench`."""
    paths = {**scenes, **dict.fromkeys(OWN_SCENES)}
    rows = []
    for name, (sizes, qualities) in wanted.items():
        if name in paths:
            rows += [row for n in sizes for row in measure(name, paths[name], n, qualities)]
    return [table(TITLE, HEAD, rows)]


if __name__ == "__main__":
    parser = scene_options(__doc__)
    parser.add_argument("--scene", nargs="+", default=list(SCENES))
    parser.add_argument("--texels", nargs="+", type=int)
    parser.add_argument("--quality", nargs="+")
    given = parser.parse_args()
    usual = {name: SCENES.get(name, (SIZES, QUALITIES)) for name in given.scene}
    chosen = {name: (given.texels or sizes, given.quality or qualities) for name, (sizes, qualities) in usual.items()}
    tables(scenes_in(given.scenes), chosen)
