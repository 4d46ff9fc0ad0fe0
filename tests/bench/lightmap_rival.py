"""Measures the strongest rival of lightmaps: Cycles' image bake, and OpenImageDenoise's filter for lightmaps after it.

    python tests/bench/lightmap_rival.py [--scenes DIR] [--texels N…]

All objects of a scene become one, with one lightmap. Errors are those of the lightmap read bilinearly where the probes
are, as a shader reads it.
"""

from dataclasses import dataclass
from time import perf_counter

import bpy
import numpy as np
import pyoidn
from cycles_bakes import bake_indirect
from figures import scene_options, scenes_in, table
from own_scenes import OWN_SCENES
from photon_bake.addon.blender import extract_scene
from photon_bake.addon.tracers.embree import EmbreeTracer
from rivals import Rival
from truth import open_scene

SAMPLES = (1, 4, 16, 64)
HEAD = [
    "Scene",
    "Texels",
    "Image",
    "Samples",
    "Bake, s",
    "Relative RMSE",
    "Filter, s",
    "Relative RMSE after it",
    "Mean",
]
UV_MAP = "Lightmap"


@dataclass(frozen=True)
class Lightmap:
    """An object with all surfaces of a scene, its image, and where the n probes are in it.

    Attributes
    ----------
    obj, image : bpy.types.Object, bpy.types.Image
    uv : (n, 2) float64
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
        x, y = self.uv[:, 0] * width - 0.5, self.uv[:, 1] * height - 0.5
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


def make_lightmap(n_texels):
    """Join the meshes of Blender's scene into one with a lightmap of about so many texels.

    Every face is a chart of its own, packed by Blender's Lightmap Pack.
    """
    probes = bpy.data.objects["Probes"]
    obj = _joined([obj for obj in bpy.context.view_layer.objects if obj.type == "MESH" and obj != probes])
    obj.data.uv_layers.active = obj.data.uv_layers.new(name=UV_MAP)
    bpy.ops.uv.lightmap_pack(PREF_CONTEXT="ALL_FACES", PREF_PACK_IN_ONE=True, PREF_MARGIN_DIV=0.05)
    uv = _uv_of_triangles(obj.data)
    ab, ac = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    covered = np.abs(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]).sum() / 2
    side = round(np.sqrt(n_texels / covered))
    return Lightmap(obj, _image_in_all_materials(obj, side), _uv_under(probes, uv), round(covered * side**2))


def _joined(objects):
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.transform_apply()
    bpy.ops.object.join()
    bpy.context.view_layer.update()
    return objects[0]


def _uv_of_triangles(mesh):
    """The lightmap's coordinates of each triangle's corners, (t, 3, 2) float64."""
    mesh.calc_loop_triangles()
    corners = np.empty(len(mesh.loop_triangles) * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", corners)
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    mesh.uv_layers[UV_MAP].uv.foreach_get("vector", uv)
    return uv.reshape(-1, 2)[corners.reshape(-1, 3)].astype(np.float64)


def _image_in_all_materials(obj, side):
    image = bpy.data.images.new("Lightmap", side, side, alpha=False, float_buffer=True, is_data=True)
    for slot in obj.material_slots:
        nodes = slot.material.node_tree.nodes
        node = nodes.active = nodes.new("ShaderNodeTexImage")
        node.image = image
    return image


def _uv_under(probes, uv_of_triangle):
    """Where the surfaces under the probes are in the lightmap, (n, 2)."""
    corners = np.empty(len(probes.data.vertices) * 3, np.float32)
    probes.data.vertices.foreach_get("co", corners)
    a, b, c = corners.reshape(-1, 3, 3).swapaxes(0, 1)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    scene = extract_scene(bpy.context.evaluated_depsgraph_get())
    hits = EmbreeTracer(scene).closest_hit((a + b + c) / 3, -normal)
    weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)
    return np.einsum("nk,nkd->nd", weights, uv_of_triangle[hits.triangle])


def measure(name, path, n_texels):
    """Rows of `HEAD`, and the `Rival`."""
    truth = open_scene(name, path)
    lightmap, rows, errors, times, filter_times = make_lightmap(n_texels), [], [], [], []
    filtered(lightmap.bake(1)[0])  # what is done only once, such as loading the library
    for n in SAMPLES:
        pixels, seconds = lightmap.bake(n)
        smooth, filter_seconds = filtered(pixels)
        value = lightmap.at_probes(smooth)
        errors.append(truth.relative_rmse(value))
        times.append(seconds)
        filter_times.append(filter_seconds)
        raw = truth.relative_rmse(lightmap.at_probes(pixels))
        cells = [f"{n}", f"{seconds:.1f}", f"{raw:.2%}", f"{filter_seconds:.1f}", f"{errors[-1]:.2%}"]
        size = f"{lightmap.image.size[0]}²"
        rows.append([name, f"{lightmap.n_texels:,}", size, *cells, f"{truth.bias(value):+.2%}"])
    per_sample, start = np.polyfit(SAMPLES, times, 1, w=1 / np.array(times))
    start = max(start, 0) + np.mean(filter_times)
    return rows, Rival("Cycles and OpenImageDenoise", np.array(SAMPLES, float), np.array(errors), start, per_sample)


def main():
    parser = scene_options(__doc__)
    parser.add_argument("--texels", nargs="+", type=int, default=[200_000])
    parser.add_argument("--scene", nargs="+", default=["cornell"])
    options = parser.parse_args()
    paths = {**scenes_in(options.scenes), **dict.fromkeys(OWN_SCENES)}
    rows = [row for name in options.scene for n in options.texels for row in measure(name, paths[name], n)[0]]
    table("Cycles' image bake and OpenImageDenoise's filter for lightmaps", HEAD, rows)


if __name__ == "__main__":
    main()
