"""Converged Cycles values at probes, computed once and kept: truth/NAME.npz for the scenes of our own.

    make bench ARGS="--make-truth NAME…"

computes them anew, in up to ten minutes of two cores a scene. The shared scenes bring theirs, NAME/NAME.npz, made in
the same way.
"""

import hashlib
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from time import process_time

import bpy
import numpy as np
from camera_only import LIFT, add_probes
from cycles_bakes import bake_indirect, baked
from own_scenes import OWN_SCENES, build
from photon_bake.addon.blender import extract_scene
from photon_bake.addon.output import atomic_path
from photon_bake.addon.sampling.warps import sample_cosine_hemisphere, to_world
from photon_bake.addon.scene.surface_points import surface_points
from photon_bake.addon.tracers.embree import EmbreeTracer

FOLDER = Path(__file__).parent / "truth"
N_PROBES = 400
NOISE = 0.005
MAX_CPU_SECONDS = 1200
_N_SAMPLES = 4096  # of a run
_MIN_RUNS = 4
_PROBE_SIZE = 2e-5  # of the region's diagonal


@dataclass(frozen=True)
class Truth:
    """Light at n probes.

    Attributes
    ----------
    position : (n, 3) float32, m
    mean, stderr : (n, 3) float32
        E/π of the indirect light, and its standard error.
    keep : (n,) bool
        The probes whose truth is known well enough to compare with.
    """

    position: np.ndarray
    mean: np.ndarray
    stderr: np.ndarray
    keep: np.ndarray

    @staticmethod
    def read(path):
        with np.load(path) as file:
            return Truth(*(file[name] for name in ("position", "mean", "stderr", "keep")))

    @cached_property
    def kept_mean(self):
        """Mean E/π over the kept probes and colours."""
        return float(self.mean[self.keep].mean())

    @property
    def noise(self):
        """RMS standard error over the mean."""
        return float(np.sqrt(np.mean(self.stderr[self.keep] ** 2))) / self.kept_mean

    def off(self, value):
        """Errors of E/π at the probes' single vertices, (3n, 3), at the kept probes: (k, 3 vertices, 3 colours)."""
        return (value.reshape(-1, 3, 3) - self.mean[:, None])[self.keep]

    def relative_rmse(self, value):
        """RMS error of single vertices over the mean, the truth's own noise taken out."""
        error2 = np.mean(self.off(value) ** 2) - np.mean(self.stderr[self.keep] ** 2)
        return float(np.sqrt(max(error2, 0))) / self.kept_mean

    def bias(self, value):
        """Deviation of the mean."""
        return float(self.off(value).mean()) / self.kept_mean

    def median(self, value):
        """Median of a vertex' error over its own truth."""
        own = np.linalg.norm(self.mean[self.keep], axis=1)[:, None]
        return float(np.median(np.linalg.norm(self.off(value), axis=2) / np.maximum(own, 1e-9)))


def open_own(name):
    """Build a scene of our own with its probes, and read its truth.

    Raises
    ------
    SystemExit
        If there is no truth for the scene as it is now.
    """
    build(name)
    path = FOLDER / f"{name}.npz"
    remedy = f'make it anew: make bench ARGS="--make-truth {name}"'
    if not path.exists():
        raise SystemExit(f"There is no truth of '{name}': {remedy}")
    with np.load(path) as file:
        if str(file["fingerprint"]) != fingerprint():
            raise SystemExit(f"The truth of '{name}' is that of an older scene: {remedy}")
        add_probes(file["position"], file["normal"], float(file["size"]))
    return Truth.read(path)


def make(name):
    """Bake a scene's probes with Cycles, run after run, until noise is under `NOISE` or time is up.

    What there is is kept after every run.
    """
    build(name)
    is_of = fingerprint()
    region = np.array(OWN_SCENES[name].region, np.float32)
    position, normal = choose_probes(extract_scene(bpy.context.evaluated_depsgraph_get()), region)
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
        extra = {"normal": normal, "size": size, "n_samples": len(values) * _N_SAMPLES, "fingerprint": is_of}
        FOLDER.mkdir(exist_ok=True)
        with atomic_path(FOLDER / f"{name}.npz") as path:
            np.savez_compressed(path, **asdict(truth), **extra)


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


def fingerprint():
    """Of Blender's scene: the shapes, lamps, materials and sky that light depends on; the same in every version."""
    found = hashlib.sha256()
    for obj in sorted(bpy.data.objects, key=lambda obj: obj.name):
        found.update(_bytes(obj.name, *np.ravel(obj.matrix_world)))
        if obj.type == "MESH":
            for part, key, size in ((obj.data.vertices, "co", 3), (obj.data.loops, "vertex_index", 1)):
                values = np.empty(len(part) * size, np.float32)
                part.foreach_get(key, values)
                found.update(_bytes(*values))
            found.update(_bytes(*(slot.material.name for slot in obj.material_slots)))
        elif obj.type == "LIGHT":
            lamp, keys = (
                obj.data,
                ("type", "energy", "shadow_soft_size", "size", "shape", "spot_size", "spot_blend", "angle"),
            )
            found.update(_bytes(*lamp.color, *(getattr(lamp, key, None) for key in keys)))
    for owner in [*sorted(bpy.data.materials, key=lambda material: material.name), bpy.context.scene.world]:
        for node in owner.node_tree.nodes if owner and owner.name != "Probe" else ():
            for name in ("Base Color", "Roughness", "Specular IOR Level", "Strength", "A", "B"):
                for socket in (socket for socket in node.inputs if socket.name == name):
                    found.update(_bytes(name, *np.ravel(socket.default_value)))
    return found.hexdigest()


def _bytes(*values):
    """Numbers with four digits after the point, and words."""
    return repr([value if isinstance(value, (str, type(None))) else f"{value + 0.0:.4f}" for value in values]).encode()
