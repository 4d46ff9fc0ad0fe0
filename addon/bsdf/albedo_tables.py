"""What GGX lobes reflect in all, tabulated over roughness and cosine.

Cycles tabulates the same quantities at the same nodes and interpolates them linearly as well, so that what it makes of
a material between two nodes is what is made of it here. The index of refraction η stands in them as
z = ±√|(η − 1)/(η + 1)|, which has most nodes where glass is; 1/η is −z. `tools/albedo_tables.py` makes the file.

WHITE : (roughness, cosine)
    Albedo E of single scattering by a white lobe.
GRAZING : (17, roughness, cosine)
    Albedo of single scattering by a lobe with f0 = 0 and f90 = 1; one slice a node of z in [0, 1], then Schlick's.
GRAZING_OF_FACETS : (17, roughness, cosine)
    Mean `grazing_share` of the visible facets whose reflection leaves the surface, other facets counting 0. Cycles
    takes it as that albedo over the white lobe's where it weighs a layer against what lies beneath.
GLASS : (31, roughness, cosine)
    Albedo of single scattering by untinted glass, both sides together; z is in [−1, 1].
WHITE_AVERAGE, GLASS_AVERAGE
    Cosine-weighted averages over the hemisphere, without the last axis.
"""

from pathlib import Path

import numpy as np

from ..core.compiling import part
from ..core.vec3 import ONE, ZERO

FILE = Path(__file__).with_suffix(".npz")
FILE_DIGEST = "257faabc99567be6f5a9c0a0190b9f0e20ce12c91def1c5f185588093ad5d4b9"
"""SHA-256 of the file. Kernels contain the tables, and are kept under a digest of this text."""

with np.load(FILE) as tables:
    WHITE, WHITE_AVERAGE = tables["white"], tables["white_average"]
    GRAZING, GRAZING_OF_FACETS = tables["grazing"], tables["grazing_of_facets"]
    GLASS, GLASS_AVERAGE = tables["glass"], tables["glass_average"]

_HALF, _CURVES = np.float32(0.5), np.float32(15 / 16)


@part
def interpolate_1(table, x):
    """Linear interpolation of a table whose nodes are even in [0, 1]."""
    i, f = _node(x, table.shape[0])
    return _mix(table[i], table[i + 1], f)


@part
def interpolate_2(table, x, y):
    """Along both axes."""
    i, f = _node(x, table.shape[0])
    j, g = _node(y, table.shape[1])
    return _mix(_mix(table[i, j], table[i, j + 1], g), _mix(table[i + 1, j], table[i + 1, j + 1], g), f)


@part
def interpolate_3(table, x, y, z):
    """Along three axes."""
    i, f = _node(x, table.shape[0])
    return _mix(interpolate_2(table[i], y, z), interpolate_2(table[i + 1], y, z), f)


@part
def _node(x, n):
    """The node of n at or below x, and how far above it x is, in nodes."""
    x = min(max(x, ZERO), ONE) * np.float32(n - 1)
    node = min(np.int32(x), n - 2)
    return node, x - np.float32(node)


@part
def _mix(a, b, f):
    return a + (b - a) * f


@part
def curve_coordinate(ior):
    """Where a Fresnel curve stands in the first axis of GRAZING, in [0, 1]: 1 is Schlick's, which has `ior` 0."""
    if ior <= ZERO:
        return ONE
    return np.sqrt(abs((ior - ONE) / (ior + ONE))) * _CURVES


@part
def glass_coordinate(ior):
    """Where an index of refraction stands in the first axis of GLASS, in [0, 1]."""
    ratio = (ior - ONE) / (ior + ONE)
    return (ONE + np.copysign(np.sqrt(abs(ratio)), ratio)) * _HALF


@part
def multiple_scattering(fresnel, white, white_average):
    """What a lobe is multiplied by so as to give back what scatters more than once between facets.

    1 + Fms (1 − E)/E with Fms = Fss Eavg / (1 − Fss (1 − Eavg)), Fss the lobe's average reflectance: the lobe that
    would be white becomes so, and each further reflection takes its colour (Kulla and Conty 2017, appendix).
    """
    missing = (ONE - white) / white
    return ONE + fresnel * (white_average * missing) / (ONE - fresnel * (ONE - white_average))


@part
def multiple_scattering_of(color, white, white_average):
    """The same of three colours."""
    return (
        multiple_scattering(color[0], white, white_average),
        multiple_scattering(color[1], white, white_average),
        multiple_scattering(color[2], white, white_average),
    )
