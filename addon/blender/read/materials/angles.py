"""Factors of Mix Shaders that depend on the viewing angle, as curves over its cosine."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from ....scene import N_ANGLES, angle_cosines
from ..meshes.object_values import Values
from .expressions import constant
from .nodes import Factor, Place, View

ValueAt = Callable[[Place, float], np.ndarray | None]
"""The value of a socket seen at the cosine of an angle, None where it is not the same all over the surface."""


def seen_at(view: View, values: Values) -> ValueAt:
    """Values of sockets in a view at an angle, as far as they are the same all over the surface."""

    def value_at(place: Place, cosine: float) -> np.ndarray | None:
        value = constant(place, values, replace(view, cosine=cosine))
        return None if value is None else value[None, None]

    return value_at


def curve_of(
    factors: Iterable[Factor], value_at: ValueAt, without: set[Place]
) -> tuple[dict[Place, None], tuple[float, ...]]:
    """The sockets of factors that depend on the angle, and the product of these at `angle_cosines`; empty for none."""
    places: dict[Place, None] = {}
    product = np.ones(N_ANGLES)
    for one in factors:
        curve = _curve(one, value_at) if one.place not in without else None
        if curve is not None:
            places[one.place] = None
            product *= curve
    return places, tuple(product.tolist()) if places else ()


def _curve(factor: Factor, value_at: ValueAt) -> np.ndarray | None:
    """A factor at `angle_cosines`, (N_ANGLES,), None where it does not depend on the angle, or on more than that."""

    def at(cosine: float) -> float | None:
        value = value_at(factor.place, cosine)
        return None if value is None or value.size != 1 else float(factor.weight(lambda _: value).item())

    if at(1.0) is None or at(0.2) == at(0.7) == at(1.0):
        return None
    return np.array([at(cosine) for cosine in angle_cosines()], float)
