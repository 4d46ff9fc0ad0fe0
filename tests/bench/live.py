"""Measures live light: how soon after an edit there is new light, and how near it then is to converged light.

    python tests/bench/run.py --only live [--scene NAME]

Edits are played from a script to the engine's own thread, as the viewport hands them on; drawing is not in the figures.
What is called converged are two bakes at High without interpolation, at a sample of the vertices. A core that other
processes use is not there for live light: run it alone.
"""

from dataclasses import replace
from time import perf_counter, process_time, sleep

import numpy as np
from figures import load, rendered_scene, table
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.pipeline.live import (
    LampsChanged,
    Live,
    MaterialsChanged,
    ObjectMoved,
    ObjectReshaped,
    SceneReplaced,
    live_surfaces,
)
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.live import LiveSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from scene_parts import ball, box, bpy, column, lamp, matte, room
from scene_parts import table as table_of_wood

N_VERTICES, N_SAMPLE, N_EDITS, N_REBUILDS, LONGEST = 20_000, 1000, 20, 5, 120.0
HEAD = ["Scene", "Vertices", "Edit", "First light, median", "95 %", "of it processor, 95 %"]
HEAD += ["RMSE then", "after 1 s", "after 10 s", "Converged after", "Untouched", "moves by", "error", "Still"]
UNTOUCHED = 0.5
"""Of the estimated error: by so much converged light differs at most at vertices that an edit did not touch."""
EDITED = {
    "cornell": ("Light", "ShortBlock", "White"),
    "classroom": ("Sun", "Mesh017", "Walls"),
    "fifty": ("Lamp", "Ball 1", "White"),
}
"""Lamp, object and material that are edited in each scene."""


