"""One solve for all outputs: their receivers are lit together, and by each light group apart.

Here are the decisions that no output makes for itself: whether receivers look at the wrong side, by what photons
are traced, and how the time is shared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..core.errors import BakeError
from ..core.inspector import Inspector
from ..core.parallel import Workers
from ..emitters import light_sources, region_of
from ..gather import Irradiance, OpenBacks
from ..photons import Photons, emitted_rays
from ..receivers import Receivers, on_normal_maps
from ..scene import Scene
from ..settings.bake import BakeSettings
from ..tracing import EmbreeTracer
from ..tracing.cube_maps import LightRays, MultiImageTracer, lit_region
from .bake import no_light, solve_apart
from .gathers import irradiances
from .solution import Solution

N_LIGHT_RAYS = 1000
"""That are followed to see which surfaces cube maps are to show."""


class Samples(Protocol):
    """Where an output wants light."""

    @property
    def receivers(self) -> Receivers: ...

    def lit_by(self, solution: Solution, workers: Workers) -> "Samples":
        """The same with what is wanted of a solution beside the receivers' light.

        That comes first, so that the light is gathered in the time that is left.
        """

    def finish(self, irradiance: Irradiance, workers: Workers) -> Any:
        """The output of the receivers' light."""


@runtime_checkable
class LooksAround(Protocol):
    """Samples that send rays of their own from `eyes`, which are no receivers of theirs."""

    @property
    def eyes(self) -> Receivers: ...


@dataclass(frozen=True)
class Lit:
    """Light of samples.

    Attributes
    ----------
    total : Irradiance
        At all receivers, one sample's after the other's; of all light groups together.
    outputs : list of list
        What each of the samples makes of each light group's light, sample by sample.
    dark : bool
        Whether nothing gives light.
    flush_emitters : list of (str, str)
        Names of emissive objects, and of those whose place they share.
    turned_away : list of str
        Names of objects that turn their back to the light.
    inside_out : list of str
        Names of objects whose faces look inwards, where it is dark.
    cube_maps : MultiImageTracer or None
        By which photons were traced.
    """

    total: Irradiance
    outputs: list[list[Any]]
    dark: bool
    flush_emitters: list[tuple[str, str]]
    turned_away: list[str]
    inside_out: list[str]
    cube_maps: MultiImageTracer | None


def light(
    scene: Scene,
    groups: Sequence[Scene],
    samples: Sequence[Samples],
    settings: BakeSettings,
    tracer: EmbreeTracer,
    workers: Workers,
    inspector: Inspector | None = None,
    started: float | None = None,
) -> Lit:
    """Light all samples by one solve.

    Parameters
    ----------
    groups : sequence of Scene
        `scene` as each light group lights it, by `Scene.lit_by`; `scene` alone for all light together.
    tracer : EmbreeTracer
        What receivers look with; photons too, unless the settings choose cube maps.
    started : float, s
        When the time began that the settings give, by `time.perf_counter`; without it, now.

    Raises
    ------
    BakeError
        If the gather that the settings choose cannot light them.
    Cancelled
        If the workers' progress was cancelled.
    """
    inspector, started = inspector or Inspector(), started or perf_counter()
    receivers = Receivers.join([one.receivers for one in samples])
    if settings.normal_maps and receivers.view is None:
        receivers = on_normal_maps(receivers, scene, tracer)
    backs = OpenBacks.of(scene, receivers, tracer, workers, settings.open_side)
    if settings.open_side:
        receivers = backs.added_to(receivers)
    everywhere = _with_eyes(receivers, samples, settings)
    if len(everywhere) == 0:
        lights = [no_light()] * len(groups)
        return Lit(
            Irradiance.together(lights), _finished([samples] * len(groups), lights, workers), False, [], [], [], None
        )

    # One solve for all that want light
    maps = _cube_maps(scene, tracer, everywhere, settings, workers, inspector)
    solutions = solve_apart(scene, groups, everywhere, settings, tracer, workers.progress, inspector, maps, started)
    if len(everywhere) > len(receivers):
        solutions = [solution.at(receivers) for solution in solutions]

    # What outputs want of it beside their receivers' light, and then that
    parts = workers.parts(len(groups))
    of_groups = [
        [one.lit_by(solution, part) for one in samples] for solution, part in zip(solutions, parts, strict=True)
    ]
    lights = irradiances(solutions, workers) if len(receivers) else [no_light()] * len(groups)
    turned_away, inside_out = list[str](), list[str]()
    if len(receivers) and not settings.open_side:
        photons = Photons.join([solution.photons for solution in solutions])
        inside_out = backs.lit_outside(scene, photons)
        turned_away = [name for name in backs.lit_behind(scene, photons) if name not in inside_out]
    total = Irradiance.together(lights)
    if settings.open_side:
        lights, total = [backs.taken(one, total) for one in lights], backs.taken(total)
    dark, flush = all(solution.dark for solution in solutions), solutions[0].tracer.flush_emitters
    return Lit(total, _finished(of_groups, lights, workers), dark, flush, turned_away, inside_out, maps)


def parts_of(samples: Sequence[Samples], irradiance: Irradiance) -> list[Irradiance]:
    """The light of the receivers of each of the samples."""
    ends = np.cumsum([len(one.receivers) for one in samples])
    return [irradiance.where(slice(end - len(one.receivers), end)) for one, end in zip(samples, ends, strict=True)]


def _finished(of_groups: Sequence[Sequence[Samples]], lights: list[Irradiance], workers: Workers) -> list[list[Any]]:
    """What samples make of their light, for each of them by light groups."""
    outputs = []
    for samples, irradiance, part in zip(of_groups, lights, workers.parts(len(lights)), strict=True):
        of_samples = zip(samples, parts_of(samples, irradiance), strict=True)
        outputs.append([one.finish(own, part) for one, own in of_samples])
    return [list(of_one) for of_one in zip(*outputs, strict=True)]


def _with_eyes(receivers: Receivers, samples: Sequence[Samples], settings: BakeSettings) -> Receivers:
    """The receivers, and after them the eyes of those that look around."""
    eyes = [one.eyes for one in samples if isinstance(one, LooksAround)]
    if not eyes:
        return receivers
    if not settings.needs_cache:
        raise BakeError("Probes look around with rays: choose Final Gather, or a Light Volume with Volume Rays.")
    return Receivers.join([receivers, *eyes] if len(receivers) else eyes)


def _cube_maps(
    scene: Scene,
    tracer: EmbreeTracer,
    receivers: Receivers,
    settings: BakeSettings,
    workers: Workers,
    inspector: Inspector,
) -> MultiImageTracer | None:
    """A tracer of photons through cube maps around the receivers; None if not asked for, or if nothing gives light."""
    sources = light_sources(scene, region_of(receivers.position)) if settings.tracer == "multi_image" else []
    if not sources:
        return None
    rays = emitted_rays(sources, N_LIGHT_RAYS, settings.seed)
    origins, directions = (np.concatenate([getattr(one, name) for one in rays]) for name in ("origins", "directions"))
    images = MultiImageTracer.build(
        scene, tracer, lit_region(receivers.position), settings.n_maps, settings.map_size, workers=workers,
        light=LightRays(origins, directions),
    )  # fmt: skip
    inspector.see("maps", lambda: (images.maps.centres, None))
    return images
