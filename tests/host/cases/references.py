"""The reference values in tests/references/cases.json."""

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np

from .cycles import cycles_mean, keep_light_group, set_cycles
from .means import Mean
from .registry import Case

PATH = Path(__file__).resolve().parents[2] / "references" / "cases.json"

SAMPLES = 1024  # a corner and run
TIMES = 32  # of a run with motion blur
GOLDEN = 0.618034
RUNS = 8  # at least: fewer do not tell their own noise
ENOUGH = 0.003  # relative error at which no more runs are made
MOST_RUNS = 200


@dataclass(frozen=True)
class Reference:
    """What Cycles said of a case.

    Attributes
    ----------
    mean, stderr : list of 3 float
        E_indirect / π, the mean of the probes, and its standard error.
    samples : int
        Paths in all.
    blender : str
        Version that it was made with.
    fingerprint : str
        Of the case that it was made of.
    """

    mean: list[float]
    stderr: list[float]
    samples: int
    blender: str
    fingerprint: str

    @property
    def value(self) -> Mean:
        return Mean.of_colors(np.array(self.mean), np.array(self.stderr))


def measure(case: Case) -> Reference:
    """Bake a case with Cycles until its error is small."""
    case.set_scene()
    if case.light_group:
        keep_light_group(case.light_group)
    set_cycles(SAMPLES)
    if case.motion_blur:
        set_cycles(SAMPLES // TIMES)
    runs = [_run(case, seed) for seed in range(RUNS)]
    while Mean.of_runs(runs).relative_error > ENOUGH and len(runs) < MOST_RUNS:
        runs.append(_run(case, len(runs)))
    mean = Mean.of_runs(runs)
    samples = len(runs) * SAMPLES * len(bpy.data.objects["Probes"].data.loops)
    mean, stderr = ([float(f"{x:.6g}") for x in part] for part in (mean.value[:3], mean.stderr[:3]))
    return Reference(mean, stderr, samples, bpy.app.version_string, case.fingerprint)


def _run(case: Case, seed: int) -> np.ndarray:
    """The probes' mean, (3,); with motion blur over times of the shutter, which is open for a frame around this one."""
    if not case.motion_blur:
        return cycles_mean(seed, case.into_image)
    scene, found = bpy.context.scene, []
    frame = scene.frame_current
    for i in range(TIMES):
        time = frame - 0.5 + (i + (seed + 0.5) * GOLDEN % 1) / TIMES
        scene.frame_set(int(time), subframe=time % 1)
        found.append(cycles_mean(seed * TIMES + i, case.into_image))
    scene.frame_set(frame)
    return np.mean(found, axis=0)


def load() -> dict[str, Reference]:
    """All references by the name of their case."""
    if not PATH.exists():
        return {}
    return {name: Reference(**entry) for name, entry in json.loads(PATH.read_text(encoding="utf-8")).items()}


def save(references: dict[str, Reference]) -> None:
    """Write all references, a line each, at once or not at all."""
    lines = [f'"{name}": {json.dumps(asdict(reference))}' for name, reference in sorted(references.items())]
    partial = PATH.with_suffix(".partial")
    partial.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    os.replace(partial, PATH)


def lacking(case: Case, references: dict[str, Reference]) -> str:
    """Why a case has no valid reference, in one sentence; empty where it has one."""
    remedy = f"run tests/references/make.py --only {case.name}"
    if case.reference not in references:
        return f"There is no reference: {remedy}."
    if references[case.reference].fingerprint != case.fingerprint:
        return f"The case has changed since its reference was made: {remedy}."
    return ""
