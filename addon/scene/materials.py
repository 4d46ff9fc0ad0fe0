"""What surfaces do to light: what they emit and let through, and the closures that their scattering is a sum of."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .closures import BROAD, LAMBERTIAN, NARROW, Closures, Lobe, closures_of_lobes
from .ray_kinds import RayKind
from .textures import Channel, Textures

N_VIEWS = 2 * len(RayKind)
"""Kinds of rays, each from both sides."""


@dataclass(frozen=True)
class Materials:
    """The m materials of a scene; all surfaces have two sides.

    A material that differs by side, or by the kind of ray that sees it, has further rows. Triangles have the number of
    the one that diffuse rays see from the front, and `seen_as` says which row stands for it; what is known of a
    triangle's material (`has`, `matte` and so on) is of all of them.

    Light that meets a material passes straight through with the probability 1 − `coverage`, tinted; emission and
    closures are of the light that does not.

    Attributes
    ----------
    names : tuple of str
        Names for messages.
    closures : Closures
        What scatters light; they add up.
    emission : Channel, W/(m² sr)
        Emitted radiance, the same in every direction; below 0 where light is taken away.
    coverage : Channel, scalar in [0, 1]
        Share of the light that does not pass straight through.
    tint : Channel
        Colour of the light that passes straight through.
    textures : Textures
    seen_as : (m, 12) int32
        The row that stands for each where rays of kind k (`RayKind`) see its front, column 2 k, and its back, 2 k + 1.
    one_sided : (m,) bool
        Whether surfaces are not there for rays that come to their back, as those of hair and points are not.
    """

    names: tuple[str, ...]
    closures: Closures
    emission: Channel
    coverage: Channel
    tint: Channel
    textures: Textures
    seen_as: np.ndarray
    one_sided: np.ndarray

    def __len__(self) -> int:
        return len(self.names)

    def has(self, *lobes: Lobe) -> np.ndarray:
        """Which materials have a closure of one of some kinds, (m,) bool."""
        return self.of_any_view(self.closures.count(*lobes) > 0)

    def of_any_view(self, rows: np.ndarray) -> np.ndarray:
        """What is true of one of the rows that stand for a material, (m,) bool."""
        return rows[self.seen_as].any(axis=1)

    @cached_property
    def emits(self) -> np.ndarray:
        """Which materials emit light that diffuse rays see, (m,) bool."""
        return self.emission.nonzero[self.seen_as[:, :2]].any(axis=1)

    @cached_property
    def emits_unsampled(self) -> np.ndarray:
        """Which materials emit light that other rays see and diffuse rays do not, (m,) bool: no source has it."""
        return self.of_any_view(self.emission.nonzero) & ~self.emits

    @cached_property
    def two_faced(self) -> np.ndarray:
        """Which materials differ by side, (m,) bool."""
        return (self.seen_as[:, ::2] != self.seen_as[:, 1::2]).any(axis=1)

    @cached_property
    def differs_by_kind(self) -> np.ndarray:
        """Which materials some kind of rays sees otherwise than diffuse rays do, (m,) bool."""
        sides = self.seen_as.reshape(len(self), -1, 2)
        return (sides != sides[:, [RayKind.DIFFUSE]]).any(axis=(1, 2))

    @cached_property
    def differs_in_shadow(self) -> bool:
        """Whether shadow rays see any material otherwise than diffuse rays do."""
        return self._differs(RayKind.SHADOW)

    @cached_property
    def differs_by_lobe(self) -> bool:
        """Whether rays that one lobe sends see any material otherwise than those of another lobe."""
        return self._differs(RayKind.GLOSSY) or self._differs(RayKind.TRANSMITTED)

    def _differs(self, kind: RayKind) -> bool:
        """Whether rays of a kind see any material otherwise than diffuse rays do."""
        sides = self.seen_as.reshape(len(self), -1, 2)
        return bool((sides[:, kind] != sides[:, RayKind.DIFFUSE]).any())

    @cached_property
    def matte(self) -> np.ndarray:
        """Which materials have no closure but diffuse ones that look the same from all angles, (m,) bool."""
        return ~(self.has(Lobe.TRANSLUCENT) | self.directional)

    @cached_property
    def directional(self) -> np.ndarray:
        """Which materials look otherwise from other angles, (m,) bool: not Lambertian, or weighed by the angle."""
        closures = self.closures
        curved = np.bincount(closures.material[closures.angles.of_closure >= 0], minlength=len(self)) > 0
        return self.has(*(lobe for lobe in Lobe if lobe not in LAMBERTIAN)) | self.of_any_view(curved)

    @cached_property
    def narrow(self) -> np.ndarray:
        """Which materials have a closure that rays follow, glossy or glass, (m,) bool."""
        return self.has(*NARROW)

    @cached_property
    def broad(self) -> np.ndarray:
        """Which materials have a closure that is broad and not Lambertian, (m,) bool."""
        return self.has(*BROAD)

    @cached_property
    def spreads_light(self) -> np.ndarray:
        """Which materials scatter light widely, to either of their sides, (m,) bool: photons are stored on those."""
        return self.has(*LAMBERTIAN, *BROAD, Lobe.SUBSURFACE)

    @cached_property
    def subsurface(self) -> np.ndarray:
        """Which materials have a closure through which light walks, (m,) bool."""
        return self.has(Lobe.SUBSURFACE)

    @cached_property
    def perturbed(self) -> np.ndarray:
        """Which materials have a closure with a normal or a tangent of its own, (m,) bool."""
        of = self.closures.material[(self.closures.normal_space >= 0) | self.closures.stretched]
        return self.of_any_view(np.bincount(of, minlength=len(self)) > 0)

    @cached_property
    def see_through(self) -> np.ndarray:
        """Which materials let light pass straight through somewhere, or from behind, (m,) bool."""
        return self.of_any_view((self.coverage.texture >= 0) | (self.coverage.value[:, 0] < 1)) | self.one_sided

    @staticmethod
    def of(m: int, textures: Textures | None = None, closures: Closures | None = None, **columns: Any) -> "Materials":
        """The m materials that `columns` say; what they leave out is black and opaque.

        Parameters
        ----------
        closures : Closures, optional
            Without them there are at most one of each kind, by those columns that `closures_of_lobes` takes.
        """
        ones = np.ones(m, np.float32)
        default = {
            "names": tuple(f"Material {i}" for i in range(m)),
            "emission": Channel.constant(np.zeros(m)),
            "coverage": Channel.constant(ones),
            "tint": Channel.constant(ones),
            "seen_as": np.repeat(np.arange(m, dtype=np.int32)[:, None], N_VIEWS, axis=1),
            "one_sided": np.zeros(m, bool),
        }
        own = {name: columns.pop(name, value) for name, value in default.items()}
        closures = closures or closures_of_lobes(m, **columns)
        return Materials(**own, closures=closures, textures=textures or Textures.pack([]))

    @staticmethod
    def matte_of(albedo: np.ndarray, emission: np.ndarray | None = None) -> "Materials":
        """Untextured Lambertian materials of (m, 3) albedos and, where given, (m, 3) emitted radiances."""
        albedo = np.asarray(albedo, np.float32).reshape(-1, 3)
        glow = np.zeros_like(albedo) if emission is None else np.asarray(emission, np.float32)
        return Materials.of(len(albedo), diffuse=Channel.constant(albedo), emission=Channel.constant(glow))
