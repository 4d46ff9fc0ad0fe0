"""Measures the light-gathering volume: accuracy and time at the paper's grid sizes, and whole drafts.

    python tests/bench/light_volume.py [--scenes DIR]

Needs scenes with truth, as run.py does.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
from figures import figures, load, table
from photon_bake.addon.gather import Cascade
from photon_bake.addon.parallel import Workers
from photon_bake.addon.photons import PathKind, light_sources, region_of, trace_photons
from photon_bake.addon.progress import Progress
from photon_bake.addon.scene.surface_points import surface_points
from photon_bake.addon.tracers import LightTracer
from photon_bake.addon.tracers.embree import EmbreeTracer

ROOT = Path(__file__).resolve().parents[2]
N_PHOTONS, N_POINTS = 600_000, 50_000
STAGES = {
    "Surfaces": ("Measuring surfaces", "Looking between cells"),
    "Inject": ("Filling the volume",),
    "Gather": ("Gathering in the volume",),
    "Read": ("Reading the volume",),
}
GRID_HEAD = [
    "Grid",
    *(f"{stage}, ms" for stage in STAGES),
    "All, ms",
    "Relative RMSE",
    "Mean",
    "Median",
    "Said noise",
    "Paper",
]
PAPER = {16: "41 Hz", 32: "40 Hz", 48: "33 Hz"}
DRAFT_HEAD = ["Scene", "Bake", "Receivers", "Seconds", "Stages, s"]


def grid_rows(path, truth):
    """Rows: 16³, 32³ and 48³ on a scene with truth, as in Figure 9; times are for 50,000 points on its surfaces."""
    scene, _, probes = load(path)
    tracer = LightTracer(scene, EmbreeTracer(scene))
    points = spread(scene, N_POINTS)
    sources = light_sources(scene, region_of(probes.position))
    photons = trace_photons(scene, tracer, sources, N_PHOTONS, 32, Workers())
    photons = photons.where(photons.kind == PathKind.INDIRECT)
    rows = []
    for n_cells in PAPER:
        seconds, volumes = min(
            (timed(scene, tracer, photons, points, n_cells) for _ in range(3)), key=lambda run: sum(run[0].values())
        )
        value, stderr = volumes.irradiance(probes.position, probes.normal, Workers())
        at_probe = value[probes.targets[0].receiver_of_element].reshape(-1, 3, 3).mean(axis=1) / np.pi
        noise = np.sqrt(np.mean(stderr**2)) / value.mean()
        of_stage = [sum(seconds.get(name, 0) for name in names) for names in STAGES.values()]
        times = [f"{1000 * time:.0f}" for time in (*of_stage, sum(seconds.values()))]
        rows.append([f"{n_cells}³", *times, *figures(at_probe, truth), f"{noise:.1%}", PAPER[n_cells]])
    return rows


def spread(scene, n):
    """Positions and normals of about n points spread over the scene's front sides, a little lifted."""
    parts = list(surface_points(scene, scene.bounds, np.sqrt(scene.areas.sum() / n)))
    position = np.concatenate([part.position for part in parts])
    normal = scene.normals[np.concatenate([part.triangle for part in parts])]
    return position + scene.ray_offset(position) * normal, normal


def timed(scene, tracer, photons, points, n_cells):
    """Seconds of each stage from traced photons to lit points, and the volumes."""
    progress = Progress()
    workers, start = Workers(progress=progress), perf_counter()
    volumes = Cascade.build(scene, tracer, photons, points[0], n_cells, workers)
    volumes.irradiance(*points, workers)
    progress.update("Done", 1.0)
    seconds = {**progress.stage_seconds, "Done": 0.0}
    seconds["Rest"] = perf_counter() - start - sum(seconds.values())
    return seconds, volumes


def draft_rows(name, path):
    """Rows: whole bakes by the command line, from their own reports."""
    rows = []
    for bake, options in {
        "draft": ["--quality", "draft"],
        "draft through cube maps": ["--quality", "draft", "--tracer", "multi_image"],
        "medium": [],
    }.items():
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "report.json"
            command = [sys.executable, ROOT / "tools/blender_stand_in.py", "-b", path, "-c", "photon_bake", *options]
            subprocess.run([*map(str, command), "--report", str(report)], check=True, stderr=subprocess.DEVNULL)
            said = json.loads(report.read_text())
        stages = ", ".join(f"{stage} {time:.1f}" for stage, time in said["stage_seconds"].items())
        rows.append([name, bake, f"{said['counts']['receivers']:,}", f"{said['total_seconds']:.1f}", stages])
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=Path, default=ROOT.parent / "shared/scenes")
    scenes = parser.parse_args().scenes
    cornell = scenes / "cornell/cornell.blend"
    table("Light volume on cornell, 50,000 points", GRID_HEAD, grid_rows(cornell, np.load(cornell.with_suffix(".npz"))))
    table("Whole bakes", DRAFT_HEAD, draft_rows("classroom", scenes / "classroom/classroom.blend"))


if __name__ == "__main__":
    main()
