"""By which kind of rays photons are going to be seen, where surfaces look otherwise to some kinds.

A ray of a path tracer goes from a point X₀ to a surface X₁, and sees it and what it passes on the way as rays of its
kind do, which a lobe at X₀ has sent. A photon flies from X₁ to X₀ and knows that lobe only once it is there. So it
chooses the kind before it leaves X₁, its power divided by the chance of that, and at X₀ only the lobes that send such
rays may scatter it. What points of a lamp are asked for is seen by shadow rays; mirrors, glass and narrow gloss leave
that light to photons, and their own rays see what it passes.
"""

from typing import NamedTuple

import numpy as np

from ..bsdf.mixture import ALL_LOBES, DIFFUSE, GLOSSY_LOBES, NARROW_LOBES
from ..core.compiling import kernel, part
from ..core.sampling.path_numbers import two_numbers
from ..core.vec3 import ONE, put, row, times
from ..scene import Materials, RayKind

_DIFFUSE, _GLOSSY, _TRANSMITTED, _SHADOW, *_ = (int(kind) for kind in RayKind)
_FIRST = 1 << 15  # of a path's pairs of numbers, the one that chooses for the way from the source
_HALF, _TWO = np.float32(0.5), np.float32(2)
_BY_DIFFUSE, _BY_GLOSSY = np.float32(0.8), np.float32(0.1)  # chances, but of photons in glass that are to get out of it
_BEHIND_GLASS = np.float32(0.5)


class Viewers(NamedTuple):
    """What photons may choose.

    Attributes
    ----------
    by_lobe : bool
        Whether rays of one lobe see some surface otherwise than those of another.
    in_shadow : bool
        Whether shadow rays do, or `by_lobe`.
    lobes : (6,) int64
        Those that send rays of a kind (`RayKind`), as bits; all where `by_lobe` is false.
    """

    by_lobe: bool
    in_shadow: bool
    lobes: np.ndarray


def viewers_of(materials: Materials) -> Viewers:
    """The viewers of a scene's materials."""
    lobes, by_lobe = np.full(len(RayKind), ALL_LOBES, np.int64), materials.differs_by_lobe
    if by_lobe:
        lobes[_GLOSSY], lobes[_TRANSMITTED] = GLOSSY_LOBES, NARROW_LOBES & ~GLOSSY_LOBES
        lobes[_DIFFUSE] = ALL_LOBES & ~NARROW_LOBES
    return Viewers(by_lobe, by_lobe or materials.differs_in_shadow, lobes)


@part
def next_viewer(viewers, kind, choice):
    """A `RayKind` for what scatters a photon that came by another, and its chance."""
    if not viewers.by_lobe:
        return _DIFFUSE, ONE
    by_diffuse = _BEHIND_GLASS if kind == _TRANSMITTED else _BY_DIFFUSE
    if choice < by_diffuse:
        return _DIFFUSE, by_diffuse
    if choice < by_diffuse + _BY_GLOSSY:
        return _GLOSSY, _BY_GLOSSY
    return _TRANSMITTED, ONE - by_diffuse - _BY_GLOSSY


@part
def _first_viewer(viewers, sampled_directly, choice):
    """A `RayKind` for the way from a source, and its chance."""
    if not sampled_directly:
        return next_viewer(viewers, _DIFFUSE, choice)
    if choice < _HALF:
        return _SHADOW, _HALF
    if viewers.by_lobe and _TWO * choice - ONE < _HALF:
        return _GLOSSY, _HALF * _HALF
    return _TRANSMITTED, _HALF * _HALF if viewers.by_lobe else _HALF


@kernel
def choose_first_viewers(viewers, key, sampled_directly, front, n):
    """Choose for n photons that start from their sources; of (s,) of these points are sampled."""
    for k in range(n):
        choice, _ = two_numbers(key, front.path[k], _FIRST)
        front.kind[k], chance = _first_viewer(viewers, sampled_directly[front.source[k]], choice)
        put(front.power, k, times(row(front.power, k), ONE / chance))


@part
def is_way_of_lamplight(viewers, kind, specular):
    """Whether a lobe scatters a photon straight from a source that is sampled directly, which came as a kind of ray.

    Where shadow rays see other surfaces than other rays do, they find what is not specular, and rays that follow the
    lobe find what is.
    """
    return not viewers.in_shadow or specular == (kind != _SHADOW)


@part
def reflects_to(viewers, kind):
    """Whether a surface that a photon came to by a kind may reflect it diffusely."""
    return viewers.lobes[kind] >> DIFFUSE & 1 == 1


def which_reflect_to(viewers: Viewers, kinds: np.ndarray) -> np.ndarray:
    """`reflects_to` of n photons, (n,) bool; receivers are such surfaces, in mid-air too."""
    return viewers.lobes[kinds] >> DIFFUSE & 1 == 1
