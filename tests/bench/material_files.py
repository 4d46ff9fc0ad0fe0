"""Files by other people whose materials have many lobes: the light that they bounce, against Cycles'.

    python tests/bench/material_files.py FOLDER                 all of tests/bench/material_files.tsv, and the table
    python tests/bench/material_files.py FOLDER --only sheen    those with "sheen" in their path
    python tests/bench/material_files.py FOLDER --make-truth    Cycles' values, until they are known to half a per cent

FOLDER holds a clone of each repository of the list, as OWNER/NAME; the list says what each may be used under. None is
part of this project, but Cycles' values of them are, in truth/material_files.json.

A file's meshes stand as they are between a grey ground and a ceiling, in the light of a spot lamp that shines on little
else. Probes, tiny triangles that only camera rays see, lie on the ground and on the meshes; a row is the mean of
E_indirect / π over either. Each probe gathers for itself: interpolation between so few is an error of its own.
"""

import argparse
import json
from pathlib import Path

import bpy
import numpy as np
from figures import table
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest
from photon_bake.tests.host.cases.cycles import cycles_light, set_cycles
from photon_bake.tests.host.cases.means import CHANNELS, Comparison, Mean
from photon_bake.tests.host.cases.stage import lamp, matte, mesh, quad

HERE = Path(__file__).resolve().parent
LIST = HERE / "material_files.tsv"
TRUTH = HERE / "truth" / "material_files.json"

PLACES = ("ground", "themselves")
N_PROBES = 64  # on each
BOUND = 0.03  # of the mean
SAMPLES, ENOUGH, LEAST_RUNS, MOST_RUNS = 256, 0.005, 4, 64
SEEDS = (1, 2, 3, 4)
WORK = {
    "n_photons": 200_000,
    "n_gather_rays": 2048,
    "n_cache_elements": 20_000,
    "n_cache_rays": 8,
    "interpolate": False,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="where the clones are")
    parser.add_argument("--only", default="", metavar="TEXT", help="files with this in their path")
    parser.add_argument("--make-truth", action="store_true", help="ask Cycles")
    options = parser.parse_args()
    truth = json.loads(TRUTH.read_text()) if TRUTH.exists() else {}
    rows = []
    for repository, path, _ in listed(options.only):
        set_scene(options.folder / repository / path)
        if options.make_truth:
            truth[path] = measured_by_cycles()
            TRUTH.write_text(json.dumps(truth, indent=1, sort_keys=True) + "\n")
            print(path, truth[path], flush=True)
        else:
            rows += compared(path, truth[path])
    if rows:
        table(
            "Files by other people", ["File", "On", "Cycles", "Photon Bake", "Difference", "Tolerance", "Passes"], rows
        )


def listed(only):
    """Repository, path and licence of the files that are asked for."""
    lines = (line.split("\t") for line in LIST.read_text().splitlines()[1:])
    return [line for line in lines if only.lower() in line[1].lower()]


def set_scene(file):
    """The meshes of a file in a room, with probes."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    scene = bpy.context.scene
    scene.world = None
    for obj in list(scene.objects):
        if obj.type != "MESH":
            bpy.data.objects.remove(obj)
    bpy.context.view_layer.update()
    points, normals, bounds = on_meshes([obj for obj in scene.objects if not obj.hide_render])
    center, extent = bounds.mean(axis=0), np.ptp(bounds, axis=0)
    half = 0.8 * float(extent.max())
    for side in ((0, 0, -1), (0, 0, 1)):
        u = np.array([half, 0, 0])
        quad("Ground", center + np.multiply(side, half), u, np.cross(np.negative(side), u), matte((0.6, 0.6, 0.6)))
    distance, radius = 4 * half, float(np.linalg.norm(extent)) / 2
    at = center + distance * np.array([0.48, -0.64, 0.6])
    cone = 2 * np.arcsin(radius / distance)  # around the meshes alone: all other light comes from them
    lamp("SPOT", at, to=center, energy=400 * distance**2, spot_size=cone, spot_blend=0.2, shadow_soft_size=0.1 * half)
    on_floor = np.random.default_rng(1).uniform(-0.9, 0.9, (N_PROBES, 2)) * half
    floor = np.column_stack([center[:2] + on_floor, np.full(N_PROBES, center[2] - half)])
    up = np.tile([0.0, 0, 1], (N_PROBES, 1))
    put_probes(np.vstack([floor, points]), np.vstack([up, normals]), 1e-3 * half)
    bpy.context.view_layer.update()


def on_meshes(objects):
    """Points on meshes, uniform by area, with their faces' normals; and the corners of the box around all."""
    depsgraph, corners = bpy.context.evaluated_depsgraph_get(), []
    for obj in objects:
        data = obj.evaluated_get(depsgraph).to_mesh()
        data.calc_loop_triangles()
        world = np.array([obj.matrix_world @ vertex.co for vertex in data.vertices])
        corners.append(world[[triangle.vertices[:] for triangle in data.loop_triangles]])
    a, b, c = np.concatenate(corners).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    random = np.random.default_rng(1)
    of = random.choice(len(area), N_PROBES, p=area / area.sum())
    u, v = np.sqrt(random.random((N_PROBES, 1))), random.random((N_PROBES, 1))
    points = (1 - u) * a[of] + u * (1 - v) * b[of] + u * v * c[of]
    all_corners = np.concatenate(corners).reshape(-1, 3)
    return points, normals[of] / area[of][:, None], np.stack([all_corners.min(axis=0), all_corners.max(axis=0)])


