"""How far what vertices show is from the light over the faces: sampled at vertices, and fitted and denoised.

    make bench ARGS="--only vertex [--scene NAME…]"

Truth is light at points that are even by area over all faces, each of which gathers itself with many rays (no
interpolation), by other photons. Points inside of solids, which nobody sees, do not count.
"""

from dataclasses import replace
from time import process_time

import bpy
import numpy as np
import own_scenes
from figures import ROOT, table
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.emitters import region_of
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import Receivers, ShownFaces, face_samples, vertex_receivers
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest
from scipy.spatial import cKDTree

N_POINTS, N_RAYS = 6000, 2048
NEAR = 0.5  # m, that a wall's deviation is taken out over
RIM = 0.05  # m

HEAD = ["Scene", "Vertices", "Samples", "RMSE before", "after", "Mean error before", "after", "CPU s before", "after"]
WALL_HEAD = ["Demo's back wall, medium", "Deviation from high", "Local", "Local, 5 cm from the rim"]


def tables(scenes, options):
    """Of cornell, the demo and three more, or of the scenes asked for; and of the demo's back wall."""
    paths = {**scenes, "demo": demo(), **dict.fromkeys(("window", "outdoor", "lamps"))}
    names = getattr(options, "scene", None) or ["cornell", "demo", "window", "outdoor", "classroom"]
    rows = [of_scene(name, paths[name]) for name in names]
    texts = [table("Light between vertices, against gathered light", HEAD, rows)]
    if "demo" in names:
        texts.append(table("Noise on a plain wall", WALL_HEAD, wall_rows(paths["demo"])))
    return texts


def demo():
    """The demo scene's file, built where it is missing."""
    import subprocess
    import sys

    path = ROOT / "build/demo.blend"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        subprocess.run([sys.executable, ROOT / "tools/demo_scene.py", "build", path], check=True)
    return path


def prepared(name, path):
    """The job of all objects of a scene but its probes, and the meshes."""
    if path is None:
        own_scenes.build(name)
    else:
        bpy.ops.wm.open_mainfile(filepath=str(path))
    names = [obj.name for obj in bpy.context.view_layer.objects if obj.type == "MESH" and obj.name != "Probes"]
    names = [
        name for name in names if not bpy.data.objects[name].hide_render and len(bpy.data.objects[name].data.polygons)
    ]
    return BakeJob.prepare(bpy.context, [VertexRequest()], Progress(), names)


def light_by(job, quality, fitted):
    """E of vertices (n, 3), and the processor's seconds; sampled at vertices, or fitted and denoised."""
    job = replace(job, targets=[replace(job.targets[0], fit=fitted, denoise=fitted)], counts=dict(job.counts))
    start = process_time()
    product = job.solve(settings_for(quality), Progress()).outputs[0]
    return product.irradiance.value, process_time() - start, product.n_samples


def of_scene(name, path):
    job = prepared(name, path)
    tracer = EmbreeTracer(job.scene)
    vertices = vertex_receivers(job.targets[0].meshes, all_shown=True)
    faces = ShownFaces.of(job.targets[0].meshes, vertices.targets)
    face, weight, truth, noise = truth_of(job.scene, faces, vertices, tracer)
    corner = faces.receiver[face]

    def errors(value):
        off = (np.einsum("nk,nki->ni", weight, value[corner]) - truth).mean(axis=1)
        return np.sqrt(max(np.mean(off**2) - noise**2, 0)) / truth.mean(), np.abs(off).mean() / truth.mean()

    (before, s0, _), (after, s1, n_samples) = (light_by(job, "medium", fitted) for fitted in (False, True))
    (r0, m0), (r1, m1) = errors(before), errors(after)
    numbers = f"{len(vertices):,}", f"{n_samples:,}", f"{r0:.1%}", f"{r1:.1%}", f"{m0:.1%}", f"{m1:.1%}"
    return [name, *numbers, f"{s0:.1f}", f"{s1:.1f}"]


def truth_of(scene, faces, vertices, tracer):
    """Faces (n,), weights (n, 3) and E (n, 3) of points that somebody sees, and the standard error of E."""
    random = np.random.default_rng(7)
    ends = np.cumsum(faces.area)
    face = np.searchsorted(ends, (np.arange(N_POINTS) + random.random(N_POINTS)) / N_POINTS * ends[-1])
    root, v = np.sqrt(random.random(N_POINTS)), random.random(N_POINTS)
    weight = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    corners, normals = faces.position[face].astype(np.float64), faces.normal[face].astype(np.float64)
    position, normal = (np.einsum("nk,nki->ni", weight, values) for values in (corners, normals))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat *= np.sign((flat * normal).sum(axis=1, keepdims=True)) / np.linalg.norm(flat, axis=1, keepdims=True)
    radius = np.full(N_POINTS, 1e-3 * region_of(vertices.position).radius)
    at = Receivers(*(a.astype(np.float32) for a in (position + 1e-3 * radius[:, None] * flat, normal, radius)))
    _, hidden = face_samples(faces.__class__(*(a[:0] for a in vars(faces).values())), at, 1.0, tracer, Workers())
    settings = settings_for("high", interpolate=False, n_gather_rays=N_RAYS, seed=5)
    light = bake(scene, at, settings, tracer)
    noise = float(np.sqrt(np.mean(light.stderr[~hidden].astype(np.float64) ** 2)))
    return face[~hidden], weight[~hidden], light.value[~hidden], noise


def wall_rows(path):
    """Of light sampled at vertices, and of fitted and denoised light."""
    job = prepared("demo", path)
    for name, fit, denoise in (("sampled", False, False), ("fitted and denoised", True, True)):
        light = []
        for quality in ("medium", "high"):
            target = replace(job.targets[0], fit=fit, denoise=denoise)
            one = replace(job, targets=[target], counts=dict(job.counts))
            light.append(one.solve(settings_for(quality), Progress()).outputs[0])
        receivers = light[0].receivers
        wall = next(target for target in receivers.targets if target.object_name == "Back Wall")
        chosen = np.unique(wall.receiver_of_element)
        place = receivers.position[chosen]
        medium, high = (one.irradiance.value[chosen].mean(axis=1) for one in light)
        ratio = medium / high
        around = cKDTree(place).query_ball_point(place, NEAR)
        local = ratio - np.array([ratio[near].mean() for near in around])
        low, top = place[:, [0, 2]].min(axis=0) + RIM, place[:, [0, 2]].max(axis=0) - RIM
        inner = ((place[:, [0, 2]] > low) & (place[:, [0, 2]] < top)).all(axis=1)
        yield [name, f"{ratio.std():.2%}", f"{local.std():.2%}", f"{local[inner].std():.2%}"]
