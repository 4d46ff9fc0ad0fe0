"""Light scattered at surfaces: directions sampled lobe by lobe, and the glossy lobe evaluated.

The local frame has as +z the normal of the side that the light came to; wo (n, 3) is where it came from, so wo.z > 0.
Transmitted directions have wi.z < 0.

Paths and photons follow the same f(view, light), the one from the view, the other from the light. All of f is
reciprocal but for the factors that belong to the viewing side: what the layer leaves to the diffuse lobe, the scale of
multiple scattering, and how refraction changes radiance. A photon views from where it goes, so they are taken there.
"""

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from ..core.sampling.vectors import dot, largest
from ..core.sampling.warps import sample_cosine_hemisphere
from .albedo import base_share, glass_scale, glossy_albedo, glossy_scale
from .fresnel import fresnel_dielectric, grazing_share
from .lobes import ALL, Lobe
from .microfacets import MIN_COS, distribution, masked, reflect, refract, sample_visible_normals, unshadowed
from .surface import Surface

SMOOTH = 0.1
"""Roughness below which a glossy lobe is a mirror to those who look for lamps: only photons find them there."""

PEAK = np.float32(1)
"""Value of a glossy lobe, 1/sr, from which on light is left to photons in any case: three times what white paper has.

Few rays meet such highlights, and they are bright: in a room with sunlit metal and lacquer a bound of 10 leaves little
more of the light to rays, and most of their variance comes from that.
"""


@dataclass(frozen=True)
class Sample:
    """Scattered directions.

    Attributes
    ----------
    wi : (n, 3) float32
    weight : (n, 3) float32
        f |cos wi| / (density of wi · probability of its lobe); 0 where nothing is scattered.
    lobe : (n,) uint8
        The `Lobe` that scattered.
    """

    wi: np.ndarray
    weight: np.ndarray
    lobe: np.ndarray


