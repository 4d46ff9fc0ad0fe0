"""Measures lightmaps: error at the probes, read bilinearly through the UVs; jumps along seams; texel use; time.

    python tests/bench/lightmaps.py [--scenes DIR] [--scene NAME…] [--density N…] [--quality NAME] [--texels N]

Probes that no light reaches lie inside of solids, which nobody sees: the error is that of the others, and in a column
of its own that of all. The probes gather too, in the same bake: what their light is off is not the lightmap's doing.

A scene whose objects would take more than so many texels is measured on those with most probes for their texels.
"""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
from figures import scene_options, scenes_in, table
from lightmap_uvs import left_out
from mathutils.bvhtree import BVHTree
from photon_bake.addon.blender import bake_objects
from photon_bake.addon.blender.lightmap.meshes import check_lightmap_object
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.lightmap.borders import REAL_JUMP
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.receivers.uv_maps import areas
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest

HEAD = ["Scene", "Texels a metre", "Denoiser", "Objects", "Texels", "Use", "Probes", "Seconds", "Relative RMSE"]
HEAD += ["Median", "Gathered at the probes", "Inside solids too", "Mean", "Seam jump, 99 %", "At smooth folds"]
DENSITIES = (8.0, 64.0)
MOST_TEXELS = 1_500_000
REACH = 0.05  # m, from a probe to its surface: classroom has them 3 cm off the walls
FLAT = np.radians(30)  # seams that turn by more are folds, whose normals are smooth all the same


@dataclass(frozen=True)
class Probes:
    """The n probes of a scene: position, normal and truth (n, 3), and how sure that is, (n, 3)."""

    position: np.ndarray
    normal: np.ndarray
    mean: np.ndarray
    stderr: np.ndarray

    @staticmethod
    def read(path):
        with np.load(path) as file:
            return Probes(*(file[name][file["keep"]] for name in ("position", "normal", "mean", "stderr")))

    def where(self, chosen):
        return Probes(*(getattr(self, name)[chosen] for name in ("position", "normal", "mean", "stderr")))

    def receivers(self):
        """A millimetre off the surface."""
        position = (self.position + 1e-3 * self.normal).astype(np.float32)
        return Receivers(position, self.normal.astype(np.float32), np.full(len(position), 0.01, np.float32))

    def relative_rmse(self, value):
        """RMS error over the mean, the truth's own noise taken out."""
        error2 = np.mean((value - self.mean) ** 2) - np.mean(self.stderr**2)
        return float(np.sqrt(max(error2, 0)) / self.mean.mean())

    def median_error(self, value):
        """Median of the errors over each probe's own light."""
        return float(np.median(np.abs(value - self.mean).mean(axis=1) / self.mean.mean(axis=1)))


def joined(receivers, others):
    """All receivers, for the targets of the first ones."""
    names = ("position", "normal", "footprint")
    parts = (np.concatenate([getattr(of, name) for of in (receivers, others)]) for name in names)
    return Receivers(*parts, targets=receivers.targets)


