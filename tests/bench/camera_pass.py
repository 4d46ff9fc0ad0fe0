"""The camera's pass against Cycles' pass Diffuse Indirect, in the same pixels: error, time, and time at equal error.

    .venv/bin/python tests/bench/camera_pass.py [--scenes DIR] [--size 1920 1080] [--scene NAME…]
        [--quality Q…] [--gather G…]

Truth is Cycles' pass in tiles of the picture, in two renders with seeds of their own, which are kept in build/truth.
Where a and b are the two and x is a result, the mean of (x − a)(x − b) is its squared error, free of the truth's own
noise. A hundredth of the pixels, those that the two disagree on most, is left out: bright specks are in them.

Caustics are in Cycles' pass too, so that ours are added: over the albedo. What Cycles needs for an error is told from
its errors at a few numbers of samples in the tiles, where they go as a power of them, and from its time for a sample of
the whole picture; with a denoiser it is OpenImageDenoise on its pass with ours as guides, and our time for that added.
"""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
import OpenEXR
from figures import ROOT, scene_options, scenes_in, table
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.oidn import filtered
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest

NAMES = ("cornell", "classroom")
GATHERS = ("final", "photon_volumes")
HEAD = ["Scene", "Gather", "Quality", "Time, s", "Error", "Mean", "Cycles, s", "times", "Cycles and OIDN, s", "times"]
TITLE = "The camera's pass: time at equal error, against Cycles' Diffuse Indirect"
TILES = (4, 2)
TILE = 96  # pixels
TRUTH_SAMPLES = 192
LEVELS = (4, 16, 64)  # samples
LEAST_ALBEDO = 0.02
KNOWN = 0.99  # of the pixels
FOLDER = ROOT / "build/truth"


@dataclass(frozen=True)
class Tiles:
    """Squares of a picture, evenly spread: (first row, first column) each."""

    corners: list[tuple[int, int]]
    side: int

    @staticmethod
    def of(width, height):
        side = min(TILE, width // TILES[0], height // TILES[1])
        rows, columns = _evenly(height, TILES[1], side), _evenly(width, TILES[0], side)
        return Tiles([(row, column) for row in rows for column in columns], side)

    def cut(self, picture):
        """The tiles of a picture (h, w, …), one after the other."""
        return np.stack([picture[row : row + self.side, column : column + self.side] for row, column in self.corners])


def _evenly(size, n, side):
    """Where n parts of a length begin that lie in the middles of n equal ones."""
    return [int((i + 0.5) * size / n - side / 2) for i in range(n)]


def open_scene(path, width, height):
    """Open a scene for Cycles' passes at a resolution."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, render.resolution_percentage = "CYCLES", 100
    render.resolution_x, render.resolution_y = width, height
    render.use_persistent_data, render.use_compositing = True, False
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    for limit in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(cycles, limit, 32)
    layer = bpy.context.view_layer
    layer.use_pass_diffuse_indirect = layer.use_pass_diffuse_color = layer.use_pass_normal = True
    if "Probes" in bpy.data.objects:
        bpy.data.objects["Probes"].hide_render = True
    image = render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    return scene


def rendered(scene, samples, seed):
    """Cycles' indirect diffuse light, albedo and normal, (h, w, 9)."""
    scene.cycles.samples, scene.cycles.seed = samples, seed
    path = Path(bpy.app.tempdir) / "passes.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        found = {
            name.split(".", 1)[1]: np.array(channel.pixels, np.float32)
            for part in file.parts
            for name, channel in part.channels.items()
        }
    names = [("Diffuse Indirect", "DiffInd", "RGB"), ("Diffuse Color", "DiffCol", "RGB"), ("Normal", "Normal", "XYZ")]
    return np.stack(
        [found.get(f"{long}.{c}", found.get(f"{short}.{c}")) for long, short, axes in names for c in axes], axis=-1
    )


def rendered_tiles(scene, tiles, samples, seed):
    """The same in tiles, (tiles, side, side, 9)."""
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    parts = []
    for row, column in tiles.corners:
        render.border_min_x = (column + 0.01) / render.resolution_x
        render.border_max_x = (column + tiles.side + 0.01) / render.resolution_x
        render.border_max_y = 1 - (row - 0.01) / render.resolution_y
        render.border_min_y = 1 - (row + tiles.side - 0.01) / render.resolution_y
        parts.append(rendered(scene, samples, seed))
    render.use_border = render.use_crop_to_border = False
    return np.stack(parts)


def truth_of(name, scene, tiles, width, height):
    """Two renders of the tiles, kept for the next time."""
    path = FOLDER / f"camera_{name}_{width}x{height}_{TRUTH_SAMPLES}.npy"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, np.stack([rendered_tiles(scene, tiles, TRUTH_SAMPLES, seed) for seed in (1, 2)]))
    return np.load(path)


