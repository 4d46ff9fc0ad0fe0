"""Probes as a JSON file, whose fields docs/probes.md explains."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...settings.probes import Axes, Harmonics
from ..files import whole_file
from .axes import LitProbes

VERSION = 1
_DIGITS = 6
_N_SH = {"l1": 4, "l2": 9}
_BASIS = (
    "0.28209479",
    "0.48860251 x",
    "0.48860251 y",
    "0.48860251 z",
    "1.0925484 x y",
    "1.0925484 y z",
    "0.31539157 (3 z z - 1)",
    "1.0925484 x z",
    "0.54627422 (x x - y y)",
)


def write_probe_file(
    path: Path,
    probes: LitProbes,
    harmonics: Harmonics,
    axes: Axes,
    files: list[dict[str, str]],
    about: Mapping[str, Any],
) -> None:
    """Write a file, whole or not at all.

    Parameters
    ----------
    files : list of dict of str to str
        Names of each grid's volumes, by colour.
    about : dict of str to object
        What the file says of how it was made.

    Raises
    ------
    BakeError
        If it cannot be written.
    """
    n_sh = _N_SH[harmonics]
    content: dict[str, Any] = {
        "format": "Photon Bake probes",
        "version": VERSION,
        **about,
        "axes": axes,
        "harmonics": harmonics,
        "basis": list(_BASIS[:n_sh]),
        "sides": ["+x", "-x", "+y", "-y", "+z", "-z"],
    }
    grids, first = [], 0
    for grid, names in zip(probes.places.grids, files, strict=True):
        here = slice(first, first := first + grid.n_probes)
        grids.append(
            {
                "name": grid.name,
                "counts": list(grid.counts),
                "texture_to_world": _rounded(grid.matrix, 9),
                "world_to_texture": _rounded(np.linalg.inv(grid.matrix), 9),
                "files": names,
                **_columns(probes, here, n_sh, grid.positions),
            }
        )
    lone = _columns(probes, slice(first, None), n_sh, probes.places.points)
    content |= {"grids": grids, "points": {"names": list(probes.places.names), **lone}}
    with whole_file(path) as file:
        file.write(json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode())


def _columns(probes: LitProbes, here: slice, n_sh: int, positions: np.ndarray) -> dict[str, Any]:
    """What is said of each probe, in its order."""
    light, n_all = probes.light, probes.light.sh.shape[1]
    return {
        "position": _rounded(positions),
        "valid": probes.valid[here].tolist(),
        "radiance": _rounded(light.sh[here, :n_sh]),
        "radiance_stderr": _rounded(light.stderr[here, :n_sh]),
        "irradiance": _rounded(light.irradiance[here]),
        "irradiance_stderr": _rounded(light.stderr[here, n_all:]),
    }


def _rounded(values: np.ndarray, digits: int = _DIGITS) -> Any:
    """Lists of numbers with so many digits, as more of them say nothing and take room."""
    exact = np.asarray(values, np.float64)
    with np.errstate(divide="ignore"):
        exponent = np.where(exact == 0, 0, np.floor(np.log10(np.abs(exact))))
    scale = 10.0 ** (digits - 1 - exponent)
    return (np.rint(exact * scale) / scale).tolist()
