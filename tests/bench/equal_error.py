"""Measures the speed at equal error: ours and Cycles' vertex bake of the same receivers, against converged truth.

    python tests/bench/run.py --only speed [--scene NAME] [--receivers N] [--quality Q] [--seeds N] [--cycles-anew]
                              [--pictures DIR]

Receivers are the vertices of a dense mesh over all surfaces round the probes; errors are those of the probes' single
vertices, which are baked together with it. Both are seen by camera rays alone and change nothing.
"""

from dataclasses import dataclass, replace
from time import perf_counter

import bpy
import growth
import numpy as np
import rivals
from error_plot import error_plot
from figures import rendered_scene, table
from memory import extra_memory
from own_scenes import OWN_SCENES
from photon_bake.addon.blender import in_render_graph, receiver_meshes
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Receivers, vertex_receivers
from photon_bake.addon.scene import Scene
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from receiver_grid import add_receivers, grown
from truth import Truth, open_scene

QUALITIES = ("draft", "medium", "high")
NUMBERS = (20_000, 200_000, 1_000_000)
MOST_MEASURED = ("cornell", "window")  # at every quality, and with a million receivers


@dataclass(frozen=True)
class Case:
    """A scene with so many receivers, the probes among them."""

    name: str
    n_asked: int
    scene: Scene
    receivers: Receivers
    truth: Truth
    seconds_to_read: float

    @staticmethod
    def open(name, path, n):
        """Open a scene of our own, or a file, and put about n receivers into it."""
        truth = open_scene(name, path)
        start = perf_counter()
        scene = rendered_scene()
        seconds = perf_counter() - start
        objects = [add_receivers(scene, grown(truth.position), n), bpy.data.objects["Probes"]]
        start = perf_counter()
        at = bpy.context.scene, bpy.context.view_layer
        meshes = in_render_graph(*at, lambda depsgraph: receiver_meshes(objects, depsgraph))
        receivers = vertex_receivers(meshes)
        return Case(name, n, scene, receivers, truth, seconds + perf_counter() - start)

    def bake(self, settings):
        return bake(self.scene, self.receivers, settings, EmbreeTracer(self.scene))

    def timed(self, settings):
        """What `bake` returns, the memory that it took, and seconds."""
        start = perf_counter()
        irradiance, memory = extra_memory(lambda: self.bake(settings))
        return irradiance, memory, perf_counter() - start

    def at_probes(self, values):
        """Those of the receivers' values that are the probes' vertices', (3n, …)."""
        return values[self.receivers.targets[1].receiver_of_element]


@dataclass(frozen=True)
class Point:
    """Bakes of ours with several seeds: their mean time and errors, and the rival's time to the same error."""

    case: Case
    quality: str
    seconds: float
    rmse: float
    bias: float
    median: float
    said: float
    calibration: tuple[float, float]
    memory: float | None
    rival: rivals.Rival

    @staticmethod
    def measure(case, quality, rival, n_seeds):
        baked = [case.timed(replace(settings_for(quality), seed=seed)) for seed in range(n_seeds)]
        lights, memory, seconds = zip(*baked, strict=True)
        values, truth = [case.at_probes(light.value) / np.pi for light in lights], case.truth
        rmse = np.sqrt(np.mean([truth.relative_rmse(value) ** 2 for value in values]))
        errors = rmse, np.mean([truth.bias(value) for value in values]), np.median([truth.median(v) for v in values])
        said = np.mean([light.relative_noise for light in lights])
        calibrated = calibration(truth, values, [case.at_probes(light.stderr) / np.pi for light in lights])
        return Point(case, quality, np.mean(seconds), *errors, said, calibrated, memory[0], rival)

    @property
    def row(self):
        """Cells of `HEAD`."""
        seconds, extrapolated = self.rival.to_reach(self.rmse)
        return [
            self.case.name,
            f"{len(self.case.receivers):,}",
            self.quality,
            f"{self.case.seconds_to_read:.1f}",
            f"{self.seconds:.1f}",
            f"{self.rmse:.2%}",
            f"{self.bias:+.2%}",
            f"{self.median:.1%}",
            f"{self.said:.1%}",
            *(f"{number:.2f}" for number in self.calibration),
            "" if self.memory is None else f"{self.memory:,.0f}",
            f"{seconds:,.0f}",
            f"{seconds / self.seconds:.1f}{' (extrapolated)' if extrapolated else ''}",
        ]


HEAD = ["Scene", "Receivers", "Quality", "Read, s", "Solve, s", "Relative RMSE", "Mean", "Median", "Said noise"]
HEAD += ["Error / said, RMS", "68% within", "MB more", "Cycles to the same error, s", "Speed-up"]
CYCLES_HEAD = ["Scene", "Receivers", "Start, s", "A sample a vertex, s", "M samples/s", "Cores it had"]


def calibration(truth, values, stderrs, darkest=1e-3):
    """How errors of several bakes compare with the standard errors that they said: RMS of their ratio, and its 68%
    quantile.

    Both should be 1. The truth's own standard error is added in quadrature to what was said. Vertices whose light is
    under a thousandth of the mean are left out: float32's rounding is the error there.
    """
    lit = truth.mean[truth.keep].mean(axis=1) > darkest * truth.kept_mean
    off = np.array([truth.off(value).mean(axis=2)[lit] for value in values])
    said = np.array([stderr.reshape(-1, 3)[truth.keep][lit] for stderr in stderrs])
    ratio = np.abs(off) / np.hypot(said, truth.stderr[truth.keep].mean(axis=1)[lit, None])
    return float(np.sqrt(np.mean(ratio**2))), float(np.quantile(ratio, 0.683))


