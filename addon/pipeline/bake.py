"""One bake, stage by stage: photons are traced, receivers gather them."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from ..core.errors import BakeError
from ..core.inspector import LIFT, Inspector
from ..core.parallel import Workers
from ..core.progress import Progress
from ..emitters import Source, light_sources, region_of
from ..gather import (
    DirectLight,
    ImportancePilot,
    Irradiance,
    MidAir,
    importance_pilot,
)
from ..photons import GuidedSource, Photons, bounces_left, guide_sources, noise_of_photons, pilots_for, trace_photons
from ..receivers import Receivers
from ..scene import Scene
from ..settings.bake import BakeSettings, affordable
from ..tracing import EmbreeTracer, Tracer, TransparencyTracer
from ..tracing.bodies import without_thick_bodies
from .solution import Setup, Solution

_PILOT_PART = 0.1  # of the stage in which photons are traced


def bake(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: EmbreeTracer,
    progress: Progress | None = None,
) -> Irradiance:
    """Trace photons through `scene` and gather them at `receivers`.

    Raises
    ------
    BakeError
        If the gather that the settings choose cannot light the receivers.
    Cancelled
        If `progress` was cancelled.
    """
    if len(receivers) == 0:
        return no_light()
    return solve(scene, receivers, settings, tracer, progress).irradiance()


def no_light() -> Irradiance:
    """The light of no receivers."""
    nothing = np.zeros((0, 3), np.float32)
    slope = np.zeros((0, 3, 3), np.float32)
    return Irradiance(nothing, nothing[:, 0], {"indirect": nothing}, {"receivers": 0}, slope)


def solve(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: EmbreeTracer,
    progress: Progress | None = None,
) -> Solution:
    """Trace photons through `scene`, those that `receivers` (at least one) need, and keep them; otherwise as `bake`."""
    return solve_apart(scene, [scene], receivers, settings, tracer, progress)[0]


def solve_apart(
    scene: Scene,
    lit: Sequence[Scene],
    receivers: Receivers,
    settings: BakeSettings,
    tracer: EmbreeTracer,
    progress: Progress | None = None,
    inspector: Inspector | None = None,
    photon_tracer: Tracer | None = None,
    started: float | None = None,
) -> list[Solution]:
    """`solve` for several lights, each with as many photons as the settings say; they share what has no light in it.

    Parameters
    ----------
    lit : sequence of Scene
        `scene` with a part of its lights each, by `Scene.lit_by`.
    inspector : Inspector, optional
        Is shown the photons (W) and the light volume's cells (W/m²).
    photon_tracer : Tracer, optional
        Traces the photons, to whose paths its errors matter less than to gather rays; without it `tracer` traces all.
    started : float, s
        When the time began that the settings give, by `time.perf_counter`; without it, now.
    """
    progress, inspector = progress or Progress(), inspector or Inspector()
    _check(receivers, settings)
    materials = without_thick_bodies(scene, tracer, settings.seed).materials
    if materials is not scene.materials:
        scene, *lit = (replace(one, materials=materials) for one in (scene, *lit))
    started = started or perf_counter()
    workers = Workers(settings.seed, settings.n_threads, progress, settings.memory)
    setup = _set_up(scene, receivers, settings, tracer, photon_tracer, started, inspector, workers)
    return [_solved(setup, one, len(lit), part) for one, part in zip(lit, workers.parts(len(lit)), strict=True)]


def _set_up(
    scene: Scene,
    receivers: Receivers,
    settings: BakeSettings,
    tracer: EmbreeTracer,
    photon_tracer: Tracer | None,
    started: float,
    inspector: Inspector,
    workers: Workers,
) -> Setup:
    """What has no light in it: tracers, where receivers are, and where gather rays end, so that photons go there."""
    region = region_of(receivers.position)
    light_tracer = TransparencyTracer(scene, tracer, workers.progress)
    of_photons = light_tracer.with_first_hits(photon_tracer) if photon_tracer else light_tracer
    pilot = None
    if settings.needs_cache:
        pilot = importance_pilot(scene, light_tracer, receivers, region, settings.n_cache_elements, workers)
    deadline = started + settings.time if settings.time else np.inf
    return Setup(scene, receivers, settings, light_tracer, of_photons, region, pilot, deadline, inspector)


def _solved(setup: Setup, scene: Scene, n_lights: int, workers: Workers) -> Solution:
    """The light of a scene, which is one of so many that have the time together."""
    setup = setup.lit_by(scene)
    settings, pilot, region, of_photons = setup.settings, setup.pilot, setup.region, setup.photon_tracer
    home = pilot.target_region if pilot else region
    sources = light_sources(scene, region if region.radius > 0 else home)

    # See what photons are worth to those who gather
    emitters, noise = sources, 0.0
    if pilot:
        guided, seconds = _guided(scene, of_photons, sources, pilot, settings, workers)
        if settings.time:
            settings = affordable(settings, pilots_for(settings.n_photons) / seconds / n_lights)
        emitters, noise = list[Source](guided), noise_of_photons(guided, settings.n_photons)

    # Trace them
    rest = workers.part(_PILOT_PART if pilot else 0.0, 1.0)
    n_photons, n_bounces, volumes = settings.n_photons, settings.max_bounces, settings.gather == "photon_volumes"
    mid_air = _in_mid_air(scene, setup.tracer, setup.receivers, settings)
    log = mid_air.log if mid_air else None
    photons = trace_photons(
        scene, of_photons, emitters, n_photons, n_bounces, rest, region=home, on_gloss=volumes, log=log
    )
    setup.inspector.see("photons", lambda: (photons.position + LIFT * region.radius * photons.normal, photons.power))
    return Solution(
        setup=setup,
        scene=scene,
        receivers=setup.receivers,
        settings=settings,
        sources=sources,
        photons=photons,
        bounces_left=bounces_left(emitters, n_photons, photons),
        noise=noise,
        direct=DirectLight(scene, setup.tracer, sources),
        mid_air=mid_air,
        workers=workers,
    )


def _in_mid_air(
    scene: Scene, tracer: TransparencyTracer, receivers: Receivers, settings: BakeSettings
) -> MidAir | None:
    """Receivers that no photons are stored around, though densities of photons are wanted there; None without any."""
    by_density = settings.gather == "density"
    if not by_density and scene.materials.matte.all():  # no caustics
        return None
    return MidAir.of(scene, tracer, receivers, scattered=by_density)


def _check(receivers: Receivers, settings: BakeSettings) -> None:
    """Refuse receivers that a gather cannot light."""
    if receivers.directional and settings.gather == "light_volume":
        raise BakeError("A light volume does not tell what directional lightmaps need: choose another Gather.")
    if receivers.view is None and settings.gather == "photon_volumes":
        raise BakeError("Photon volumes light a camera's pixels: bake to Camera alone, or choose another Gather.")


def _guided(
    scene: Scene,
    tracer: TransparencyTracer,
    sources: list[Source],
    pilot: ImportancePilot,
    settings: BakeSettings,
    workers: Workers,
) -> tuple[list[GuidedSource], float]:
    """Sources whose photons go to what gather rays see, and the seconds that the photons took which told it."""
    start = perf_counter()

    def worth(photons: Photons) -> np.ndarray:
        return pilot.importance(scene, photons)

    part, n_pilots = workers.part(0.0, _PILOT_PART), pilots_for(settings.n_photons)
    at, n_bounces = pilot.target_region, settings.max_bounces
    guided = guide_sources(scene, tracer, sources, n_pilots, n_bounces, worth, part, at, pilot.importance_of_watt)
    return guided, perf_counter() - start
