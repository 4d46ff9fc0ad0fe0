"""Measures the light-gathering volume: accuracy and time at the paper's grid sizes, and whole drafts.

    python tests/bench/light_volume.py [--scenes DIR] [--pictures DIR]

Needs scenes with truth, as run.py does.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
from figures import ROOT, camera_of_scene, figures, load, rendered_scene, scene_options, scenes_in, table, write_png
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.gather import Cascade
from photon_bake.addon.photons import PathKind, trace_photons
from photon_bake.addon.scene.surface_points import surface_points
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.camera_bake import bake_camera

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
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
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
    triangle = np.concatenate([part.triangle for part in parts])
    normal = scene.normals[triangle]
    return position + scene.ray_offset(triangle, position) * normal, normal


def timed(scene, tracer, photons, points, n_cells):
    """Seconds of each stage from traced photons to lit points, and the volumes."""
    progress = Progress()
    workers, start = Workers(progress=progress), perf_counter()
    volumes = Cascade.of_photons(scene, tracer, photons, points[0], n_cells, workers)
    volumes.irradiance(*points, workers)
    progress.update("Done", 1.0)
    seconds = {**progress.stage_seconds, "Done": 0.0}
    seconds["Rest"] = perf_counter() - start - sum(seconds.values())
    return seconds, volumes


def draft_rows(name, path):
    """Rows: whole bakes by the command line, from their own reports."""
    rows = []
    volume = ["--quality", "draft", "--gather", "light_volume", "--photons", "600000", "--gather-rays", "128"]
    for bake, options in {
        "by rays": volume,
        "by photons alone": [*volume, "--volume-rays", "0"],
        "the same through cube maps": [*volume, "--volume-rays", "0", "--tracer", "multi_image"],
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


def grid_picture(path, to):
    """Write what the camera sees at each grid size, coarse to fine."""
    scene, _, _ = load(path)
    view, tracer = camera_of_scene(400, 400), EmbreeTracer(scene)
    settings = [BakeSettings(n_photons=4_000_000, n_grid_cells=n) for n in PAPER]  # less noise than detail
    write_png(to, side_by_side(*(bake_camera(scene, view, one, tracer).radiance for one in settings)))


def caustics_picture(to):
    """Write what a white wall would reflect of the caustics alone, and all that the camera gets but direct light."""
    build_caustics()
    scene = rendered_scene()
    settings = BakeSettings(n_photons=2_000_000)
    light = bake_camera(scene, camera_of_scene(480, 400), settings, EmbreeTracer(scene))
    write_png(to, side_by_side(light.caustics / np.pi, light.radiance))


def side_by_side(*pictures):
    """Pictures of radiance for a screen, beside each other; the last one's 99th percentile is white in all."""
    white = np.percentile(pictures[-1], 99)
    return np.clip(np.concatenate(pictures, axis=1) / white, 0, 1) ** (1 / 2.2)


def build_caustics():
    """A glass ball and a gold ring in a closed room with a red wall, under a small lamp."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add, smooth = bpy.ops.mesh, bpy.ops.object.shade_smooth
    white, red = (material("Diffuse", Color=color) for color in ((0.7, 0.7, 0.7, 1), (0.7, 0.15, 0.1, 1)))
    add.primitive_cube_add(size=4, location=(0, 0, 2))
    room = bpy.context.object.data
    room.materials.append(white)
    room.materials.append(red)
    room.polygons[0].material_index = 1
    add.primitive_uv_sphere_add(segments=96, ring_count=48, radius=0.5, location=(-0.7, 0.2, 0.7))
    bpy.context.object.data.materials.append(material("Glass", Roughness=0, IOR=1.5))
    smooth()
    ring = {"major_radius": 0.6, "minor_radius": 0.15, "major_segments": 96, "minor_segments": 32}
    add.primitive_torus_add(location=(0.75, 0.1, 0.15), **ring)
    bpy.context.object.data.materials.append(material("Anisotropic", Color=(0.9, 0.7, 0.3, 1), Roughness=0.05))
    smooth()
    bpy.ops.object.light_add(type="AREA", location=(-0.3, 1.5, 3.9))
    bpy.context.object.data.size, bpy.context.object.data.energy = 0.3, 100
    bpy.ops.object.camera_add(location=(0, -1.95, 2.1), rotation=(0.9, 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.context.object.data.lens = 24


def material(kind, **inputs):
    """A material of one BSDF."""
    new = bpy.data.materials.new(kind)
    if bpy.app.version < (5, 0, 0):
        new.use_nodes = True
    shader = new.node_tree.nodes.new(f"ShaderNodeBsdf{kind}")
    for name, value in inputs.items():
        shader.inputs[name].default_value = value
    output = next(node for node in new.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
    new.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return new


def tables(scenes, options):
    """Markdown tables; and pictures in a folder, if one is given."""
    cornell = scenes["cornell"]
    rows = grid_rows(cornell, np.load(cornell.with_suffix(".npz")))
    texts = [table("Light volume on cornell, 50,000 points", GRID_HEAD, rows)]
    rows = draft_rows("classroom", scenes["classroom"])
    texts.append(table("Whole bakes by the command line", DRAFT_HEAD, rows))
    if options.pictures:
        grid_picture(cornell, options.pictures / "light_volume_cornell.png")
        caustics_picture(options.pictures / "caustics.png")
    return texts


def main():
    options = scene_options(__doc__).parse_args()
    tables(scenes_in(options.scenes), options)


if __name__ == "__main__":
    main()
