"""Measures lightmaps near edges and contacts: as they are by default, against a bake without interpolation.

    python tests/bench/contacts.py [FILE.blend…] [--scenes DIR] [--scene NAME…] [--texels N] [--rays N] [--pictures DIR]

Both gathers look into the same radiance cache, so what photons are off by is in neither. The texels are those within 3
texels of an edge: where a chart ends, where another surface stands in the texel, where a solid covers it. Finished
lightmaps are read bilinearly where light was gathered, as renderers do; the difference is divided by its standard
error, made of what both bakes say of their own. Of more than --most such texels as many are drawn by chance. Pictures
show the lightmap with most of them: by default, without interpolation, and the difference (red: too bright, blue: too
dark, full at a quarter of the mean light), over a darkened lightmap.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import bpy
import numpy as np
from figures import scene_options, scenes_in, table, write_png
from lightmap_uvs import left_out
from lightmaps import bilinear
from own_scenes import OWN_SCENES, build
from photon_bake.addon.blender import bake_objects
from photon_bake.addon.blender.lightmap.meshes import check_lightmap_object
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.emitters import region_of
from photon_bake.addon.gather import FinalGather, SampleBudget
from photon_bake.addon.output.lightmap import FinishOptions, finish_lightmaps
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.receivers.uv_maps.faces import areas
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest
from scipy.ndimage import distance_transform_cdt

TITLE = "Lightmaps near edges and contacts, against a bake without interpolation"
HEAD = ["Scene", "Texels", "Near edges", "Compared", "Records", "Median", "99 %", "RMS error / said"]
HEAD += ["Difference, 99 %", "Off by over 10 %", "Reference's error", "Gather, processor s"]
NAMES = ("cornell", "oa_bases3", "window")
LEFT_OUT = ("Probes", "Ground")
NEAR = 3  # texels
N_TEXELS, N_RAYS, MOST = 40_000, 2048, 6_000
SHOWN = 0.25  # of the mean light: the difference at which a picture's colour is full
PIXELS = 900  # along the longer side of a picture's parts


@dataclass(frozen=True)
class Baked:
    """Lightmaps of one scene, by default and without interpolation.

    Attributes
    ----------
    light, reference : list of (h, w) float32
        Finished, W/m² over π, mean of the colours.
    seen, seen_reference : list of (h, w) float64
        The same as they are read where texels' light was gathered.
    error : list of (h, w) float64
        Standard error of the difference.
    reference_error : list of (h, w) float64
    near, compared : list of (h, w) bool
    n_records : int
    seconds : float
        Of all threads, for the gather by default.
    """

    light: list
    reference: list
    seen: list
    seen_reference: list
    error: list
    reference_error: list
    near: list
    compared: list
    n_records: int
    seconds: float


def near_edges(texels):
    """Covered texels within `NEAR` texels of an edge, (h, w) bool for each image; and which are covered."""
    both = []
    for image, (height, width) in enumerate(texels.sizes):
        k = np.flatnonzero(texels.image == image)
        row, column, chart = texels.row[k], texels.column[k], texels.chart[k]
        charts = np.full((height, width), -1, np.int32)
        charts[row, column] = chart
        number = np.zeros((height, width), np.int32)
        np.add.at(number, (row, column), 1)
        edge = (number > 1) | (charts < 0)
        for axis in (0, 1):
            differs = np.diff(charts, axis=axis) != 0
            pad = ((1, 0), (0, 0)) if axis == 0 else ((0, 0), (1, 0))
            edge |= np.pad(differs, pad) | np.pad(differs, tuple(p[::-1] for p in pad))
        edge = np.pad(edge, 1, constant_values=True)  # an image's border is a chart's
        close = distance_transform_cdt(~edge, "chessboard")[1:-1, 1:-1] <= NEAR
        both.append((close & (charts >= 0), charts >= 0))
    return [near for near, _ in both], [covered for _, covered in both]


def density_for(objects, n_texels):
    """Texels a metre with which objects have about so many."""
    total = 0.0
    for obj in objects:
        mesh, matrix = obj.data, np.array(obj.matrix_world)
        mesh.calc_loop_triangles()
        triangles = np.empty(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        positions = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", positions.ravel())
        total += areas((positions @ matrix[:3, :3].T + matrix[:3, 3])[triangles.reshape(-1, 3)]).sum()
    return float(np.sqrt(n_texels / total))


def gathered(solution, receivers, budget, extent, seed):
    workers = Workers(seed, solution.settings.n_threads)
    gather = FinalGather(solution.rays, receivers, budget, extent, solution.tracer.surfaces, workers)
    return gather.finish()


def bake_twice(name, given):
    """Lightmaps of the open scene, called `name`: `Baked`."""
    graph = bpy.context.evaluated_depsgraph_get()
    objects = [o for o in bake_objects(graph, None, [], check_lightmap_object) if not left_out(name, o)]
    objects = [o for o in objects if o.name not in LEFT_OUT and (not given.object or o.name in given.object)]
    lightmaps = LightmapSettings(density=given.density or density_for(objects, given.texels), max_size=8192)
    with tempfile.TemporaryDirectory() as folder:
        wanted = LightmapRequest(lightmaps, Path(folder), name)
        job = BakeJob.prepare(bpy.context, [wanted], Progress(), [o.name for o in objects])
    settings = settings_for(given.quality)
    tracer, workers = EmbreeTracer(job.scene), Workers(settings.seed, settings.n_threads)
    points = job.targets[0].samples(job.scene, tracer, workers, [])
    receivers, texels = points.receivers, points.texels
    solution = solve(job.scene, receivers, settings, tracer)
    solution.rays  # the cache, which both share  # noqa: B018
    extent = max(2 * region_of(receivers.position).radius, 1e-3)
    start = process_time()
    ours = gathered(solution, receivers, SampleBudget(settings.n_gather_rays), extent, 0)
    seconds = process_time() - start
    near, _ = near_edges(texels)
    compared = drawn(near, given.most)
    at = np.zeros(len(texels), bool)
    for image, mask in enumerate(compared):
        k = np.flatnonzero(texels.image == image)
        at[k] = mask[texels.row[k], texels.column[k]]
    k = np.flatnonzero(at)
    sure = gathered(solution, receivers.where(k), SampleBudget(given.rays, interpolate=False), extent, 1)
    value, known = ours.light.irradiance.copy(), np.zeros(len(at))
    value[k], known[k] = sure.light.irradiance, sure.light.stderr
    options = FinishOptions(denoiser="none")
    # What an interpolating bake is off by is common to a texel's receivers; the noise of gathering ones is not
    own, of_reference = means(ours.light.stderr, texels), means(known, texels, True)
    light, reference = (
        [one.light.mean(axis=2) for one in finish_lightmaps(v / np.pi, known, receivers, texels, options)]
        for v in (ours.light.irradiance, value)
    )
    return Baked(
        light,
        reference,
        *(looked_up(images, texels) for images in (light, reference)),
        [np.hypot(a, b) / np.pi for a, b in zip(own, of_reference, strict=True)],
        [one / np.pi for one in of_reference],
        near,
        compared,
        ours.n_records,
        seconds,
    )


def looked_up(images, texels):
    """Images read bilinearly at the mean place of each texel's receivers, (h, w) each."""
    uv = np.stack(
        [np.concatenate([means(texels.uv[:, i], texels)[k].ravel() for k in range(len(images))]) for i in (0, 1)]
    )
    number = np.repeat(np.arange(len(images)), [image.size for image in images])
    read = bilinear([image[..., None] for image in images], number, uv.T)[:, 0]
    return [part.reshape(image.shape) for part, image in zip(np.split(read, ends(images)), images, strict=True)]