def fifty():
    """A room of 6 × 5 × 3 m with fifty objects in it: walls, tables, shelves, books, balls and columns."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    white, red, blue = matte("White", 0.75, 0.74, 0.7), matte("Red", 0.6, 0.12, 0.08), matte("Blue", 0.1, 0.2, 0.55)
    oak = matte("Oak", 0.5, 0.33, 0.18)
    room((6, 5, 3), floor=oak, walls=white, west=red, east=blue)
    table_of_wood("Table", (2.2, 1.8), (1.6, 0.9, 0.75), oak)
    table_of_wood("Desk", (4.2, 3.9), (1.5, 0.8, 0.75), oak)
    for i in range(6):
        ball(f"Ball {i + 1}", (0.7 + 0.8 * i, 1.0 + 0.1 * i, 0.25), 0.25, (red, blue, white)[i % 3])
    for i in range(4):
        column(f"Column {i + 1}", (0.6 + 1.6 * i, 4.6), 0.15, 3, white)
    for i in range(4):
        box(f"Shelf {i + 1}", (0, 2.0, 0.5 + 0.5 * i), (0.3, 4.0, 0.54 + 0.5 * i), oak)
    for i in range(16):
        at, level = 2.05 + 0.11 * (i % 8) * 2, 0.54 + 0.5 * (i // 8)
        box(f"Book {i + 1}", (0.03, at, level), (0.25, at + 0.06, level + 0.28), (red, blue, white)[i % 3])
    for i in range(4):
        box(f"Box {i + 1}", (2.4 + 0.3 * i, 2.0, 0.75), (2.6 + 0.3 * i, 2.25, 0.9 + 0.05 * i), (white, red)[i % 2])
    lamp("Lamp", "POINT", (3, 2.5, 2.4), 120, (1, 0.9, 0.75), shadow_soft_size=0.1)
    lamp("Window", "AREA", (5.5, 1, 2.2), 60, (0.7, 0.85, 1), towards=(-1, 0.3, -0.5), size=0.8)
    return rendered_scene()


def edits_of(scene, name, surfaces):
    """For each kind, what makes the edit at a time from 0 to 1, and the scene that it makes."""
    of_lamp, of_object, of_material = EDITED[name]
    i, number = scene.lights.names.index(of_lamp), scene.objects.names.index(of_object)
    paint = scene.materials.names.index(of_material)
    triangles = scene.object_of_triangle == number
    used = np.unique(scene.triangles[triangles])
    size = np.ptp(scene.vertices[used], axis=0)
    closures = scene.materials.closures
    painted = np.flatnonzero(closures.material == paint)

    def lights(t):
        position, direction = scene.lights.position.copy(), scene.lights.direction.copy()
        position[i, :2] += np.float32(0.12 * scene.diagonal * t if scene.diagonal < 50 else 0)
        direction[i, 1] += 0.5 * t * (scene.lights.kind[i] == 2)
        direction[i] /= np.linalg.norm(direction[i])
        return replace(scene.lights, position=position, direction=direction)

    def transform(t):
        matrix = np.eye(4)
        matrix[:2, 3] = t * 0.7 * size[:2].mean()
        matrix[2, 3] = 0.02 * size[2]
        return matrix

    def materials(t):
        value = closures.weight.value.copy()
        value[painted] *= (1 - 0.6 * t, 1 - 0.2 * t, 1 - 0.8 * t)
        weight = replace(closures.weight, value=value.astype(np.float32))
        return replace(scene.materials, closures=replace(closures, weight=weight))

    def elsewhere(t):
        vertices = scene.vertices.copy()
        vertices[used] += transform(t)[:3, 3].astype(np.float32)
        return replace(scene, vertices=vertices)

    def bent(t):
        """The object leans, the more the higher up."""
        vertices = scene.vertices.copy()
        height = vertices[used, 2] - vertices[used, 2].min()
        vertices[used, 0] += np.float32(0.5 * t) * height
        return replace(scene, vertices=vertices)

    def reshaped(t):
        corners, normals = bent(t).corners(np.flatnonzero(triangles)), scene.corner_normals[triangles]
        tangents = scene.frames.corner_tangents
        tangents = tangents[triangles] if len(tangents) else tangents
        return ObjectReshaped(number, corners, normals, tangents, surfaces.reshaped(number, corners, normals))

    return {
        "lamp moved": (lambda t: LampsChanged(lights(t)), lambda t: replace(scene, lights=lights(t))),
        "object moved": (lambda t: ObjectMoved(number, transform(t)), elsewhere),
        "object bent": (reshaped, bent),
        "colour changed": (
            lambda t: MaterialsChanged(materials(t)),
            lambda t: replace(scene, materials=materials(t)),
        ),
    }


def waited(live, since, true=lambda light: True):
    """The first light after an edit of which something is true, and how long it took."""
    end = since + LONGEST
    while perf_counter() < end:
        light = live.light
        if light is not None and light.since >= since and true(light):
            return light, perf_counter() - since
        sleep(0.001)
    return live.light, LONGEST


def edited(live, edit):
    """When an edit was made, the first light that knows of it, and how long that and its processor's work took."""
    since, processor = perf_counter(), process_time()
    live.edit(edit)
    light, took = waited(live, since)
    return since, light, took, process_time() - processor


