"""Makes truth: converged values at probes, by Cycles.

    make bench ARGS="--make-truth NAME…"

In up to ten minutes of two cores a scene. Scenes of our own get their probes here, and all their samples. Shared
scenes have both, from the mean of each probe's three vertices; here the vertices are told apart, since errors are those
of single ones, and where noise is largest more samples are added.
"""

from dataclasses import asdict
from time import process_time

import bpy
import numpy as np
from camera_only import LIFT, add_probes, camera_only_mesh
from cycles_bakes import bake_indirect, baked
from figures import rendered_scene
from own_scenes import OWN_SCENES, build
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere, to_world
from photon_bake.addon.output import atomic_path
from photon_bake.addon.scene.surface_points import surface_points
from photon_bake.addon.tracing.embree import EmbreeTracer
from truth import FOLDER, Truth, fingerprint

N_PROBES = 400
NOISE = 0.005
MAX_CPU_SECONDS = 1200
_N_SAMPLES = 4096  # of a run
_MIN_RUNS = 4
_N_NOISIEST = 24  # probes that get more samples in a run
_PROBE_SIZE = 2e-5  # of the region's diagonal


def make(name, path):
    """Make the truth of a scene of our own where `path` is None, else improve that of a shared scene."""
    return _make_own(name) if path is None else _improve_shared(name, path)


def _make_own(name):
    """Bake a scene's probes with Cycles, run after run, until noise is under `NOISE` or time is up.

    What there is is kept after every run.
    """
    build(name)
    key = fingerprint()
    region = np.array(OWN_SCENES[name].region, np.float32)
    position, normal = choose_probes(rendered_scene(), region)
    size = _PROBE_SIZE * np.linalg.norm(region[1] - region[0])
    probes, runs, start, noise = add_probes(position, normal, size), [], process_time(), np.inf
    while len(runs) < _MIN_RUNS or (noise > NOISE and process_time() - start < MAX_CPU_SECONDS):
        bake_indirect(probes, _N_SAMPLES, seed=100 + len(runs))
        runs.append(baked(probes).reshape(-1, 3, 3).swapaxes(0, 1))  # a probe's three vertices are independent
        values = np.concatenate(runs)
        stderr = values.std(axis=0, ddof=1) / np.sqrt(len(values))
        truth = Truth(position, values.mean(axis=0), stderr, np.ones(len(position), bool))
        noise = truth.noise
        print(f"{name}: run {len(runs)}, {process_time() - start:.0f} s of CPU, noise {noise:.2%}", flush=True)
        extra = {"normal": normal, "size": size, "n_samples": len(values) * _N_SAMPLES, "fingerprint": key}
        _keep(name, truth, **extra)


def _improve_shared(name, path):
    """Tell probes whose vertices are not alike, and add samples to the noisiest of the others, batch after batch."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    shared = Truth.read(path.with_suffix(".npz"))
    with np.load(path.with_suffix(".npz")) as file:
        pool = Pool(shared, int(file["spp"]))
    probes, start, runs = bpy.data.objects["Probes"], process_time(), []
    for seed in range(_MIN_RUNS):
        bake_indirect(probes, _N_SAMPLES // 4, seed=200 + seed)
        runs.append(baked(probes).reshape(-1, 3, 3))
        pool.add(np.arange(len(shared.mean)), runs[-1], _N_SAMPLES // 4)
    keep = shared.keep & _alike(np.stack(runs).mean(axis=3), shared)
    corners = np.empty(len(probes.data.vertices) * 3, np.float32)
    probes.data.vertices.foreach_get("co", corners)
    corners, seed = corners.reshape(-1, 3, 3), 300
    while (truth := pool.truth(keep)).noise > NOISE and process_time() - start < MAX_CPU_SECONDS:
        noisiest = np.argsort(np.where(keep, pool.gain, 0))[-_N_NOISIEST:]
        obj = camera_only_mesh("Noisiest", corners[noisiest].reshape(-1, 3), np.arange(3 * _N_NOISIEST).reshape(-1, 3))
        bake_indirect(obj, 4 * _N_SAMPLES, seed)
        pool.add(noisiest, baked(obj).reshape(-1, 3, 3), 4 * _N_SAMPLES)
        bpy.data.objects.remove(obj)
        seed += 1
        print(
            f"{name}: {process_time() - start:.0f} s of CPU, {keep.sum()} probes, noise {truth.noise:.2%}", flush=True
        )
        _keep(name, pool.truth(keep), fingerprint=shared.key)
    _keep(name, truth, fingerprint=shared.key)


class Pool:
    """Means of probes from batches of different numbers of samples, each batch weighing by its number."""

    def __init__(self, truth, n_samples):
        self._position = truth.position
        self._n = np.full((len(truth.mean), 1), float(n_samples))
        self._total = self._n * truth.mean
        self._variance = (self._n * truth.stderr) ** 2

    def add(self, k, values, n_samples):
        """Add values (k, 3 vertices, 3 colours) of so many samples a vertex to the probes k."""
        n = 3 * n_samples
        self._n[k] += n
        self._total[k] += n * values.mean(axis=1)
        self._variance[k] += n**2 * values.var(axis=1, ddof=1) / 3

    @property
    def gain(self):
        """How much more samples at each probe would lessen the variance, up to a factor, (n,)."""
        return (self._variance / self._n**3).mean(axis=1)

    def truth(self, keep):
        mean, stderr = self._total / self._n, np.sqrt(self._variance) / self._n
        return Truth(self._position, mean.astype(np.float32), stderr.astype(np.float32), keep)


def _alike(runs, truth, apart=0.1, sigmas=6):
    """Probes whose three vertices get the same light, from runs (r, n, 3), up to noise or a tenth, (n,) bool.

    Of a probe at an edge a vertex may lie inside the surface beside it, and be black.
    """
    means, variance = runs.mean(axis=0), runs.var(axis=0, ddof=1).mean(axis=1) / len(runs)
    spread = np.ptp(means, axis=1)
    light = np.maximum(truth.mean.mean(axis=1), truth.kept_mean / 20)
    return (spread < apart * light) | (spread < sigmas * np.sqrt(variance))


def _keep(name, truth, **more):
    FOLDER.mkdir(exist_ok=True)
    with atomic_path(FOLDER / f"{name}.npz") as path:
        np.savez_compressed(path, **asdict(truth), **more)


def choose_probes(scene, region, n=N_PROBES, n_rays=32):
    """Positions and normals of n points even by area over the surfaces in a region, lifted off them, (n, 3) float32.

    Points inside things are left out: those from which rays meet the back of a surface.
    """
    random = np.random.default_rng(1)
    diagonal = np.linalg.norm(region[1] - region[0])
    parts = list(surface_points(scene, region, diagonal / 100))
    x = np.concatenate([part.position for part in parts])
    normal = scene.normals[np.concatenate([part.triangle for part in parts])]
    inside = ((x >= region[0] - LIFT * diagonal) & (x <= region[1] + LIFT * diagonal)).all(axis=1)
    chosen = random.permutation(np.flatnonzero(inside))
    x, normal = x[chosen] + np.float32(LIFT * diagonal) * normal[chosen], normal[chosen]
    normals = normal.repeat(n_rays, axis=0)
    rays = to_world(sample_cosine_hemisphere(random.random((len(normals), 2))), normals).astype(np.float32)
    hits = EmbreeTracer(scene).closest_hit(x.repeat(n_rays, axis=0), rays)
    under = (hits.hit & hits.back(rays)).reshape(-1, n_rays).mean(axis=1) > 1 / 16
    return x[~under][:n].astype(np.float32), normal[~under][:n].astype(np.float32)
