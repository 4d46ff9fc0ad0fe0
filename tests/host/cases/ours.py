"""What the bake says of the light at the probes."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import bpy
import numpy as np
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import BakeSettings, settings_for
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest

from .means import Mean
from .registry import Case

SEEDS = (1, 2, 3, 4)
SETTINGS = settings_for(
    "draft", n_photons=25_000, n_gather_rays=512, n_cache_elements=2_500, n_cache_rays=4, n_threads=1
)
"""Four small bakes tell their own noise, cache and all, which one large bake does not."""


def our_bake(case: Case) -> tuple[Mean, list[str]]:
    """Our bake of the probes of the scene as it is, and what it warns of."""
    more = {"motion_blur": case.motion_blur}
    request = VertexRequest(fit=False, denoise=False)  # the light at the corners themselves, as Cycles' bakes have it
    job = BakeJob.prepare(bpy.context, [request], Progress(), ["Probes"], case.light_group, **more)
    settings = settings_of(case)
    seeds = SEEDS[:2] if case.unsupported else SEEDS  # whose noise counts for nothing
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # more bakes at a time would take the cache from each other
        runs = list(pool.map(lambda seed: _at_probes(job, replace(settings, seed=seed)), seeds))
    return Mean.of_runs(runs), job.warnings


def settings_of(case: Case) -> BakeSettings:
    """The settings, with as much more work as the case needs; caustics get sharper and quieter by the root of it."""
    work = ("n_photons", "n_gather_rays", "n_cache_elements")
    more = {knob: case.effort * getattr(SETTINGS, knob) for knob in work} | {"motion_blur": case.motion_blur}
    return replace(SETTINGS, **more, n_nearest=round(case.effort**0.5 * SETTINGS.n_nearest))


def _at_probes(job: BakeJob, settings: BakeSettings) -> np.ndarray:
    """One bake's mean over the corners, (3,)."""
    (light,) = job.solve(settings, Progress()).outputs
    (target,), mesh = light.receivers.targets, bpy.data.objects["Probes"].data
    of_corner = target.receiver_of_element
    if len(of_corner) == len(mesh.vertices):
        of_corner = of_corner[[corner.vertex_index for corner in mesh.loops]]
    return light.irradiance.value[of_corner].mean(axis=0, dtype=np.float64) / np.pi