def rows(name, scene):
    """Rows of `HEAD` for a scene."""
    settings = LiveSettings(n_vertices=N_VERTICES)
    surfaces = live_surfaces(scene, settings)
    receivers = surfaces.receivers()
    some = np.sort(np.random.default_rng(1).choice(len(receivers), N_SAMPLE, replace=False))
    started = perf_counter()
    live = Live(scene, surfaces, settings)
    live.start()
    _, first = waited(live, started)
    _, whole = waited(live, started, lambda light: light.converged)
    yield [name, f"{len(surfaces):,}", "start", f"{first:.1f} s", *[""] * 5, f"{whole:.1f} s", *[""] * 4]
    number = surfaces.object_of_vertex[some]
    for kind, (edit, changed) in edits_of(scene, name, surfaces).items():
        times = np.array([edited(live, edit(k / N_EDITS))[2:] for k in range(N_EDITS)])
        waited(live, perf_counter() - 1, lambda light: light.converged)
        last, at = edit(1.0), receivers.where(some)
        if isinstance(last, ObjectMoved):
            at.position[number == last.object] += last.transform[:3, 3].astype(np.float32)
        elif isinstance(last, ObjectReshaped):
            at = last.surfaces.receivers().where(some)
        before, (since, then, *_) = live.light, edited(live, edit(1.0))
        every = until_converged(live, since)
        lights = [then, *(last_of(every, since + later) for later in (1, 10))]
        flickers = *flicker(before, every), still(live)
        live.edit(edit(0.0))
        truths = converged_light(changed(1.0), at)
        off = [relative_rmse(light.indirect[some], *truths) for light in lights]
        late = *np.quantile(times[:, 0], (0.5, 0.95)), np.quantile(times[:, 1], 0.95)
        quantiles = [f"{1000 * value:.0f} ms" for value in late]
        errors = [f"{value:.1%}" for value in off]
        converged = f"{every[-1][0] - since:.1f} s"
        yield [name, f"{len(surfaces):,}", kind, *quantiles, *errors, converged, *flickers]
    times = np.array(
        [edited(live, SceneReplaced(scene, live_surfaces(scene, settings)))[2:] for _ in range(N_REBUILDS)]
    )
    late = *np.quantile(times[:, 0], (0.5, 0.95)), np.quantile(times[:, 1], 0.95)
    yield [name, f"{len(surfaces):,}", "all built anew", *(f"{1000 * value:.0f} ms" for value in late), *[""] * 8]
    live.stop()


def until_converged(live, since):
    """All lights after an edit until they stay as they are, and when each was there."""
    found = []
    while perf_counter() < since + LONGEST and not (found and found[-1][1].converged):
        light = live.light
        if light.since >= since and not (found and found[-1][1] is light):
            found.append((perf_counter(), light))
        sleep(0.005)
    return found


def last_of(every, time):
    """The last of the lights that are there at a time."""
    return [light for when, light in every if when <= time][-1]


def flicker(before, every):
    """Share of vertices that an edit did not touch, how far their light moves (RMS), and its estimated error then.

    Of all lights the one that moves farthest, as a share of its error.
    """
    after = every[-1][1]
    touched = np.abs(after.indirect - before.indirect).mean(axis=1) > UNTOUCHED * before.error * before.indirect.mean()
    if touched.all():
        return "0%", "", ""
    mean, was = before.indirect.mean(), before.indirect[~touched]
    moves = [float(np.sqrt(np.mean((light.indirect[~touched] - was) ** 2))) / mean for _, light in every]
    errors = [light.error for _, light in every]
    k = int(np.argmax(np.divide(moves, errors)))
    return f"{np.mean(~touched):.0%}", f"{moves[k]:.2%}", f"{errors[k]:.2%}"


def still(live):
    """Whether nothing changes while nothing is edited."""
    light, processor = live.light, process_time()
    sleep(1.0)
    return "yes" if live.light is light and process_time() - processor < 0.05 else "no"


def converged_light(scene, receivers):
    """Indirect light by two bakes of other random numbers."""
    tracer = EmbreeTracer(scene)
    bakes = (bake(scene, receivers, settings_for("high", interpolate=False, seed=seed), tracer) for seed in (0, 1))
    return [found.passes["indirect"] / np.pi for found in bakes]


def relative_rmse(value, truth, other):
    """RMS error over the mean; two truths of independent noise leave that out: it is in each product once."""
    error2 = np.mean((value - truth) * (value - other))
    return float(np.sqrt(max(error2, 0)) / np.mean((truth + other) / 2))


def tables(scenes, options):
    """A Markdown table."""
    chosen = options.scene or [*(name for name in ("cornell", "classroom") if name in scenes), "fifty"]
    found = [cells for name in chosen for cells in rows(name, fifty() if name == "fifty" else load(scenes[name])[0])]
    return [table("Live light after edits", HEAD, found)]
