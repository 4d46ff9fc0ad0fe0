"""Rivals: how long others take to get to an error, from a curve of errors and a line of times, both measured."""

import json
from dataclasses import dataclass
from time import process_time

import bpy
import numpy as np
from cycles_bakes import bake_indirect, baked
from truth import FOLDER

_CURVES = FOLDER / "cycles_errors.json"
_SEEDS_OF = {16: 16, 64: 8, 256: 4, 1024: 2, 4096: 1}
_COUNTS = ((1, 4, 16), (1, 4), (1, 2))
_MOST_SAMPLES = 7e6


@dataclass(frozen=True)
class Rival:
    """Who bakes the same receivers.

    Attributes
    ----------
    name : str
    samples, errors : (k,) float64
        The measured curve: relative RMSE with so many samples a receiver, samples ascending.
    start, per_sample : float, s
        Its time for all receivers is start + per_sample · samples.
    """

    name: str
    samples: np.ndarray
    errors: np.ndarray
    start: float
    per_sample: float

    def seconds(self, samples):
        return self.start + self.per_sample * np.maximum(samples, 1)

    def to_reach(self, error):
        """Seconds to get to an error, and whether that is beyond the measured curve.

        On the curve the samples are interpolated in log-log, since errors with rare bright samples do not fall as
        1/√n; beyond its ends they are extrapolated by 1/√n.
        """
        errors = np.minimum.accumulate(self.errors)
        end = 0 if error > errors[0] else -1
        if errors[-1] <= error <= errors[0]:
            samples = np.exp(np.interp(-np.log(error), -np.log(errors), np.log(self.samples)))
            return float(self.seconds(samples)), False
        return float(self.seconds(self.samples[end] * (errors[end] / error) ** 2)), True


def error_curve(name, truth, anew=False):
    """Samples a vertex and Cycles' relative RMSE at the probes' single vertices, (k,) each."""
    kept = json.loads(_CURVES.read_text()) if _CURVES.exists() else {}
    if anew or kept.get(name, {}).get("truth") != truth.key:
        errors = [_cycles_error(truth, n, n_seeds) for n, n_seeds in _SEEDS_OF.items()]
        kept[name] = {"truth": truth.key, "samples": list(_SEEDS_OF), "errors": [round(error, 5) for error in errors]}
        _CURVES.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")
    return np.array(kept[name]["samples"], float), np.array(kept[name]["errors"])


def _cycles_error(truth, n_samples, n_seeds):
    """RMS over several bakes."""
    probes, errors = bpy.data.objects["Probes"], []
    for seed in range(n_seeds):
        bake_indirect(probes, n_samples, seed)
        errors.append(truth.relative_rmse(baked(probes)))
    return float(np.sqrt(np.mean(np.square(errors))))


def time_line(obj):
    """Seconds of a bake of an object: at the start, and for each sample a vertex; and the cores that Cycles had.

    A line through bakes of a few samples. Cycles samples every corner and takes the mean of a vertex' corners, so that
    n samples a corner are n · corners / vertices samples a vertex.
    """
    n_corners, n_vertices = len(obj.data.loops), len(obj.data.vertices)
    counts = next((c for c in _COUNTS if sum(c) * n_corners < _MOST_SAMPLES), _COUNTS[-1])
    cpu = process_time()
    times = np.array([bake_indirect(obj, n, seed=1) for n in counts])
    per_sample, start = np.polyfit(counts, times, 1, w=1 / times)
    return max(float(start), 0.0), float(per_sample) * n_vertices / n_corners, (process_time() - cpu) / times.sum()
