"""Measures drafts of many small objects: time and error, and Cycles' own bake with 16 samples of the same meshes.

    python tests/bench/run.py --only small [--scene robots balls crumbs]

Seconds are those of the processor, all cores together, so that other work beside it counts little. Errors are against a
bake at high quality of some of the receivers, each of which gathers. Cycles bakes all meshes joined into one object, as
it begins anew for each object that it bakes: one by one they would take it many times as long.
"""

import os
from time import process_time

import bpy
import numpy as np
import small_things
from cycles_bakes import bake_indirect
from figures import rendered_scene, table
from photon_bake.addon.blender import bake_objects, in_render_graph, receiver_meshes
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Receivers, vertex_receivers
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer

HEAD = ["Scene", "Objects", "Receivers", "Bake", "Read, s", "Solve, s", "Gather points", "Gather rays"]
HEAD += ["Relative RMSE", "Mean", "Median", "Said noise"]
CYCLES_HEAD = ["Scene", "Corners", "Cycles with 16 samples, s"]
N_CHECKED = 2000
BAKES = {"draft": {}, "draft, rays for all": {"gather_share": 1.0}}


def measure(name):
    """Rows of `HEAD`, and one of `CYCLES_HEAD`."""
    small_things.build(name)
    start = process_time()
    place = bpy.context.scene, bpy.context.view_layer
    objects = in_render_graph(*place, bake_objects)
    at = vertex_receivers(in_render_graph(*place, lambda depsgraph: receiver_meshes(objects, depsgraph)))
    scene = rendered_scene()
    seconds_to_read = process_time() - start
    k = np.sort(np.random.default_rng(1).choice(len(at), N_CHECKED, replace=False))
    checked = Receivers(at.position[k], at.normal[k], at.footprint[k])
    truth = bake(scene, checked, settings_for("high", interpolate=False), EmbreeTracer(scene))
    rows = []
    for label, changes in BAKES.items():
        start = process_time()
        light = bake(scene, at, settings_for("draft", **changes), EmbreeTracer(scene))
        seconds, counts = process_time() - start, light.counts
        off = (light.value[k] - truth.value).mean(axis=1) / truth.value.mean()
        rmse = np.sqrt(max(np.mean(off**2) - truth.relative_noise**2, 0))
        sizes = [f"{n:,}" for n in (len(objects), len(at))]
        work = [f"{counts['gather_points']:,}", f"{counts['gather_rays']:,}"]
        errors = [f"{rmse:.1%}", f"{off.mean():+.1%}", f"{np.median(np.abs(off)):.1%}", f"{light.relative_noise:.1%}"]
        rows.append([name, *sizes, label, f"{seconds_to_read:.1f}", f"{seconds:.1f}", *work, *errors])
        print(*rows[-1], flush=True)
    return rows, cycles_row(name, objects)


def cycles_row(name, objects):
    """Cycles' time for all the meshes as one; objects that share a mesh get one each."""
    for obj in objects:
        obj.data = obj.data.copy()
    context = {"active_object": objects[0], "object": objects[0]}
    with bpy.context.temp_override(**context, selected_objects=objects, selected_editable_objects=objects):
        bpy.ops.object.join()
    mesh = objects[0].data
    mesh.color_attributes.active_color = mesh.color_attributes.new("Cycles", "FLOAT_COLOR", "POINT")
    start = os.times()
    bake_indirect(objects[0], 16)
    end = os.times()
    return [name, f"{len(mesh.loops):,}", f"{end.user + end.system - start.user - start.system:.1f}"]


def tables(_, options):
    """Markdown tables."""
    measured = [measure(name) for name in options.scene or small_things.SCENES]
    rows = [row for rows, _ in measured for row in rows]
    texts = [table("Drafts of many small objects, seconds of the processor", HEAD, rows)]
    return [*texts, table("Cycles' bakes of the same meshes", CYCLES_HEAD, [row for _, row in measured])]