def ends(images):
    return np.cumsum([image.size for image in images])[:-1]


def drawn(masks, most):
    """So many of the masks' places by chance, or all."""
    total = sum(int(mask.sum()) for mask in masks)
    random = np.random.default_rng(0)
    return [mask & (random.random(mask.shape) < most / max(total, 1)) for mask in masks]


def means(values, texels, independent=False):
    """Means (h, w) of the texels' receivers for each image; or the standard errors of means of independent values."""
    images = []
    for image, size in enumerate(texels.sizes):
        k = np.flatnonzero(texels.image == image)
        texel, weight = texels.row[k].astype(np.int64) * size[1] + texels.column[k], texels.weight[k].astype(float)
        power = 2 if independent else 1
        sums = np.bincount(texel, (weight * values[k]) ** power, size[0] * size[1]) ** (1 / power)
        total = np.maximum(np.bincount(texel, weight, size[0] * size[1]), 1e-30)
        images.append((sums / total).reshape(size))
    return images


def row_of(name, baked):
    """Cells of `HEAD`."""
    chosen = np.concatenate([mask.ravel() for mask in baked.compared])
    light, reference, error, known = (
        np.concatenate([image.ravel() for image in images])[chosen].astype(float)
        for images in (baked.seen, baked.seen_reference, baked.error, baked.reference_error)
    )
    off, mean = np.abs(light - reference), reference.mean()
    ratio = off / np.maximum(error, 1e-3 * mean)
    return [
        name,
        f"{sum(image.size for image in baked.light):,}",
        f"{sum(int(mask.sum()) for mask in baked.near):,}",
        f"{chosen.sum():,}",
        f"{baked.n_records:,}",
        f"{np.median(ratio):.2f}",
        f"{np.percentile(ratio, 99):.2f}",
        f"{np.sqrt(np.mean(ratio**2)):.2f}",
        f"{np.percentile(off, 99) / mean:.1%}",
        f"{np.mean(off > 0.1 * mean):.2%}",
        f"{np.sqrt(np.mean(known**2)) / mean:.1%}",
        f"{baked.seconds:.1f}",
    ]