def put_probes(points, normals, size):
    """A tiny triangle over each point, that only camera rays see."""
    u = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0, 0]], [[0.0, 1, 0]]))
    v, at = np.cross(normals, u), points + size * normals
    vertices = np.stack([at - size * (u + v), at + size * (u - v), at + size * v], axis=1).reshape(-1, 3)
    obj = mesh("Probes", vertices, np.arange(len(vertices)).reshape(-1, 3), matte((1, 1, 1), "Probe"))
    obj.visible_diffuse = obj.visible_glossy = obj.visible_transmission = False
    obj.visible_volume_scatter = obj.visible_shadow = False


def by_place(light):
    """Means (2, 3) on the ground and on the meshes, of light at the probes' corners."""
    return light.reshape(len(PLACES), -1, 3).mean(axis=1, dtype=np.float64)


def measured_by_cycles():
    """Means and standard errors by place."""
    set_cycles(SAMPLES)
    bpy.context.scene.render.threads_mode = "AUTO"
    runs = []
    while len(runs) < LEAST_RUNS or (len(runs) < MOST_RUNS and not known(runs)):
        runs.append(by_place(cycles_light(len(runs))))
    means = [Mean.of_runs([run[i] for run in runs]) for i in range(len(PLACES))]
    return {
        place: {"mean": mean.value[:3].tolist(), "stderr": mean.stderr[:3].tolist()}
        for place, mean in zip(PLACES, means, strict=True)
    } | {"blender": bpy.app.version_string, "runs": len(runs)}


def known(runs):
    return all(Mean.of_runs([run[i] for run in runs]).relative_error <= ENOUGH for i in range(len(PLACES)))


def compared(path, truth):
    """A row by place."""
    request = VertexRequest(fit=False, denoise=False)  # the light at the corners themselves, as Cycles' bakes have it
    job = BakeJob.prepare(bpy.context, [request], Progress(), ["Probes"], "")
    runs = []
    for seed in SEEDS:
        (light,) = job.solve(settings_for("draft", **WORK, seed=seed), Progress()).outputs
        runs.append(by_place(light.irradiance.value[light.receivers.targets[0].receiver_of_element] / np.pi))
    for warning in job.warnings:
        print(f"{path}: {warning}", flush=True)
    rows = []
    for i, place in enumerate(PLACES):
        said = Mean.of_colors(*(np.array(truth[place][name]) for name in ("mean", "stderr")))
        both = Comparison(said, Mean.of_runs([run[i] for run in runs]))
        noise = np.hypot(both.truth.stderr, both.ours.stderr) / both.truth.value
        worst = int(np.argmax(np.abs(both.difference) / (BOUND + 2 * noise)))
        off, tolerance = both.difference[worst], BOUND + 2 * noise[worst]
        passes = "yes" if abs(off) <= tolerance else "no"
        cells = [path, place, str(both.truth), str(both.ours), f"{off:+.1%} {CHANNELS[worst]}", f"{tolerance:.1%}"]
        rows.append([*cells, passes])
        print(*rows[-1], flush=True)
    return rows


if __name__ == "__main__":
    main()
