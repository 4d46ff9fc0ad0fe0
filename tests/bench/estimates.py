"""Measures how well the panel foretells a bake's time and memory, and fits what it foretells them by.

    python tests/bench/run.py --only estimates
    python tests/bench/estimates.py FILE.json           one process: bakes, and writes what each took
    python tests/bench/estimates.py --fit FILE.json     prints the terms that fit best (non-negative, relative error)

Times are the process's own, as if of one core, so that others on the machine count little. Terms are fitted to scenes
of our own: another scene may well take twice as long or half, for its gloss, its lamps and what hides what.
"""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from time import process_time

import numpy as np
from figures import table
from photon_bake.addon.pipeline.estimates import TERMS, Work, estimate, terms_of
from photon_bake.addon.settings.bake import BakeSettings, settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings

CASES = [
    (scene, target, quality, gather)
    for scene in ("window", "outdoor", "lamps")
    for target, quality, gather in (
        ("vertex", "draft", "final"),
        ("vertex", "medium", "final"),
        ("lightmap", "draft", "final"),
        ("lightmap", "medium", "final"),
        ("camera", "draft", "final"),
        ("camera", "medium", "final"),
        ("lightmap", "medium", "light_volume"),
        ("lightmap", "medium", "density"),
        ("camera", "medium", "photon_volumes"),
    )
]
HEAD = ["Scene", "Baked to", "Gather", "Quality", "Points", "Core seconds", "Foretold", "MB more", "Foretold"]


def measure():
    """What each case took."""
    return [_bake(*case) for case in CASES]


def _bake(scene, target, quality, gather):
    import bpy
    from memory import extra_memory
    from own_scenes import build
    from photon_bake.addon.blender.preflight import Asked, check
    from photon_bake.addon.core.progress import Progress
    from photon_bake.addon.settings.camera import CameraSettings
    from photon_bake.operators.jobs.bake_job import BakeJob
    from photon_bake.operators.targets.camera import CameraRequest
    from photon_bake.operators.targets.lightmap import LightmapRequest
    from photon_bake.operators.targets.vertices import VertexRequest

    build(scene)
    shown, settings = bpy.context.scene, settings_for(quality, gather=gather)
    if target == "camera":
        _add_camera(scene)
    lightmap = LightmapSettings(density=12, max_size=256)
    with tempfile.TemporaryDirectory() as folder:
        wanted = {
            "vertex": VertexRequest(),
            "lightmap": LightmapRequest(lightmap, Path(folder), "scene"),
            "camera": CameraRequest(CameraSettings(), Path(folder)),
        }[target]
        asked = Asked(
            shown, bpy.context.view_layer, frozenset({target}), settings, lightmap, "Indirect", "", False, False
        )
        work, progress, began = check(asked).work, Progress(), process_time()

        def bake():
            job = BakeJob.prepare(bpy.context, [wanted], progress)
            return job, job.solve(settings, progress)

        (job, solved), megabytes = extra_memory(bake)
    counts = {**job.counts, **solved.counts}
    print(scene, target, quality, gather, round(process_time() - began, 1), work, counts, file=sys.stderr, flush=True)
    return {
        "case": [scene, target, gather, quality],
        "work": asdict(work),
        "settings": asdict(settings),
        "seconds": process_time() - began,
        "megabytes": megabytes,
        "counts": counts,
        "stages": progress.stage_seconds,
    }


def _add_camera(scene):
    import bpy
    from mathutils import Vector
    from own_scenes import OWN_SCENES

    low, high = (Vector(end) for end in OWN_SCENES[scene].region)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = low.lerp(high, 0.85)
    camera.rotation_euler = (low - high).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 480, 270


GIVEN = {"triangles": 1e-5, "photons": 3.7e-6, "elements": 2e-5, "pixels": 1e-5}
"""Terms that these scenes cannot tell from others: of the measured growth with photons, triangles and pixels."""


def fit(measured):
    """The other terms of time that fit best: least squares of the relative error, none below 0."""
    from scipy.optimize import nnls

    rows = np.array([terms_of(Work(**one["work"]), BakeSettings(**one["settings"])) for one in measured])
    seconds = np.array([one["seconds"] for one in measured])
    given = np.array([GIVEN.get(name, 0.0) for name in TERMS])
    free = given == 0
    scale = np.maximum(rows.max(axis=0), 1e-30)[free]
    found, _ = nnls(rows[:, free] / scale / seconds[:, None], (seconds - rows @ given) / seconds)
    terms = dict(zip(TERMS, given, strict=True))
    terms.update(zip(np.array(list(TERMS))[free], found / scale, strict=True))
    return terms


def rows_of(measured):
    """The table's rows."""
    rows = []
    for one in measured:
        work, settings = Work(**one["work"]), BakeSettings(**one["settings"])
        told = estimate(work, replace(settings, n_threads=1), n_cores=1)
        rows.append(
            [
                *one["case"],
                f"{one['counts'].get('receivers', 0):,}",
                f"{one['seconds']:.1f}",
                f"{told.seconds:.1f}",
                f"{one['megabytes'] or 0:.0f}",
                f"{told.megabytes:.0f}",
            ]
        )
    return rows


def tables(scenes, options):
    """The table of all cases, as texts of Markdown."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "measured.json")
        subprocess.run([sys.executable, __file__, path], check=True)
        measured = json.loads(path.read_text())
    return [table("Time and memory foretold", HEAD, rows_of(measured))]


if __name__ == "__main__":
    if sys.argv[1] == "--fit":
        taken = json.loads(Path(sys.argv[2]).read_text())
        for name, value in fit(taken).items():
            print(f"{name}: {value:.3g}")
        for row in rows_of(taken):
            print(*row, sep="\t")
    else:
        Path(sys.argv[1]).write_text(json.dumps(measure()))
    sys.stdout.flush()
    os._exit(0)