def pictures(name, baked, folder):
    """Pictures of the lightmap with most texels compared."""
    folder.mkdir(parents=True, exist_ok=True)
    k = int(np.argmax([mask.sum() for mask in baked.compared]))
    light, reference = baked.light[k], baked.reference[k]
    white = np.percentile(reference[reference > 0], 98) if (reference > 0).any() else 1.0
    grey = [np.repeat(np.clip(image / white, 0, 1)[..., None] ** (1 / 2.2), 3, axis=2) for image in (light, reference)]
    mean = np.mean(np.concatenate([image[mask] for image, mask in zip(baked.reference, baked.compared, strict=True)]))
    off = np.clip((light - reference) / (SHOWN * mean), -1, 1)[..., None]
    shown = grey[1] * 0.4 + 0.6 * np.where(off > 0, off * [1, 0.1, 0], -off * [0.1, 0.4, 1])
    scale = max(1, PIXELS // max(light.shape))
    large = [np.repeat(np.repeat(part[::-1], scale, 0), scale, 1) for part in (*grey, np.clip(shown, 0, 1))]
    gap = np.ones((large[0].shape[0], 8, 3))
    write_png(folder / f"contacts_{name}.png", np.hstack([large[0], gap, large[1], gap, large[2]]))


def measure(name, path, given):
    """A row of `HEAD`, with pictures where they are asked for."""
    if path is None:
        build(name)
    else:
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()))
    baked = bake_twice(name, given)
    if given.pictures:
        pictures(name, baked, given.pictures)
    return row_of(name, baked)


def options():
    parser = scene_options(__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE.blend", help="scenes besides")
    parser.add_argument("--scene", nargs="*", default=list(NAMES), help=f"of {', '.join(NAMES)}")
    parser.add_argument("--object", nargs="+", help="bake these alone")
    parser.add_argument("--texels", type=int, default=N_TEXELS, help="of all lightmaps together, about")
    parser.add_argument("--density", type=float, default=0.0, help="texels a metre, instead")
    parser.add_argument("--quality", default="medium")
    parser.add_argument("--rays", type=int, default=N_RAYS, help="of a receiver of the reference")
    parser.add_argument("--most", type=int, default=MOST, help="texels compared")
    return parser


def tables(scenes, given=None):
    """The table of `make bench`."""
    given = given or options().parse_args([])
    paths = {**{name: path for name, path in scenes.items() if name in given.scene}}
    paths |= {name: None for name in OWN_SCENES if name in given.scene}
    paths |= {f"{file.parent.name}/{file.stem}".replace("/", "-"): file for file in given.files}
    return [table(TITLE, HEAD, [measure(name, path, given) for name, path in paths.items()])]


if __name__ == "__main__":
    given = options().parse_args()
    tables(scenes_in(given.scenes), given)