@dataclass(frozen=True)
class Judge:
    """What a result's error is told by: truth a and b, (tiles, side, side, 3), and the pixels that count."""

    a: np.ndarray
    b: np.ndarray
    counts: np.ndarray

    @staticmethod
    def of(truth):
        a, b = truth[..., :3]
        lit = truth[..., 3:6].min(axis=(0, 4)) > LEAST_ALBEDO
        apart = np.abs(a - b).max(axis=-1)
        return Judge(a, b, lit & (apart <= np.quantile(apart[lit], KNOWN)))

    @property
    def mean(self):
        return float((self.a + self.b)[self.counts].mean()) / 2

    def error(self, x):
        """Relative RMSE."""
        square = float(np.mean(((x - self.a) * (x - self.b))[self.counts]))
        return np.sqrt(max(square, 0.0)) / self.mean

    def bias(self, x):
        """Deviation of the mean."""
        return float(x[self.counts].mean()) / self.mean - 1


def ours(gather, quality, folder):
    """Our pass with caustics, (h, w, 3), our guides, and the seconds for all of it and for the denoiser alone."""
    start, progress = perf_counter(), Progress()
    job = BakeJob.prepare(bpy.context, [CameraRequest(CameraSettings(), Path(folder))], progress)
    solved = job.solve(settings_for(quality, gather=gather), progress)
    job.write(solved, progress)
    seconds = perf_counter() - start
    passes = solved.outputs[0].passes
    light = passes.indirect_diffuse + passes.caustics / np.maximum(passes.albedo, np.float32(LEAST_ALBEDO))
    return light, passes, seconds, progress.stage_seconds.get("Denoising the pass", 0.0)


def samples_for(error, levels, errors):
    """Samples at which an error is reached, by a straight line through the logarithms; infinite if it does not fall."""
    slope, at_one = np.polyfit(np.log(levels), np.log(np.maximum(errors, 1e-6)), 1)
    return float(np.exp((np.log(max(error, 1e-6)) - at_one) / slope)) if slope < 0 else np.inf


def measure(name, path, ways, size):
    """Rows of `HEAD`."""
    width, height = size
    scene, tiles = open_scene(path, width, height), Tiles.of(width, height)
    judge = Judge.of(truth_of(name, scene, tiles, width, height))
    found = {way: ours(*way, ROOT / "build/passes") for way in ways}
    guides = {"albedo": np.clip(found[ways[0]][1].albedo, 0, 1), "normal": found[ways[0]][1].normal}

    times = []
    for samples in (1, 3):
        start = perf_counter()
        rendered(scene, samples, 0)
        times.append(perf_counter() - start)
    per_sample = (times[1] - times[0]) / 2
    noisy = [rendered_tiles(scene, tiles, samples, 3)[..., :3] for samples in LEVELS]
    plain = [judge.error(x) for x in noisy]
    cut = {kind: tiles.cut(guide) for kind, guide in guides.items()}
    smooth = [judge.error(np.stack([denoised(x[i], cut, i) for i in range(len(x))])) for x in noisy]

    rows = []
    for way, (light, _, seconds, denoising) in found.items():
        x = tiles.cut(light)
        error = judge.error(x)
        by_cycles = samples_for(error, LEVELS, plain) * per_sample
        by_both = samples_for(error, LEVELS, smooth) * per_sample + denoising
        cells = [f"{seconds:.0f}", f"{error:.2%}", f"{judge.bias(x):+.2%}"]
        for rival in (by_cycles, by_both):
            cells += [f"{rival:.0f}", f"{rival / seconds:.1f}"]
        rows.append([name, *way, *cells])
    print(f"{name}: Cycles {per_sample:.2f} s a sample; errors at {LEVELS}: {plain}, denoised {smooth}", flush=True)
    return rows


def denoised(picture, guides, i):
    """A tile of Cycles' pass through OpenImageDenoise."""
    return filtered("RT", picture, {"hdr": True, "cleanAux": True}, {kind: guide[i] for kind, guide in guides.items()})


def tables(scenes, qualities=("draft", "medium"), size=(1920, 1080), gathers=GATHERS):
    """The table of `make bench`."""
    ways = [(gather, quality) for gather in gathers for quality in qualities]
    rows = [row for name in NAMES if name in scenes for row in measure(name, scenes[name], ways, size)]
    return [table(f"{TITLE}, {size[0]} × {size[1]}", HEAD, rows)]


if __name__ == "__main__":
    parser = scene_options(__doc__)
    parser.add_argument("--scene", nargs="+", default=NAMES)
    parser.add_argument("--quality", nargs="+", default=["draft", "medium"])
    parser.add_argument("--size", nargs=2, type=int, default=[1920, 1080])
    parser.add_argument("--gather", nargs="+", default=GATHERS)
    given = parser.parse_args()
    paths = {name: path for name, path in scenes_in(given.scenes).items() if name in given.scene}
    tables(paths, given.quality, tuple(given.size), given.gather)
