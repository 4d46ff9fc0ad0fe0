"""The screen-space light-gathering volume (Fei and Wang, section 4.3): photons gathered in the pixels of a camera.

Caustics are sharper than any grid in space that is affordable. In the picture's plane, cells are pixels: light is put
into those that photons fall into, and spread a few pixels far over the surface that is seen. As in the volume of
section 4.1, the pixels' response to known light goes the same way, and gives the light its absolute level.
"""

import numpy as np

from ...core.compiling import kernel, part
from ...core.parallel import Workers, slices
from ...core.sampling.spherical_harmonics import sh_cosine_lobe
from ...core.sampling.vectors import dot
from ...photons import Photons
from ...receivers import Camera, SeenSurface
from ..density.density import SAME_SIDE
from .sh_fields import N_FIELDS, N_LIGHT, inject_light, random_signs, sh_response, solve_radiance

N_ITERATIONS = 12
"""How often pixels gather from their neighbours: over √(2·12/5) ≈ 2 pixels, one standard deviation."""

_REACH = 3  # sides of a pixel that neighbours on one surface may lie apart at least: where it is seen at a slant
_PHOTONS_WITHIN = 50  # that h is to hold where photons are as dense as on average: C₀ = √(50/π)

_LEAST_DENSITY = 0.01  # P_min
_SHARE = np.float32(1 / 5)  # of its light that a pixel sends to each of its neighbours in an iteration
_CHUNK = 1 << 17  # photons
_PIXELS = 1 << 15  # in a chunk

_GATHERING = 71  # stream of random numbers: the photons' signs


def screen_irradiance(
    camera: Camera, seen: SeenSurface, photons: Photons, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance of the surfaces that a camera sees, from the photons on them.

    Returns
    -------
    irradiance : (p, 3) float32, W/m²
    stderr : (p,) float32, W/m²
        Of its mean over colours.
    """
    of_pixel = np.full(camera.n_pixels + 1, -1, np.int64)
    of_pixel[seen.pixel] = np.arange(len(seen))
    radius = gathering_radius(seen, photons, of_pixel[camera.pixels(photons.position)] >= 0)
    response = sh_response(seen.normal) * seen.area[:, None, None]
    fields = np.concatenate([_inject(camera, seen, photons, of_pixel, radius, workers), response], axis=1)
    neighbours = _neighbours(camera, seen, of_pixel, radius)
    for i in range(N_ITERATIONS):
        workers.progress.update("Gathering on the screen", i / N_ITERATIONS)
        fields = gather_once(fields, neighbours, workers)
    radiance = solve_radiance(fields)
    light = np.einsum("pfk,pk->pf", radiance, sh_cosine_lobe(seen.shading_normal))
    return np.maximum(light[:, :3], 0), np.sqrt(np.mean(light[:, 3:] ** 2, axis=1))


def gathering_radius(seen: SeenSurface, photons: Photons, in_view: np.ndarray) -> float:
    """Radius h = C₀ √(A/(pN)) at path density p = 1, m; A and N are those of the picture instead of the scene."""
    n = max(int(np.count_nonzero(in_view)), 1)
    return float(np.sqrt(_PHOTONS_WITHIN / np.pi * seen.area.sum(dtype=np.float64) / n))


def _inject(
    camera: Camera, seen: SeenSurface, photons: Photons, of_pixel: np.ndarray, radius: float, workers: Workers
) -> np.ndarray:
    """Photons' light in the pixels where they lie on what is seen, within h of it: (p, N_LIGHT, 4) float32, W."""
    fields = np.zeros((len(seen), N_LIGHT, 4))
    signs = random_signs(photons, workers.seed, _GATHERING)

    def place(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, ...]:
        part = photons.where(chunk)
        at = of_pixel[camera.pixels(part.position)]
        away, normals = part.position - seen.position[at], part.normal
        h = np.float32(radius) / np.sqrt(np.clip(part.path_density, _LEAST_DENSITY, 1))
        on_surface = np.abs(dot(away, seen.normal[at])) < h
        lit = (at >= 0) & on_surface & (dot(normals, seen.normal[at]) > SAME_SIDE)
        return np.where(lit, at, -1).astype(np.int32), part.power, -part.direction, signs[part.path]

    for _, light in workers.chunks("Gathering on the screen", len(photons), _CHUNK, place, (_GATHERING,)):
        inject_light(fields, *light)
    return fields.astype(np.float32)


def _neighbours(camera: Camera, seen: SeenSurface, of_pixel: np.ndarray, radius: float) -> np.ndarray:
    """Of each pixel those at its left, right, lower and upper side on the same surface within h, −1: none; (p, 4)."""
    grid = of_pixel[:-1].reshape(camera.height, camera.width)
    neighbours = np.full((len(seen), 4), -1, np.int32)
    for axis, (a, b) in enumerate(((grid[:, :-1], grid[:, 1:]), (grid[:-1], grid[1:]))):
        both = (a >= 0) & (b >= 0)
        a, b = a[both], b[both]
        away = seen.position[b] - seen.position[a]
        near = dot(away, away) < np.maximum(radius**2, _REACH**2 * np.maximum(seen.area[a], seen.area[b]))
        facing = dot(seen.normal[a], seen.normal[b]) > SAME_SIDE
        a, b = a[near & facing], b[near & facing]
        neighbours[b, 2 * axis], neighbours[a, 2 * axis + 1] = a, b
    return neighbours


def gather_once(fields: np.ndarray, neighbours: np.ndarray, workers: Workers) -> np.ndarray:
    """One iteration: neighbours exchange a fifth of their light, which keeps its sum.

    Parameters
    ----------
    fields : (p, N_FIELDS, 4) float32
    neighbours : (p, 4) int32
        Of each pixel; −1: none.
    """
    gathered = np.empty_like(fields)

    def gather(chunk: slice) -> None:
        _gather(fields, neighbours[chunk], chunk.start, gathered[chunk])

    for _ in workers.map(gather, slices(len(fields), _PIXELS)):
        workers.progress.check()
    return gathered


@kernel
def _gather(fields, neighbours, first, gathered):
    """See `gather_once`: of the pixels from the `first` on."""
    for p in range(len(gathered)):
        gather_pixel(fields, neighbours[p], first + p, gathered[p])


@part
def gather_pixel(fields, neighbours, pixel, gathered):
    """What a pixel has after an exchange with its four neighbours, (N_FIELDS, 4)."""
    own = fields[pixel]
    for f in range(N_FIELDS):
        for a in range(4):
            gathered[f, a] = own[f, a]
    for side in range(4):
        if neighbours[side] >= 0:
            other = fields[neighbours[side]]
            for f in range(N_FIELDS):
                for a in range(4):
                    gathered[f, a] += _SHARE * (other[f, a] - own[f, a])
