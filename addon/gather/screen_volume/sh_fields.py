"""Light in cells, and what makes its level absolute: photons and known light treated alike.

A photon adds its power Φ, from the direction −Θ that it came from, to the cell that it lies in (Fei and Wang, Eq. 5):

    c = Σ Φ y(−Θ)

Equation 4's factor A C₀²/(4N) stands for the area that a photon lights, and drops n's cosine into its power. Here
nothing is estimated: if the radiance in front of the cell's surfaces is L · y(ω), the photons' sum is expected to be

    c = ∫ dA ∫ (ω·n)⁺ (L · y(ω)) y(ω) dω = R L,        R = ∫ r(n) dA,     r(n) = ∫ (ω·n)⁺ y(ω) y(ω)ᵀ dω,

with R, the *response*, known from the surfaces alone. R is put into the cells beside c as four fields (its columns are
what four known radiances would give). What is linear is done to both, and L = R⁻¹ c has its absolute level whatever
that was.
"""

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.sampling.spherical_harmonics import Y0, Y1
from ...core.sampling.streams import stream
from ...core.vec3 import mean, row
from ...photons import Photons

N_SIGNS = 2
"""Fields whose photons have random signs: what they read is noise, and as large as that of the light."""

N_LIGHT = 3 + N_SIGNS
N_FIELDS = N_LIGHT + 4
"""Red, green, blue; the signed fields; the response's columns."""

PRIOR = 0.05
"""What speaks against light that comes more from one side than another: this share of the response's trace."""

# r(n) of ν = (1, n): r_ab = SCALE_ab ν_a ν_b, and ISOTROPIC more
SCALE = np.full((4, 4), 3 / 16, np.float32)
SCALE[0, :] = SCALE[:, 0] = 1 / (2 * np.sqrt(3))
SCALE[0, 0] = 1 / 4
ISOTROPIC = np.diag(np.array([0, 3 / 16, 3 / 16, 3 / 16], np.float32))


@part
def add_light(fields, power, came_from, signs):
    """Add a photon to a cell's fields, (N_LIGHT, 4) float64, W: Φ y(−Θ), with its mean over colours in the signed ones.

    `came_from` is the unit direction −Θ against its flight; `signs`, (N_SIGNS,) int8, are ±1.
    """
    x, y, z = came_from
    for f in range(N_LIGHT):
        phi = power[f] if f < 3 else mean(power) * np.float32(signs[f - 3])
        fields[f, 0] += phi * Y0
        fields[f, 1] += phi * Y1 * x
        fields[f, 2] += phi * Y1 * y
        fields[f, 3] += phi * Y1 * z


@part
def add_response(columns, normal, area):
    """Add r(n) dA of a piece of surface to its cell's columns, (4, 4) float64, m²."""
    nu = (np.float32(1), normal[0], normal[1], normal[2])
    for a in range(4):
        for b in range(4):
            columns[a, b] += area * (SCALE[a, b] * nu[a] * nu[b] + ISOTROPIC[a, b])


@kernel
def inject_light(fields, cells, power, came_from, signs):
    """Add n photons to the fields (cells, N_LIGHT, 4) of their cells (n,) int32; −1: none.

    Parameters
    ----------
    fields : (cells, N_LIGHT, 4) float64, W
    power, came_from : (n, 3) float32
    signs : (n, N_SIGNS) int8
    """
    for k in range(len(cells)):
        if cells[k] >= 0:
            add_light(fields[cells[k]], row(power, k), row(came_from, k), signs[k])


@kernel
def inject_response(columns, cells, normals, area):
    """Add n pieces of surface, (n, 3) and (n,) float32, to the columns (cells, 4, 4) float64 of their cells, m²."""
    for k in range(len(cells)):
        if cells[k] >= 0:
            add_response(columns[cells[k]], row(normals, k), area[k])


def sh_response(normals: np.ndarray) -> np.ndarray:
    """r(n) = ∫ (ω·n)⁺ y(ω) y(ω)ᵀ dω of unit normals (n, 3): (n, 4, 4) float32."""
    columns = np.zeros((len(normals), 4, 4))
    cells, area = np.arange(len(normals), dtype=np.int32), np.ones(len(normals), np.float32)
    inject_response(columns, cells, kernel_array(normals, np.float32), area)
    return columns.astype(np.float32)


def random_signs(photons: Photons, seed: int, *key: int) -> np.ndarray:
    """Signs of emitted photons, ±1: (paths, N_SIGNS) int8, to be looked up by a photon's path."""
    n_paths = int(photons.path.max(initial=-1)) + 1
    return stream(seed, *key).choice(np.array([-1, 1], np.int8), (n_paths, N_SIGNS))


@part
def solve_cell(fields, system, radiance):
    """Radiance L from R L = c of one cell, by elimination with the largest pivot of each column.

    The prior is added to R for the linear band alone, which stays small where the surfaces around say nothing of it:
    light that is the same from everywhere, and irradiance at the normal of the only surface around (the first row of R
    times L, up to a factor), are exact whatever the prior.

    Parameters
    ----------
    fields : (N_FIELDS, 4)
        Light (W) and the response's columns (m²).
    system : (4, N_FIELDS) float64
        Room to work in.
    radiance : (N_LIGHT, 4) float32, W/(m² sr)
        Becomes red, green, blue and the signed fields; 0 where the response is.
    """
    trace = np.float64(0)
    for a in range(4):
        trace += fields[N_LIGHT + a, a]
        for f in range(N_FIELDS):
            system[a, f] = fields[f, a]
    for a in range(1, 4):
        system[a, N_LIGHT + a] += PRIOR * trace
    for a in range(4):
        pivot = a
        for b in range(a + 1, 4):
            if abs(system[b, N_LIGHT + a]) > abs(system[pivot, N_LIGHT + a]):
                pivot = b
        for f in range(N_FIELDS):
            system[a, f], system[pivot, f] = system[pivot, f], system[a, f]
        for b in range(4):
            if b != a and trace > 0:
                share = system[b, N_LIGHT + a] / system[a, N_LIGHT + a]
                for f in range(N_FIELDS):
                    system[b, f] -= share * system[a, f]
    for a in range(4):
        for f in range(N_LIGHT):
            radiance[f, a] = system[a, f] / system[a, N_LIGHT + a] if trace > 0 else 0


@kernel
def _solve(fields, system, radiance):
    for k in range(len(fields)):
        solve_cell(fields[k], system, radiance[k])


def solve_radiance(fields: np.ndarray) -> np.ndarray:
    """Radiance (n, N_LIGHT, 4) float32, W/(m² sr), of n cells' fields (n, N_FIELDS, 4) float32; see `solve_cell`."""
    radiance = np.empty((len(fields), N_LIGHT, 4), np.float32)
    _solve(fields, np.empty((4, N_FIELDS)), radiance)
    return radiance