def under(position, normal, corners):
    """The triangle (t, 3, 3) under each of n places and barycentric coordinates there; −1 where there is none.

    Of those that lie there, the nearest that faces as the place does, or else the nearest that faces away.
    """
    tree = BVHTree.FromPolygons(corners.reshape(-1, 3).tolist(), np.arange(corners.size // 3).reshape(-1, 3).tolist())
    triangle, weights = np.full(len(position), -1), np.zeros((len(position), 3))
    for i, (at, up) in enumerate(zip(position.tolist(), normal.tolist(), strict=True)):
        near = [one for one in tree.find_nearest_range(at, REACH) if abs(one[1].dot(up)) > 0.9]
        if not near:
            continue
        place, _, found, _ = min(near, key=lambda one: one[3] + (REACH if one[1].dot(up) < 0 else 0))
        a, b, c = corners[found].astype(np.float64)
        across = np.cross(b - a, c - a)
        ends = [np.cross(q - p, np.array(place) - p) @ across for p, q in ((b, c), (c, a), (a, b))]
        triangle[i], weights[i] = found, np.array(ends) / (across @ across)
    return triangle, weights


def chosen_objects(scene, probes, density, most_texels):
    """Objects to bake: all, or those with most probes for their texels."""
    graph = bpy.context.evaluated_depsgraph_get()
    objects = [o for o in bake_objects(graph, None, [], check_lightmap_object) if not left_out(scene, o)]
    worth = []
    for obj in objects:
        mesh = obj.data
        mesh.calc_loop_triangles()
        triangles = np.empty(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        positions = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", positions.ravel())
        matrix = np.array(obj.matrix_world)
        corners = (positions @ matrix[:3, :3].T + matrix[:3, 3])[triangles.reshape(-1, 3)]
        n_texels = areas(corners).sum() * density**2
        n_probes = (under(probes.position, probes.normal, corners)[0] >= 0).sum()
        worth.append((n_probes / n_texels, n_texels, obj.name))
    if sum(n for _, n, _ in worth) <= most_texels:
        return [name for _, _, name in worth]
    names, total = [], 0.0
    for share, n, name in sorted(worth, reverse=True):
        if share > 0 and total + n <= most_texels:
            names, total = [*names, name], total + n
    return names


def bilinear(images, image, uv):
    """Images read at places (n, 2) in [0, 1] as graphics cards do, (n, 3)."""
    values = np.zeros((len(uv), 3))
    for i, pixels in enumerate(images):
        own = np.flatnonzero(image == i)
        height, width = pixels.shape[:2]
        place = uv[own] * (width, height) - 0.5
        low = np.floor(place).astype(int)
        part = place - low
        for x in (0, 1):
            for y in (0, 1):
                column, row = np.clip(low[:, 0] + x, 0, width - 1), np.clip(low[:, 1] + y, 0, height - 1)
                weight = (part[:, 0] if x else 1 - part[:, 0]) * (part[:, 1] if y else 1 - part[:, 1])
                values[own] += weight[:, None] * pixels[row, column]
    return values


def seam_jump(images, seams, chosen, mean):
    """Cell: 99th percentile of the difference between the two sides of some seams, over the mean light.

    Seams that part lit surfaces from unlit ones, as where one of them is in a solid, are not meant.
    """
    if not chosen.any():
        return "none"
    sizes = np.array([image.shape[1::-1] for image in images])
    at, place = seams.image[chosen], seams.place[chosen]
    sides = [bilinear(images, at[:, k], place[:, k] / sizes[at[:, k]]) for k in (0, 1)]
    jump = np.abs(sides[0] - sides[1]).mean(axis=1)
    one_surface = jump <= REAL_JUMP * np.maximum(*sides).mean(axis=1)
    return f"{np.percentile(jump[one_surface], 99) / mean:.2%} of {one_surface.mean():.0%}"


def measure(name, path, density, quality, most_texels):
    """Rows of `HEAD`, with the denoiser and without."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    probes = Probes.read(path.with_suffix(".npz"))
    names = chosen_objects(name, probes, density, most_texels)
    start, settings = perf_counter(), settings_for(quality)
    with tempfile.TemporaryDirectory() as folder:
        wanted = LightmapRequest(LightmapSettings(density=density, max_size=8192), Path(folder), name)
        job = BakeJob.prepare(bpy.context, [wanted], Progress(), names)
    (target,) = job.targets
    tracer, workers = EmbreeTracer(job.scene), Workers(settings.seed, settings.n_threads)
    points = target.samples(job.scene, tracer, workers, [])
    light = bake(job.scene, joined(points.receivers, probes.receivers()), settings, tracer)
    seconds = perf_counter() - start
    at_probes = light.value[len(points.receivers) :] / np.pi
    light = replace(light, value=light.value[: len(points.receivers)], stderr=light.stderr[: len(points.receivers)])
    corners, uv = (np.concatenate([getattr(mesh, what) for mesh in target.meshes]) for what in ("positions", "uv"))
    image = np.repeat([mesh.image for mesh in target.meshes], [len(mesh.uv) for mesh in target.meshes])
    triangle, weights = under(probes.position, probes.normal, corners)
    probes, at_probes = probes.where(triangle >= 0), at_probes[triangle >= 0]
    triangle, weights = triangle[triangle >= 0], weights[triangle >= 0]
    place = np.einsum("nk,nkd->nd", weights, uv[triangle])
    rows, seams = [], points.texels.seams
    flat, seen = seams.fold <= FLAT, probes.mean.max(axis=1) > 0
    for denoiser in ("none", "own", "oidn"):
        object.__setattr__(target.settings, "denoiser", denoiser)
        start = perf_counter()
        product = points.finish(light, workers)
        counts, took = product.counts, seconds + perf_counter() - start
        value = bilinear(product.images, image[triangle], place)
        rows.append(
            [
                name,
                f"{density:g}",
                denoiser,
                f"{len(names)}",
                f"{counts['covered_texels']:,}",
                f"{counts['covered_texels'] / counts['lightmap_texels']:.0%}",
                f"{len(value)}",
                f"{took:.1f}",
                f"{probes.where(seen).relative_rmse(value[seen]):.2%}",
                f"{probes.where(seen).median_error(value[seen]):.1%}",
                f"{probes.where(seen).relative_rmse(at_probes[seen]):.2%}",
                f"{probes.relative_rmse(value):.2%}",
                f"{value.mean() / probes.mean.mean() - 1:+.2%}",
                *(seam_jump(product.images, seams, chosen, value.mean()) for chosen in (flat, ~flat)),
            ]
        )
    return rows


def tables(scenes, densities=DENSITIES, quality="medium", most_texels=MOST_TEXELS):
    """The table of `make bench`."""
    names = [name for name in scenes if name in ("cornell", "oa_bases3")]
    rows = [row for name in names for d in densities for row in measure(name, scenes[name], d, quality, most_texels)]
    return [table(f"Lightmaps at quality {quality}", HEAD, rows)]


if __name__ == "__main__":
    parser = scene_options(__doc__)
    parser.add_argument("--scene", nargs="+", default=["cornell", "oa_bases3"])
    parser.add_argument("--density", nargs="+", type=float, default=DENSITIES)
    parser.add_argument("--quality", default="medium")
    parser.add_argument("--texels", type=int, default=MOST_TEXELS)
    given = parser.parse_args()
    paths = {name: path for name, path in scenes_in(given.scenes).items() if name in given.scene}
    tables(paths, given.density, given.quality, given.texels)
