"""Converged Cycles values at probes, computed once and kept.

truth/NAME.npz holds those of the scenes of our own. Shared scenes bring theirs, NAME/NAME.npz; to these truth/NAME.npz
adds what more samples told. make_truth.py makes both.
"""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import bpy
import numpy as np
from camera_only import add_probes
from own_scenes import build

FOLDER = Path(__file__).parent / "truth"


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
    def key(self):
        """Equal for equal truths."""
        return hashlib.sha256(self.mean.tobytes()).hexdigest()[:16]

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


def open_scene(name, path):
    """Open a shared scene's file, or build a scene of our own where `path` is None; with probes. Return its truth.

    Raises
    ------
    SystemExit
        If there is no truth for the scene as it is now.
    """
    return _open_own(name) if path is None else _open_shared(name, path)


def _open_own(name):
    build(name)
    if not (FOLDER / f"{name}.npz").exists():
        raise SystemExit(f"There is no truth of '{name}': {_remedy(name)}")
    with np.load(FOLDER / f"{name}.npz") as file:
        if str(file["fingerprint"]) != fingerprint():
            raise SystemExit(f"The truth of '{name}' is that of an older scene: {_remedy(name)}")
        add_probes(file["position"], file["normal"], float(file["size"]))
    return Truth.read(FOLDER / f"{name}.npz")


def _open_shared(name, path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    truth = Truth.read(path.with_suffix(".npz"))
    if not (FOLDER / f"{name}.npz").exists():
        return truth
    with np.load(FOLDER / f"{name}.npz") as file:
        if str(file["fingerprint"]) != truth.key:
            raise SystemExit(f"What is known beyond the truth of '{name}' is of an older one: {_remedy(name)}")
    return Truth.read(FOLDER / f"{name}.npz")


def _remedy(name):
    return f'make it anew: make bench ARGS="--make-truth {name}"'


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
