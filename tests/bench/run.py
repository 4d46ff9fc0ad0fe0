"""Measures the engine: rays a second against Embree's own, error and time against Cycles, whole scenes.

    make bench ARGS="[--scenes DIR] [--output FILE.md] [--pictures DIR] [--only PART]"
    make bench ARGS="--only speed [--scene NAME…] [--receivers N…] [--quality Q…] [--cycles-anew]"
    make bench ARGS="--only versions --against COMMIT [--warm] [--scene NAME…] [--receivers N] [--quality Q] …"
    make bench ARGS="--make-truth NAME…"

Needs scenes with truth (NAME/NAME.blend with an object "Probes", NAME/NAME.npz); without them it measures rays on the
demo scene alone. Prints Markdown tables, and writes them to build/bench.md, or those of one PART alone: speed, rays,
direct, lamps, window, error, scenes, volume, images, extraction, small, caustics, lightmaps, contacts, lightmap_speed,
light_groups, camera, media, estimates, refine, vertex, live, live_rival, live_caustics, view_transform, shares or eevee
(in the Blender that BLENDER names); versions where it is asked for.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import bpy
import camera_media
import camera_pass
import caustics
import contacts
import direct_rates
import eevee
import equal_error
import estimates
import extraction
import kernel_shares
import light_groups
import light_volume
import lightmap_rival
import lightmaps
import live
import live_caustics
import live_flicker
import live_rival
import make_truth
import many_lamps
import multi_image
import numpy as np
import ray_rates
import refinement
import responsiveness
import small_speed
import versions
import vertex_error
import view_transform
from cycles_bakes import bake_indirect, baked
from figures import ROOT, figures, load, scene_options, scenes_in, table
from own_scenes import OWN_SCENES
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer

QUALITIES = ("draft", "medium", "high")


def errors(name, path, truth):
    """Rows: error and time of each quality and gather at the probes, and of Cycles' bake."""
    scene, _, probes = load(path)
    element = probes.targets[0].receiver_of_element
    rows = []
    for gather in ("final", "density", "light_volume"):
        for quality in QUALITIES:
            start = perf_counter()
            value = bake(scene, probes, settings_for(quality, gather=gather), EmbreeTracer(scene)).value[element]
            time = perf_counter() - start
            at_probe = value.reshape(-1, 3, 3).mean(axis=1) / np.pi
            rows.append([name, gather, quality, f"{time:.1f}", *figures(at_probe, truth)])
    return [*rows, *cycles_rows(name, truth)]


def cycles_rows(name, truth, samples=(16, 64, 256)):
    """Rows: time and error of Cycles' own vertex bake of the probes."""
    probes = bpy.data.objects["Probes"]
    for n in samples:
        time = bake_indirect(probes, n)
        at_probe = baked(probes).reshape(-1, 3, 3).mean(axis=1)
        yield [name, "Cycles", f"{n} samples", f"{time:.1f}", *figures(at_probe, truth)]


def whole_scene(name, path):
    """A row: the command line at medium quality over all objects, from its own report."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, ROOT / "tools/blender_stand_in.py", "-b", path, "-c", "photon_bake"]
        subprocess.run([*map(str, command), "--report", str(report)], check=True, stderr=subprocess.DEVNULL)
        said = json.loads(report.read_text())
    stages = ", ".join(f"{stage} {time:.1f}" for stage, time in said["stage_seconds"].items())
    return [
        name,
        f"{said['counts']['receivers']:,}",
        f"{said['total_seconds']:.1f}",
        f"{said['peak_memory_mb']:.0f}",
        f"{said['relative_noise']:.1%}",
        stages,
    ]


def error_tables(scenes, _):
    head = ["Scene", "Gather", "Quality", "Seconds", "Relative RMSE", "Mean", "Median"]
    truths = {name: np.load(path.with_suffix(".npz")) for name, path in scenes.items()}
    rows = [row for name, path in scenes.items() for row in errors(name, path, truths[name])]
    return [table("Error and time at the probes", head, rows)]


def scene_tables(scenes, _):
    head = ["Scene", "Receivers", "Seconds", "Peak MB", "Noise", "Stages, s"]
    rows = [whole_scene(name, path) for name, path in scenes.items()]
    return [table("All objects at medium quality, by the command line", head, rows)]


def extraction_tables(*_):
    return [table("Reading scenes out of Blender, against Cycles' start", extraction.HEAD, extraction.rows())]


PARTS = {
    "speed": equal_error.tables,
    "rays": ray_rates.tables,
    "direct": direct_rates.tables,
    "lamps": many_lamps.tables,
    "window": responsiveness.tables,
    "error": error_tables,
    "scenes": scene_tables,
    "volume": light_volume.tables,
    "images": multi_image.tables,
    "extraction": extraction_tables,
    "small": small_speed.tables,
    "caustics": caustics.tables,
    "lightmaps": lambda scenes, _: lightmaps.tables(scenes),
    "contacts": lambda scenes, _: contacts.tables(scenes),
    "lightmap_speed": lambda scenes, _: lightmap_rival.tables(scenes),
    "light_groups": lambda scenes, _: light_groups.tables(scenes),
    "camera": lambda scenes, _: camera_pass.tables(scenes),
    "media": camera_media.tables,
    "estimates": estimates.tables,
    "refine": lambda scenes, _: refinement.tables(scenes),
    "vertex": vertex_error.tables,
    "live": lambda *given: [*live.tables(*given), *live_flicker.tables()],
    "live_rival": live_rival.tables,
    "live_caustics": live_caustics.tables,
    "view_transform": view_transform.tables,
    "shares": kernel_shares.tables,
    "eevee": eevee.tables,
    "versions": versions.tables,
}


def demo_scene():
    path = ROOT / "build/demo.blend"
    if not path.exists():
        subprocess.run([sys.executable, ROOT / "tools/demo_scene.py", "build", path], check=True)
    return {"demo": path}


def main():
    parser = scene_options(__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "build/bench.md")
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--make-truth", nargs="+", metavar="NAME", help="converge Cycles' values at the scenes' probes")
    equal_error.add_options(parser)
    versions.add_options(parser)
    options = parser.parse_args()
    scenes = scenes_in(options.scenes)
    if options.make_truth:
        for name in options.make_truth:
            make_truth.make(name, None if name in OWN_SCENES else scenes[name])
        return
    if not scenes:
        print(f"No scenes with truth in {options.scenes}: measuring rays on the demo scene alone.")
        scenes, options.only = demo_scene(), "rays"
    texts = [f"Python {sys.version.split()[0]}, Blender {bpy.app.version_string}, {os.cpu_count()} cores\n"]
    for name, tables in PARTS.items():
        if options.only == name or (options.only is None and name != "versions"):
            texts += tables(scenes, options)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text("\n".join(texts))
    print(f"Written to {options.output}")


if __name__ == "__main__":
    main()
