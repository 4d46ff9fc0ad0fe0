"""Photons traced through a scene, many at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..bsdf import Lobe
from ..bsdf.mixture import NARROW_LOBES, SUBSURFACE
from ..bsdf.scatter import scatter
from ..core.compiling import by_reference, kernel, part
from ..core.parallel import Workers, slices
from ..core.sampling.path_numbers import PathNumbers, path_key, two_numbers
from ..core.vec3 import BLACK, ONE, ZERO, dot, largest, mul, negative, times
from ..emitters import Source, Sphere
from ..scene import ALL_BOUNCES, RayKind, Scene, seen_by
from ..scene.hit import hit_at
from ..tracing import Hits, TransparencyTracer
from ..tracing.bodies.through import through_body, walk_key
from ..tracing.embree import new_ray
from .bounce_map import picture_rays
from .emission import Emission, Pass, PictureEmission, shares
from .emission_segment import LightLinking, emission_segment
from .flights import FlightLog, Flights
from .front import Front, Photon, new_front, photon_at, put_photon
from .media import pass_media
from .photons import Photons
from .region_directed import TargetRegion, directed, is_directed, target_region
from .store import PhotonStore, store
from .viewers import (
    Viewers,
    choose_first_viewers,
    is_way_of_lamplight,
    next_viewer,
    reflects_to,
    viewers_of,
    which_reflect_to,
)

CHUNK = 1 << 15
"""Photons that fly together: enough to hide Python's cost a call, few enough to stay in the processor's cache."""

_GLOSSY = int(Lobe.GLOSSY)
_LINKING = 1  # stream of random numbers: light linking's, beside those of scattering
_PAIRS = 4  # pairs of random numbers that a path has for each surface


@by_reference
class Rules(NamedTuple):
    """What decides on photons where they meet surfaces.

    Attributes
    ----------
    key : uint64
        Of their random numbers.
    keeps : (m,) bool
        Materials on which they are stored.
    seen : (6, o) bool
        Which objects rays of each `RayKind` see.
    source_seen : (6, s) bool
        Which sources they see; emissive meshes as objects.
    sampled_directly : (s,) bool
        Sources of which direct hits are not stored, see `Source`.
    last_bounce : (s,) int32
        Where their photons end.
    region : TargetRegion
    viewers : Viewers
    specular_alone : bool
        Photons end where smooth gloss and glass do not send them on, and none is stored.
    """

    key: np.uint64
    keeps: np.ndarray
    seen: np.ndarray
    source_seen: np.ndarray
    sampled_directly: np.ndarray
    last_bounce: np.ndarray
    region: TargetRegion
    viewers: Viewers
    specular_alone: bool


@by_reference
class HitArrays(NamedTuple):
    """Those of `Hits` that kernels need."""

    triangle: np.ndarray
    distance: np.ndarray
    u: np.ndarray
    v: np.ndarray


@kernel
def meet_surfaces(tracing, room, rules, bounce, front, n, hits, rows, n_stored):
    """Store the n photons of a front where they meet surfaces, and scatter them.

    Survivors move to the start of the front. Returns how many they are, and how many photons are stored.
    """
    n_alive, scene = 0, tracing.scene
    for k in range(n):
        photon = photon_at(front, k)
        if hits.triangle[k] < 0 or photon.power == BLACK:
            continue
        hit = hit_at(scene, photon.direction, hits.triangle[k], hits.distance[k], hits.u[k], hits.v[k])
        order = max(bounce, 1) if photon.dispersed else bounce
        is_wanted = order > 0 or not rules.sampled_directly[photon.source]
        is_wanted &= reflects_to(rules.viewers, photon.kind)
        if is_wanted and not rules.specular_alone and (photon.specular or rules.keeps[scene.material[hit.triangle]]):
            store(rows, n_stored, hit, photon, order)
            n_stored += 1
        if bounce < rules.last_bounce[photon.source]:
            alive, photon = scattered(tracing, room, rules, bounce, photon, hit)
            if alive:
                put_photon(front, n_alive, photon)
                n_alive += 1
    return n_alive, n_stored


@part
def scattered(tracing, room, rules, bounce, photon, hit):
    """Whether a photon survives the surface that it met, and how it flies on."""
    i, scene = _PAIRS * bounce, tracing.scene
    choice, u = two_numbers(rules.key, photon.path, i)
    v, fate = two_numbers(rules.key, photon.path, i + 1)
    seen, chance = next_viewer(rules.viewers, photon.kind, two_numbers(rules.key, photon.path, i + 3)[1])
    lobes = rules.viewers.lobes[photon.kind]
    on = scatter(scene, hit, photon.direction, choice, u, v, lobes, True, seen)
    if rules.specular_alone and (on.rough or not on.specular):
        return False, photon
    if on.lobe == SUBSURFACE and on.alive:
        on = through_body(tracing, room, hit, on, seen, walk_key(rules.key, bounce), photon.path)
    straight = bounce == 0 and not photon.dispersed
    lit_by_points = straight and rules.sampled_directly[photon.source]
    if lit_by_points and not is_way_of_lamplight(rules.viewers, photon.kind, on.specular):
        return False, photon
    left = times(on.weight, on.lamplight) if lit_by_points else on.weight

    # Russian roulette, so that no photon gains power. Seen from the receivers, a lobe is where a ray of its kind starts
    # that has to see where the photon came from
    survival = min(largest(left), ONE)
    by_object = photon.came_from >= 0
    shows = rules.seen[on.kind, photon.came_from] if by_object else rules.source_seen[on.kind, photon.source]
    if not on.alive or fate >= survival or not shows:
        return False, photon
    direction, ratio, weight = on.direction, ONE, times(left, ONE / (survival * chance))
    if on.lobe < _GLOSSY and is_directed(rules.region, photon.gained, hit.position):
        up = hit.normal if dot(direction, hit.normal) > ZERO else negative(hit.normal)
        choice, u = two_numbers(rules.key, photon.path, i + 2)
        v, _ = two_numbers(rules.key, photon.path, i + 3)
        direction, ratio = directed(rules.region, hit.position, up, direction, choice, u, v)

    # A caustic starts where photons find the light better, and ends after the first surface that scatters broadly
    specular = on.specular and rules.sampled_directly[photon.source] if straight else photon.specular
    return ratio > ZERO, Photon(
        on.origin,
        direction,
        mul(photon.power, times(weight, ratio)),
        photon.path_density * survival,
        photon.gained * ratio,
        specular and NARROW_LOBES >> on.lobe & 1 > 0,
        photon.dispersed,
        scene.object[hit.triangle],
        photon.path,
        photon.source,
        np.uint8(seen),
    )


Watch = Callable[[int, Front, int, Hits], None]
"""Is told of the n photons of a front before they scatter: the bounce, the front, n, and where they are stopped."""


@dataclass(frozen=True)
class PhotonFlight:
    """How photons fly through a scene, from their sources to where they are absorbed, gone, or at their last bounce."""

    scene: Scene
    tracer: TransparencyTracer
    linking: LightLinking
    max_bounces: int
    rules: Rules
    seed: int
    of: Pass
    log: FlightLog | None = None

    def fly(self, front: Front, batch: int = 0, watch: Watch | None = None) -> Photons:
        """The photons that are stored of a front that was just emitted."""
        n, stored, room = len(front.path), PhotonStore(), new_ray()
        for bounce in range(self.max_bounces):
            if n == 0:
                break
            hits = self._first_hits(front) if bounce == 0 else self._hits(front, n, batch)
            if watch is not None:
                watch(bounce, front, n, hits)
            at = HitArrays(hits.triangle, hits.distance, hits.u, hits.v)
            if self.tracer.arrays.media.any and not self.rules.specular_alone:
                pass_media(self.tracer.arrays, room, self.rules.key, bounce, front, n, at)
            rows = stored.rows(n)
            met = self.rules, bounce, front, n, at, rows, stored.n
            n, stored.n = meet_surfaces(self.tracer.arrays, room, *met)
        return stored.photons()

    def _first_hits(self, front: Front) -> Hits:
        viewers, n = self.rules.viewers, len(front.path)
        numbers = PathNumbers(self.seed, self.of.value[1], _LINKING)
        if viewers.in_shadow:
            choose_first_viewers(viewers, self.rules.key, self.rules.sampled_directly, front, n)
        return emission_segment(self.scene, self.tracer, self.linking, front, numbers)

    def _hits(self, front: Front, n: int, batch: int) -> Hits:
        origin, direction, power = front.origin[:n], front.direction[:n], front.power[:n]
        hits = self.tracer.closest_hit(origin, direction, photons_to=front.kind[:n])
        if self.log is not None:
            flights = Flights(origin, direction, hits.distance, power, front.specular[:n])
            received = which_reflect_to(self.rules.viewers, front.kind[:n])
            self.log.take(batch, flights if received.all() else flights.where(received))
        if hits.tint is not None:
            np.multiply(power, hits.tint, out=power)
        return hits


def trace_photons(
    scene: Scene,
    tracer: TransparencyTracer,
    sources: Sequence[Source],
    n_photons: int,
    max_bounces: int,
    workers: Workers,
    in_pictures: bool = False,
    region: Sphere | None = None,
    on_gloss: bool = False,
    of: Pass = Pass.PHOTONS,
    log: FlightLog | None = None,
) -> Photons:
    """Photons that met surfaces with a diffuse or translucent lobe, and caustics on all surfaces.

    Where photons are scattered, Russian roulette absorbs some.

    Direct hits (`PathKind.DIRECT`) of sources that are sampled directly are not stored.

    Parameters
    ----------
    sources : sequence of Source
        From `light_sources`.
    n_photons : int
        Emitted by all sources together.
    max_bounces : int
        Surfaces that a photon may hit.
    in_pictures : bool
        Emit photons through the pixels of each source's bounce map, of which there may be a few more.
    region : Sphere, optional
        Where light is wanted: half of what is scattered outside of it is directed there.
    on_gloss : bool
        Store those as well that met surfaces with other lobes alone.
    of : Pass
    log : FlightLog, optional
        Takes down photons' flights from the first surface on.

    Returns
    -------
    Photons
        The same for a seed whatever the number of threads.
    """
    workers.progress.update("Tracing photons", 0.0)
    if not sources:
        return Photons.none()
    counts = shares(sources, n_photons)
    emission = Emission(sources, counts, workers.seed, of)
    if in_pictures:
        emission = PictureEmission(picture_rays(sources, counts, workers.seed))
    rules = _rules(scene, sources, max_bounces, path_key(workers.seed, of.value[1]), region, on_gloss)
    linking = LightLinking.of(scene, sources)
    flight = PhotonFlight(scene, tracer, linking, max_bounces, rules, workers.seed, of, log)

    def batch(paths: slice) -> tuple[slice, Photons]:
        front = new_front(paths.stop - paths.start)
        emission.start(front, paths)
        return paths, flight.fly(front, paths.start)

    stored = PhotonStore()
    for paths, photons in workers.map(batch, slices(emission.n, CHUNK)):
        stored.add(photons, paths.stop / emission.n)
        workers.progress.update("Tracing photons", paths.stop / emission.n)
    return stored.photons()


def _rules(
    scene: Scene, sources: Sequence[Source], max_bounces: int, key: np.uint64, region: Sphere | None, on_gloss: bool
) -> Rules:
    """What decides on the photons of `trace_photons`."""
    last = [min(source.max_bounces, max_bounces - 1) for source in sources]
    return Rules(
        key=key,
        keeps=scene.materials.spreads_light | on_gloss,
        seen=np.stack([seen_by(scene.objects, kind) for kind in RayKind]),
        source_seen=np.array([[source.seen_by(kind) for source in sources] for kind in RayKind]),
        sampled_directly=np.array([source.sampled_directly for source in sources]),
        last_bounce=np.array(last, np.int32),
        region=target_region(region),
        viewers=viewers_of(scene.materials),
        specular_alone=False,
    )


def specular_flight(
    scene: Scene, tracer: TransparencyTracer, sources: Sequence[Source], max_bounces: int, seed: int, of: Pass
) -> PhotonFlight:
    """Photons that fly on over smooth gloss and through glass alone; none is stored, who watches takes them."""
    rules = _rules(scene, sources, max_bounces, path_key(seed, of.value[1]), None, False)
    every = np.ones(len(sources), np.bool_)  # what gather rays find of others ends where live light's links do
    rules = rules._replace(sampled_directly=every, specular_alone=True)
    return PhotonFlight(scene, tracer, LightLinking.of(scene, sources), max_bounces, rules, seed, of)


def bounces_left(sources: Sequence[Source], n_photons: int, photons: Photons) -> np.ndarray | None:
    """How many surfaces further photons of `trace_photons` may be seen, (p,) int; None if all sources' are unlimited.

    Light that falls on a receiver has left none of its `max_bounces` behind, and at the b-th surface after the first
    it has left b.
    """
    limits = np.array([source.max_bounces for source in sources])
    if (limits >= ALL_BOUNCES).all():
        return None
    left: np.ndarray = np.repeat(limits, shares(sources, n_photons))[photons.path] - photons.bounce
    return left
