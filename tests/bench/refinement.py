"""Measures Refine: error over faces, before and after, against as many vertices by length alone.

    python tests/bench/run.py --only refine [--scenes DIR]
    python tests/bench/refinement.py SCENE.blend --objects NAME… --budget N

Vertices hold what a bake with 512 rays a point and no interpolation finds there. The error is that of light between
them at points spread evenly over the surface, whose light the same bake finds: root mean square, relative to the
light or to a quarter of its mean where there is less, with the noise of both taken out. By length alone means
Kristensen and Ottosen's own order: the longest edge of all is split next. Seconds are the processor's, all cores
together.
"""

import argparse
import os
import sys
from pathlib import Path
from time import process_time

import bpy
import numpy as np
from figures import ROOT, rendered_scene, table
from photon_bake.addon.blender import in_render_graph
from photon_bake.addon.blender.refinement import split_meshes
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.pipeline.refinement import RefineOptions, Triangles, refine
from photon_bake.addon.pipeline.refinement.samples import LEAST_LIGHT, Samples, corner_receivers
from photon_bake.addon.settings.bake import BakeSettings, settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.operators.refine import draft_of
from photon_bake.operators.targets.refine import RefineRequest

sys.path.append(str(ROOT / "tools"))
import demo_scene

HEAD = ["Scene", "Meshes", "Vertices", "of which added", "Error", "by length alone", "before", "Refine, s", "Split, s"]
N_POINTS = 3000
TOLERANCE = 0.02


def read(names):
    """Meshes as they are, in the open scene: a target of a bake."""
    warnings = []

    def of(depsgraph):
        wanted = RefineRequest(RefineOptions(), on_copy=True)
        return wanted.read(depsgraph, bpy.context.scene, names, Progress(), warnings)

    return in_render_graph(bpy.context.scene, bpy.context.view_layer, of)


def by_length(triangles, n_vertices):
    """Triangles of so many vertices, by splits of the longest edges alone."""
    while (left := n_vertices - len(triangles.weld)) > 0:
        edges = triangles.edges
        ends = np.flatnonzero(edges.to == np.arange(len(edges.to)))
        length = np.zeros(len(edges.to))
        a, b = triangles.point, triangles.point[:, [1, 2, 0]]
        lengths = np.linalg.norm(triangles.position[a] - triangles.position[b], axis=2)
        np.maximum.at(length, edges.of_side.ravel(), lengths.ravel())
        longest = ends[np.argsort(-length[ends], kind="stable")]
        # A round takes those that are as long as the longest, to a quarter; then there are shorter ones
        chosen = longest[length[longest] > 0.75 * length[longest[0]]]
        chosen = chosen[np.cumsum(edges.n_vertices[chosen]) <= left]
        if not len(chosen):
            break
        triangles = triangles.split(chosen).after
    return triangles


def error(triangles, solution, seed):
    """RMS difference between light and what corners say of it, relative to the light."""
    share = triangles.area.astype(np.float64)
    random = np.random.default_rng(seed)
    points = Samples.placed(random.multinomial(N_POINTS, share / share.sum()), seed, 1)
    at = solution.gather(points.receivers(triangles))
    rows = np.unique(points.triangle)
    corners, of_corner = corner_receivers(triangles, rows)
    used, of_used = np.unique(of_corner, return_inverse=True)
    found = solution.gather(corners.where(used))
    k = np.searchsorted(rows, points.triangle)
    of_point = of_used.reshape(-1, 3)[k]
    said = np.einsum("sc,scd->sd", points.weight, found.value[of_point]).mean(axis=1)
    variance = at.stderr**2 + ((points.weight * found.stderr[of_point]) ** 2).sum(axis=1)
    light = at.value.mean(axis=1)
    share = ((said - light) ** 2 - variance) / np.maximum(light, LEAST_LIGHT * light.mean()) ** 2
    return float(np.sqrt(max(share.mean(), 0)))


def measure(name, names, budget):
    """A row of `HEAD` for the open scene."""
    scene, target = rendered_scene(), read(names)
    before = Triangles.of(target.meshes)
    exact = settings_for("medium", n_gather_rays=512, interpolate=False)
    truth = solve(scene, target.vertices, exact, EmbreeTracer(scene))
    start = process_time()
    draft = solve(scene, target.vertices, draft_of(BakeSettings()), EmbreeTracer(scene))

    def light(receivers):
        found = draft.gather(receivers)
        return found.value, found.stderr

    refinement = refine(target.meshes, light, RefineOptions(TOLERANCE, budget), 0, Progress())
    seconds, start = process_time() - start, process_time()
    meshes = {mesh.mesh_name: bpy.data.objects[mesh.object_name].data for mesh in target.meshes}
    split_meshes(meshes, refinement, True, Progress())
    to_split = process_time() - start
    after = Triangles.of(read(names).meshes)
    uniform = by_length(before, len(before.weld) + refinement.n_vertices)
    errors = [f"{error(triangles, truth, 1):.1%}" for triangles in (after, uniform, before)]
    sizes = [f"{n:,}" for n in (len(after.weld), refinement.n_vertices)]
    row = [name, f"{len(refinement.ends)}", *sizes, *errors, f"{seconds:.1f}", f"{to_split:.1f}"]
    print(row, flush=True)
    return row


def coarse_demo():
    """The demo, with walls of one quad each and window posts of few."""
    demo_scene.CELL = 10.0
    demo_scene.build(str(ROOT / "build/coarse_demo.blend"))


def tables(scenes):
    rows = []
    (ROOT / "build").mkdir(exist_ok=True)
    coarse_demo()
    walls = ["Floor", "Ceiling", "Back Wall", "Front Wall", "Right Wall"]
    rows.append(measure("demo, walls of one quad", walls, 1_500))
    if "cornell" in scenes:
        bpy.ops.wm.open_mainfile(filepath=str(scenes["cornell"]))
        names = [obj.name for obj in bpy.context.scene.objects if obj.type == "MESH" and obj.name != "Probes"]
        rows.append(measure("cornell", names, 1_500))
    return [table("Refined meshes", HEAD, rows)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--objects", nargs="+", metavar="NAME")
    parser.add_argument("--budget", type=int, default=1_500)
    options = parser.parse_args()
    bpy.ops.wm.open_mainfile(filepath=str(options.scene.absolute()))
    print(table("Refined meshes", HEAD, [measure(options.scene.stem, options.objects, options.budget)]))
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
