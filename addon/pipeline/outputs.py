"""One solve for all outputs: their receivers are lit together, and by each light group apart.

Here are the decisions that no output makes for itself: whether receivers look at the wrong side, by what photons
are traced, and how the time is shared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
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

    def kept(self) -> Any:
        """What `lit_by` gave: arrays, plain values, mappings and dataclasses of them, or None."""

    def with_kept(self, kept: Any) -> "Samples":
        """The same with what `lit_by` gave others that were read like these."""

    @staticmethod
    def over_time(shots: "Sequence[tuple[Any, Irradiance]]") -> "tuple[Any, Irradiance]":
        """The samples and their light as a shutter shows them that was open at several times, from those of each."""

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
    totals : list of Irradiance
        At the receivers of each of the samples; of all light groups together.
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
    counts : dict of str to int
        Of all receivers.
    """

    totals: list[Irradiance]
    outputs: list[list[Any]]
    dark: bool
    flush_emitters: list[tuple[str, str]]
    turned_away: list[str]
    inside_out: list[str]
    cube_maps: MultiImageTracer | None
    counts: dict[str, int]


@dataclass(frozen=True)
class Exposure:
    """Light of samples at one time, not finished yet.

    Attributes
    ----------
    total : Irradiance
        At all receivers, one sample's after the other's; of all light groups together.
    lights : list of Irradiance
        The same of each light group.
    samples : list of list of Samples
        As each light group lights them.
    dark, flush_emitters, turned_away, inside_out, cube_maps
        As in `Lit`.
    """

    total: Irradiance
    lights: list[Irradiance]
    samples: list[list[Samples]]
    dark: bool = False
    flush_emitters: list[tuple[str, str]] = field(default_factory=list)
    turned_away: list[str] = field(default_factory=list)
    inside_out: list[str] = field(default_factory=list)
    cube_maps: MultiImageTracer | None = None


def expose(
    scene: Scene,
    groups: Sequence[Scene],
    samples: Sequence[Samples],
    settings: BakeSettings,
    tracer: EmbreeTracer,
    workers: Workers,
    inspector: Inspector | None = None,
    started: float | None = None,
) -> Exposure:
    """Light all samples by one solve; `developed` finishes them.

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
        return Exposure(Irradiance.together(lights), lights, [list(samples)] * len(groups))

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
    return Exposure(total, lights, of_groups, dark, flush, turned_away, inside_out, maps)


def developed(exposures: Sequence[Exposure], workers: Workers) -> Lit:
    """The outputs of what was exposed at several times, of which each counts as much, or at one."""
    first = exposures[0]
    outputs = []
    for group, part in enumerate(workers.parts(len(first.lights))):
        shots = [_shots(one.samples[group], one.lights[group]) for one in exposures]
        outputs.append([_over_time(of_one).finish(part) for of_one in zip(*shots, strict=True)])
    totals = [_shots(one.samples[0], one.total) for one in exposures]
    return Lit(
        totals=[_over_time(of_one).irradiance for of_one in zip(*totals, strict=True)],
        outputs=[list(of_one) for of_one in zip(*outputs, strict=True)],
        dark=all(one.dark for one in exposures),
        flush_emitters=list(dict.fromkeys(pair for one in exposures for pair in one.flush_emitters)),
        turned_away=_at_all_times([one.turned_away for one in exposures]),
        inside_out=_at_all_times([one.inside_out for one in exposures]),
        cube_maps=first.cube_maps,
        counts=Irradiance.counted([one.total for one in exposures]),
    )


@dataclass(frozen=True)
class _Shot:
    """Samples and the light of their receivers."""

    samples: Samples
    irradiance: Irradiance

    def finish(self, workers: Workers) -> Any:
        return self.samples.finish(self.irradiance, workers)


def _shots(samples: Sequence[Samples], irradiance: Irradiance) -> list[_Shot]:
    return [_Shot(*of_one) for of_one in zip(samples, parts_of(samples, irradiance), strict=True)]


def _over_time(shots: Sequence[_Shot]) -> _Shot:
    """One of several times."""
    if len(shots) == 1:
        return shots[0]
    return _Shot(*shots[0].samples.over_time([(one.samples, one.irradiance) for one in shots]))


def _at_all_times(names: list[list[str]]) -> list[str]:
    return [name for name in names[0] if all(name in others for others in names)]


def parts_of(samples: Sequence[Samples], irradiance: Irradiance) -> list[Irradiance]:
    """The light of the receivers of each of the samples."""
    ends = np.cumsum([len(one.receivers) for one in samples])
    return [irradiance.where(slice(end - len(one.receivers), end)) for one, end in zip(samples, ends, strict=True)]


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
