"""The state of a bake between its stages: what a caller can keep, look into, and gather from again.

`Setup` is what all lights have in common; a `Solution` is one light in it. What a stage made stays: photons, and the
radiance cache once rays have asked for it. So a second output, other receivers, or points that a refined mesh adds are
gathered by the same photons and cache.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..core.inspector import Inspector
from ..core.parallel import Workers
from ..emitters import Source, Sphere
from ..gather import DirectLight, GatherRays, ImportancePilot, Irradiance, MidAir, build_radiance_cache
from ..photons import Photons
from ..receivers import Receivers
from ..scene import Scene
from ..settings.bake import BakeSettings
from ..tracing import TransparencyTracer


@dataclass(frozen=True)
class Setup:
    """What has no light in it yet.

    Attributes
    ----------
    scene : Scene
    receivers : Receivers
        At least one.
    tracer : TransparencyTracer
        What receivers look with.
    photon_tracer : TransparencyTracer
        What photons are traced with.
    region : Sphere
        Around most receivers.
    pilot : ImportancePilot or None
        Of the surfaces that gather rays see; None where no rays are sent.
    deadline : float, s
        By `time.perf_counter`, of the final gather.
    """

    scene: Scene
    receivers: Receivers
    settings: BakeSettings
    tracer: TransparencyTracer
    photon_tracer: TransparencyTracer
    region: Sphere
    pilot: ImportancePilot | None
    deadline: float
    inspector: Inspector

    def lit_by(self, scene: Scene) -> "Setup":
        """The same for a scene with a part of the lights."""
        return replace(self, tracer=self.tracer.lit_by(scene), photon_tracer=self.photon_tracer.lit_by(scene))


@dataclass(frozen=True)
class Solution:
    """Light in a scene, to be gathered.

    Attributes
    ----------
    setup : Setup
    scene : Scene
        The setup's as it is lit: by all its lights, or by those of one light group.
    receivers : Receivers
        The setup's, or others that are gathered for.
    settings : BakeSettings
        The setup's, with as many photons as the time allowed.
    sources : list of Source
        What gives light.
    photons : Photons
    bounces_left : (p,) int or None
        How many surfaces further each photon may be seen; None without lamps that limit it.
    noise : float, W/m²
        Standard error of what photons bring to the receivers' mean, where rays gather.
    direct : DirectLight
    mid_air : MidAir or None
        The receivers that lie on no surface, and what flies past them; None without any.
    """

    setup: Setup
    scene: Scene
    receivers: Receivers
    settings: BakeSettings
    sources: list[Source]
    photons: Photons
    bounces_left: np.ndarray | None
    noise: float
    direct: DirectLight
    mid_air: MidAir | None
    workers: Workers

    @property
    def tracer(self) -> TransparencyTracer:
        """What receivers look with."""
        return self.setup.tracer

    @property
    def dark(self) -> bool:
        """Whether nothing in the scene gives light."""
        return not self.sources

    def at(self, receivers: Receivers) -> "Solution":
        """The same light, to be gathered at the first of the receivers alone, which are given."""
        mid_air = self.mid_air.of_first(len(receivers)) if self.mid_air else None
        return replace(self, receivers=receivers, mid_air=mid_air)

    def irradiance(self) -> Irradiance:
        """The light at the receivers."""
        from .gathers import irradiances  # here: it gathers from solutions

        return irradiances([self], self.workers)[0]

    def gather(self, receivers: Receivers) -> Irradiance:
        """The light at other receivers (at least one) on the same surfaces, by the same photons and cache.

        The progress is not told of it, so it is for parts of a stage.

        Raises
        ------
        Cancelled
            If the bake's progress was cancelled.
        """
        rays, quiet = self.rays, replace(self.workers, progress=self.workers.progress.quiet())
        other = replace(self, receivers=receivers, mid_air=None, workers=quiet)
        other.__dict__["rays"] = rays
        return other.irradiance()

    @cached_property
    def rays(self) -> GatherRays | None:
        """Rays that gather from a radiance cache, which is made when they are first asked for; None without pilot."""
        if self.setup.pilot is None:
            return None
        if self.bounces_left is None:
            return self._rays(self.photons, self.direct, self.workers)
        # What is seen over a surface more may be without some lamps; over more of them it is taken for the same
        rays = None
        for n_surfaces, workers in ((2, self.workers.part(0.0, 0.5)), (1, self.workers.part(0.5, 1.0))):
            lamps = [source for source in self.sources if source.max_bounces >= n_surfaces]
            photons = self.photons.where(self.bounces_left >= n_surfaces)
            rays = self._rays(photons, DirectLight(self.scene, self.tracer, lamps), workers, rays)
        return rays

    def must_gather(self) -> GatherRays:
        """`rays`, where the settings were found to need them."""
        assert self.rays is not None
        return self.rays

    def _rays(
        self, photons: Photons, direct: DirectLight, workers: Workers, beyond: GatherRays | None = None
    ) -> GatherRays:
        """Rays that gather what some photons and some lamps bring."""
        pilot = self.setup.pilot
        assert pilot is not None
        n_rays = self.settings.n_cache_rays if beyond or self.bounces_left is None else 0
        cache = build_radiance_cache(self.scene, self.tracer, photons, direct, pilot, n_rays, workers, beyond)
        return GatherRays(self.scene, self.tracer, direct, cache, beyond)