def add_options(parser):
    """Options that choose what is measured."""
    of_speed = parser.add_argument_group("of the part speed")
    of_speed.add_argument("--scene", nargs="+", help=f"scenes, the shared ones or {', '.join(OWN_SCENES)}")
    of_speed.add_argument("--receivers", nargs="+", type=int, help="numbers of receivers")
    of_speed.add_argument("--quality", nargs="+", choices=QUALITIES)
    of_speed.add_argument("--seeds", type=int, default=1, help="how many bakes errors and seconds are means of")
    of_speed.add_argument("--cycles-anew", action="store_true", help="measure Cycles' errors again, not only its times")


def plan(names, options):
    """(scene, number of receivers, qualities) of what is to be measured, as asked or within a quarter of an hour."""
    for name in names:
        for n in options.receivers or NUMBERS:
            qualities = options.quality
            if not qualities:
                everything = name in MOST_MEASURED and n == NUMBERS[1]
                qualities = QUALITIES if everything else QUALITIES[1:2]
            if options.receivers or n < NUMBERS[2] or name in MOST_MEASURED:
                yield name, n, qualities


def measure(scenes, options):
    """Points, and rows of `CYCLES_HEAD`."""
    points, rows = [], []
    paths = {**scenes, **dict.fromkeys(OWN_SCENES)}
    names = options.scene or list(paths)
    if unknown := set(names) - set(paths):
        raise SystemExit(f"There is no scene {', '.join(unknown)}; choose from {', '.join(paths)}.")
    for name, n, qualities in plan(names, options):
        case = Case.open(name, paths[name], n)
        rival, row = measure_cycles(case, options.cycles_anew and n == min(options.receivers or NUMBERS))
        rows.append(row)
        for quality in qualities:
            points.append(Point.measure(case, quality, rival, options.seeds))
            print(" ".join(points[-1].row), flush=True)
    return points, rows


def measure_cycles(case, anew):
    """Cycles on a case's receivers, and a row of `CYCLES_HEAD`."""
    samples, errors = rivals.error_curve(case.name, case.truth, anew)
    obj = bpy.data.objects["Receivers"]
    start, per_sample, n_cores = rivals.time_line(obj)
    n = len(obj.data.vertices)
    row = [case.name, f"{n:,}", f"{start:.1f}", f"{per_sample:.3f}", f"{n / per_sample / 1e6:.2f}", f"{n_cores:.1f}"]
    return rivals.Rival("Cycles", samples, errors, start, per_sample * len(case.receivers) / n), row


GROWTH_HEAD = ["Scene", "Quality", *(f"{n:,} receivers, s" for n in NUMBERS), "Times as many", "Times as long"]
GROWTH_HEAD += ["Bytes a receiver"]


def growth_rows(points):
    """Rows of `GROWTH_HEAD`: how the time of each scene and quality grows with the receivers."""
    rows = []
    for name, quality in dict.fromkeys((point.case.name, point.quality) for point in points):
        found = {p.case.n_asked: p for p in points if (p.case.name, p.quality) == (name, quality)}
        if len(found) > 1:
            times = [f"{found[n].seconds:.1f}" if n in found else "" for n in NUMBERS]
            few, many = found[min(found)], found[max(found)]
            numbers = [len(point.case.receivers) for point in (few, many)]
            size = growth.bytes_each([few.memory, many.memory], numbers)
            ratios = [f"{numbers[1] / numbers[0]:.0f}", f"{many.seconds / few.seconds:.1f}"]
            rows.append([name, quality, *times, *ratios, "" if size is None else f"{size:.0f}"])
    return rows


def summary(points):
    """A sentence on each number of receivers: the speed-ups at medium quality."""
    for n in NUMBERS:
        gains = [
            p.rival.to_reach(p.rmse)[0] / p.seconds for p in points if (p.case.n_asked, p.quality) == (n, "medium")
        ]
        if len(gains) > 1:
            yield f"Speed-up at {n:,} receivers, medium: median {np.median(gains):.1f}, least {min(gains):.1f}.\n"


def tables(scenes, options):
    """Markdown tables; and the picture in a folder, if one is given."""
    points, cycles_rows = measure(scenes, options)
    if options.pictures:
        error_plot(points, options.pictures / "speed.png")
    texts = [table("Time at equal error, against Cycles' vertex bake", HEAD, [point.row for point in points])]
    texts += summary(points)
    texts.append(table("Cycles' time for the same receivers", CYCLES_HEAD, cycles_rows))
    if rows := growth_rows(points):
        texts.append(table("Growth with receivers", GROWTH_HEAD, rows))
    if not options.scene:
        bakes = growth.measure(Case.open("cornell", scenes["cornell"], NUMBERS[0]))
        texts.append(table("Growth with photons and triangles, cornell", growth.HEAD, [bake.row for bake in bakes]))
        more = [bake for bake in bakes if bake.changed == "photons"]
        size = growth.bytes_each([bake.memory for bake in more], [bake.n_stored for bake in more])
        texts += [] if size is None else [f"A stored photon takes {size:.0f} bytes more, whatever it is needed for.\n"]
    return texts
