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
    runs = [cycles_mean(seed, case.into_image) for seed in range(RUNS)]
    while Mean.of_runs(runs).relative_error > ENOUGH and len(runs) < MOST_RUNS:
        runs.append(cycles_mean(len(runs), case.into_image))
    mean = Mean.of_runs(runs)
    samples = len(runs) * SAMPLES * len(bpy.data.objects["Probes"].data.loops)
    mean, stderr = ([float(f"{x:.6g}") for x in part] for part in (mean.value[:3], mean.stderr[:3]))
    return Reference(mean, stderr, samples, bpy.app.version_string, case.fingerprint)


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