def is_focused(surface: Surface, lobe: np.ndarray, view: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Whether lamplight from `light` to `view` over a lobe is left to photons, (n,) bool.

    It is for glass and for the peaks of gloss. The rest, `evaluate_wide`, is for shadow rays: each way of the light is
    found once, by those who find it better.

    Parameters
    ----------
    lobe : (n,) uint8
        `Lobe` that scattered.
    view, light : (n, 3) float32
        Local directions away from the surface.
    """
    glossy = lobe == Lobe.GLOSSY
    focused = (lobe == Lobe.GLASS) | (glossy & (surface.roughness < SMOOTH))
    k = np.flatnonzero(glossy & ~focused)
    focused[k] = largest(evaluate_glossy(surface.where(k), view[k], light[k])) >= PEAK
    return focused


def evaluate_wide(surface: Surface, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """As `evaluate_glossy`, and 0 where it is left to photons."""
    f = evaluate_glossy(surface, wo, wi)
    return np.where((largest(f) < PEAK)[:, None], f, np.float32(0))


def evaluate_glossy(surface: Surface, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """The glossy lobe's f in 1/sr, without the cosine, (n, 3); wo is the viewing side. 0 where it is smooth.

    Walter et al. 2007, equation 20.
    """
    h, alpha, seen = _half_vectors(surface, wo, wi)
    cos_o, cos_i = np.maximum(wo[:, 2], MIN_COS), np.maximum(wi[:, 2], MIN_COS)
    shape = distribution(h, alpha) / ((masked(cos_o, alpha) + masked(cos_i, alpha) - 1) * (4 * cos_o * cos_i))
    f = _glossy_fresnel(surface, dot(wo, h)) * glossy_scale(surface, cos_o) * shape[:, None]
    return np.where(seen[:, None], f, np.float32(0))


def pdf_glossy(surface: Surface, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """Density of wi by solid angle when the glossy lobe is sampled from wo, (n,); 0 where it is smooth.

    Some samples are shadowed by the surface, so that it integrates to less than 1.
    """
    h, alpha, seen = _half_vectors(surface, wo, wi)
    cos = np.maximum(wo[:, 2], MIN_COS)
    return np.where(seen, distribution(h, alpha) / (4 * cos * masked(cos, alpha)), np.float32(0))


def sample_bsdf(
    surface: Surface, wo: np.ndarray, u: np.ndarray, lobes: tuple[Lobe, ...] = ALL, from_light: bool = False
) -> Sample:
    """One direction for each point, of one of its lobes.

    Parameters
    ----------
    wo : (n, 3) float32
        Where the light came from, or with `from_light` false the viewing side.
    u : (n, 3) float32 in [0, 1)
        One number to choose the lobe, two for the direction.
    lobes : tuple of Lobe
        Those that may be chosen.
    from_light : bool
        Whether a photon is scattered rather than a path.
    """
    albedo = [_albedo(surface, wo[:, 2], lobe, from_light) for lobe in lobes]
    upper = list(accumulate(albedo))
    at = u[:, 0] * upper[-1]
    index = np.zeros(len(wo), np.uint8)
    for bound in upper[:-1]:
        index += at >= bound

    wi, weight = np.zeros_like(wo), np.zeros_like(wo)
    wi[:, 2] = 1
    for i, lobe in enumerate(lobes):
        chosen = (index == i) & (albedo[i] > 0)
        k = slice(None) if chosen.all() else np.flatnonzero(chosen)  # the common case is spared the copies
        if not chosen.any():
            continue
        probability = albedo[i][k] / upper[-1][k]
        rest = np.clip(1 - (upper[i][k] - at[k]) / albedo[i][k], 0, 1)  # the first number, fresh again
        wi[k], weight_k = _SAMPLERS[lobe](surface.where(k), wo[k], u[k, 1:], rest, from_light)
        weight[k] = weight_k / probability[:, None]
    return Sample(wi, weight, np.array(lobes, np.uint8)[index])


def _albedo(surface: Surface, cos: np.ndarray, lobe: Lobe, from_light: bool) -> np.ndarray:
    """What a lobe scatters of light from a direction, about, (n,); above 0 wherever it scatters any."""
    if lobe == Lobe.DIFFUSE:
        # What the layer leaves of a photon is not known before its direction is
        return _mean(surface.diffuse) * (np.float32(1) if from_light else base_share(surface, cos))
    if lobe == Lobe.TRANSLUCENT:
        return _mean(surface.translucent)
    if lobe == Lobe.GLOSSY:
        return _mean(glossy_albedo(surface, cos))
    if not (surface.glass_reflection.any() or surface.glass_transmission.any()):
        return np.zeros_like(cos)
    # A rough surface also does what a smooth one would not
    fresnel = np.clip(fresnel_dielectric(cos, surface.glass_ior), 0.05, 0.95) * surface.glass_fresnel
    transmitted = (1 - fresnel) * _radiance_scale(surface.glass_ior, from_light)
    return fresnel * _mean(surface.glass_reflection) + transmitted * _mean(surface.glass_transmission)


def _sample_diffuse(
    surface: Surface, wo: np.ndarray, u: np.ndarray, _: np.ndarray, from_light: bool
) -> tuple[np.ndarray, np.ndarray]:
    wi = sample_cosine_hemisphere(u)
    view = wi if from_light else wo
    return wi, surface.diffuse * base_share(surface, view[:, 2])[:, None]


def _sample_translucent(
    surface: Surface, wo: np.ndarray, u: np.ndarray, _: np.ndarray, from_light: bool
) -> tuple[np.ndarray, np.ndarray]:
    return -sample_cosine_hemisphere(u), surface.translucent


def _sample_glossy(
    surface: Surface, wo: np.ndarray, u: np.ndarray, _: np.ndarray, from_light: bool
) -> tuple[np.ndarray, np.ndarray]:
    """By visible normals, so that of f |cos| / density only F G₂/G₁ is left: Heitz 2018, equation 19."""
    alpha = surface.roughness * surface.roughness
    h = sample_visible_normals(wo, alpha, u)
    cos = dot(wo, h)
    wi = reflect(wo, h, cos)
    view = wi if from_light else wo
    weight = _glossy_fresnel(surface, cos) * glossy_scale(surface, np.maximum(view[:, 2], 0))
    weight *= (unshadowed(wo[:, 2], wi[:, 2], alpha) * (wi[:, 2] > 0))[:, None]
    return wi, weight


def _sample_glass(
    surface: Surface, wo: np.ndarray, u: np.ndarray, choice: np.ndarray, from_light: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Reflection or refraction at visible normals, chosen by what each scatters, (n, 3) each."""
    facets = _glass_facets(surface, wo, u)
    up = facets.reflected * _mean(surface.glass_reflection)
    down = facets.transmitted * _mean(surface.glass_transmission) * _radiance_scale(surface.glass_ior, from_light)
    total = up + down
    back = choice * total < up
    wi, weight = _glass_way(surface, wo, facets, back, from_light)
    probability = np.where(back, up, down) / np.maximum(total, 1e-20)
    return wi, weight / np.maximum(probability, 1e-20)[:, None]


def glass_ways(surface: Surface, wo: np.ndarray, u: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """What glass reflects of a path, and what it refracts: directions (n, 3), and the weights of both (n, 3).

    Parameters
    ----------
    wo : (n, 3) float32
        The viewing side.
    u : (n, 2) float32 in [0, 1)
        For the facets of what is not quite smooth.
    """
    facets = _glass_facets(surface, wo, u)
    return [_glass_way(surface, wo, facets, np.full(len(wo), back), False) for back in (True, False)]


@dataclass(frozen=True)
class _Facets:
    """Normals (n, 3) of facets of glass, the cosines to the viewing side (n,), and the shares of light (n,)."""

    h: np.ndarray
    cos: np.ndarray
    reflected: np.ndarray
    transmitted: np.ndarray


def _glass_facets(surface: Surface, wo: np.ndarray, u: np.ndarray) -> _Facets:
    """Facets that are seen from wo."""
    h = sample_visible_normals(wo, surface.roughness * surface.roughness, u)
    cos = dot(wo, h)
    fresnel = fresnel_dielectric(cos, surface.glass_ior)
    transmitted = np.where(surface.glass_fresnel, 1 - fresnel, fresnel < 1)
    return _Facets(h, cos, np.where(surface.glass_fresnel, fresnel, 0), transmitted)


def _glass_way(
    surface: Surface, wo: np.ndarray, facets: _Facets, back: np.ndarray, from_light: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Where light goes that facets reflect, where `back` (n,) is, or refract; and its weight, (n, 3) each.

    The density of both has the same factors as f: Walter et al. 2007, equations 17, 20, 21. Radiance is not scaled by
    η² at an interface, as Cycles does not: f of the refraction is Walter's times (η_light/η_view)², by which a path's
    weight is T G₂/G₁. Walter's f obeys f(o→i)/η_i² = f(i→o)/η_o² (Veach, "Robust Monte Carlo Methods for Light
    Transport Simulation", 1997, section 5.2), by which a photon's weight with Walter's f would be T G₂/G₁, and with
    this one is T G₂/G₁ (η_light/η_view)².
    """
    alpha, ior = surface.roughness * surface.roughness, surface.glass_ior
    h, cos = facets.h, facets.cos
    wi = np.where(back[:, None], reflect(wo, h, cos), refract(wo, h, cos, ior))
    share = np.where(back, facets.reflected, facets.transmitted * _radiance_scale(ior, from_light))
    share = share * unshadowed(wo[:, 2], wi[:, 2], alpha) * ((wi[:, 2] > 0) == back)
    color = np.where(back[:, None], surface.glass_reflection, surface.glass_transmission)
    view_ior = np.where(back, ior, 1 / ior) if from_light else ior
    view = np.abs(wi[:, 2]) if from_light else wo[:, 2]
    return wi, color * share[:, None] * glass_scale(surface, view, view_ior)


_SAMPLERS = {
    Lobe.DIFFUSE: _sample_diffuse,
    Lobe.TRANSLUCENT: _sample_translucent,
    Lobe.GLOSSY: _sample_glossy,
    Lobe.GLASS: _sample_glass,
}


def _glossy_fresnel(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """Reflectance of the glossy lobe's facets at `cos` to their normal, (n, 3)."""
    return surface.f0 + (surface.f90 - surface.f0) * grazing_share(cos, surface.fresnel_ior)[:, None]


def _half_vectors(surface: Surface, wo: np.ndarray, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals of the facets that mirror wi into wo, their α, and whether there are any: rough ones, with both above."""
    h = wo + wi
    h /= np.maximum(np.sqrt(dot(h, h)), np.float32(1e-20))[:, None]
    seen = (surface.roughness >= SMOOTH) & (wo[:, 2] > 0) & (wi[:, 2] > 0)
    return h, np.maximum(surface.roughness, np.float32(SMOOTH)) ** 2, seen


def _radiance_scale(ior: np.ndarray, from_light: bool) -> np.ndarray | np.float32:
    """(η_light/η_view)² of refraction away from the side that `ior` is seen from; 1 for a path."""
    return 1 / (ior * ior) if from_light else np.float32(1)


def _mean(color: np.ndarray) -> np.ndarray:
    """Mean of the three channels, (n,)."""
    return (color[:, 0] + color[:, 1] + color[:, 2]) / 3
