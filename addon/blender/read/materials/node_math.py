"""What Cycles' converter nodes compute, on arrays whose last axis holds a number or three colours."""

from collections.abc import Callable

import numpy as np

Formula = Callable[..., np.ndarray]


def lerp(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """From a at t = 0 to b at t = 1."""
    return a * (1 - t) + b * t


def saturate(a: np.ndarray) -> np.ndarray:
    """Clipped to [0, 1]."""
    return np.clip(a, 0, 1)


def divide(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Quotient a / b, and 0 where b is 0."""
    return np.where(b == 0, 0, a / np.where(b == 0, 1, b))


def fract(a: np.ndarray) -> np.ndarray:
    """What is over a whole number, a − ⌊a⌋."""
    return a - np.floor(a)


def power(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The power of a by b, and 0 where that is no real number."""
    whole = b == np.floor(b)
    defined = ((a > 0) | whole) & ~((a == 0) & (b < 0))
    return np.where(defined, np.power(np.where(defined, a, 1), b), 0)


def _wrap(a: np.ndarray, high: np.ndarray, low: np.ndarray) -> np.ndarray:
    return np.where(high == low, low, a - (high - low) * np.floor(divide(a - low, high - low)))


def _modulo(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.where(b == 0, 0, np.fmod(a, np.where(b == 0, 1, b)))


def _log(a: np.ndarray, base: np.ndarray) -> np.ndarray:
    defined = (a > 0) & (base > 0)
    return np.where(defined, divide(np.log(np.where(defined, a, 1)), np.log(np.where(defined, base, 2))), 0)


def _smooth_min(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    h = divide(np.maximum(c - np.abs(a - b), 0), c)
    return np.minimum(a, b) - h**3 * c / 6


def _ping_pong(a: np.ndarray, scale: np.ndarray) -> np.ndarray:
    return np.abs(fract(divide(a - scale, 2 * scale)) * 2 * scale - scale) * (scale != 0)


def _within(a: np.ndarray) -> np.ndarray:
    return np.clip(a, -1, 1)


MATH: dict[str, Formula] = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: power(a, b),
    "LOGARITHM": lambda a, b, c: _log(a, b),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: np.where(a > 0, 1 / np.sqrt(np.where(a > 0, a, 1)), 0),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "EXPONENT": lambda a, b, c: np.exp(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0,
    "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)) * 1.0,
    "SMOOTH_MIN": _smooth_min,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_min(-a, -b, c),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: fract(a),
    "MODULO": lambda a, b, c: _modulo(a, b),
    "FLOORED_MODULO": lambda a, b, c: np.where(b == 0, 0, a - np.floor(divide(a, b)) * b),
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: np.floor(divide(a, b)) * b,
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: np.arcsin(_within(a)),
    "ARCCOSINE": lambda a, b, c: np.arccos(_within(a)),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "SINH": lambda a, b, c: np.sinh(a),
    "COSH": lambda a, b, c: np.cosh(a),
    "TANH": lambda a, b, c: np.tanh(a),
    "RADIANS": lambda a, b, c: np.radians(a),
    "DEGREES": lambda a, b, c: np.degrees(a),
}
"""Operations of the Math node."""


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(-1, keepdims=True)


def _length(a: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(a, a))


VECTOR_MATH: dict[str, Formula] = {
    name: MATH[other]
    for name, other in {
        "ADD": "ADD",
        "SUBTRACT": "SUBTRACT",
        "MULTIPLY": "MULTIPLY",
        "DIVIDE": "DIVIDE",
        "MULTIPLY_ADD": "MULTIPLY_ADD",
        "ABSOLUTE": "ABSOLUTE",
        "MINIMUM": "MINIMUM",
        "MAXIMUM": "MAXIMUM",
        "FLOOR": "FLOOR",
        "CEIL": "CEIL",
        "FRACTION": "FRACT",
        "MODULO": "MODULO",
        "SNAP": "SNAP",
        "SINE": "SINE",
        "COSINE": "COSINE",
        "TANGENT": "TANGENT",
    }.items()
} | {
    "DOT_PRODUCT": lambda a, b, c: _dot(a, b),
    "CROSS_PRODUCT": lambda a, b, c: np.cross(a, b),
    "LENGTH": lambda a, b, c: _length(a),
    "DISTANCE": lambda a, b, c: _length(a - b),
    "NORMALIZE": lambda a, b, c: divide(a, _length(a)),
}
"""Operations of the Vector Math node, without Scale."""


def rgb_to_hsv(rgb: np.ndarray) -> np.ndarray:
    """Hue, saturation and value in [0, 1], of (…, 3)."""
    high, spread = rgb.max(-1), np.ptp(rgb, axis=-1)
    return np.stack([_hue(rgb, high, spread), divide(spread, high), high], axis=-1)


def rgb_to_hsl(rgb: np.ndarray) -> np.ndarray:
    """Hue, saturation and lightness in [0, 1], of (…, 3)."""
    high, low = rgb.max(-1), rgb.min(-1)
    lightness = saturate((high + low) / 2)
    spread = high - low
    saturation = divide(spread, np.where(lightness > 0.5, 2 - high - low, high + low))
    return np.stack([_hue(rgb, high, spread), saturation, lightness], axis=-1)


def _hue(rgb: np.ndarray, high: np.ndarray, spread: np.ndarray) -> np.ndarray:
    c = divide(high[..., None] - rgb, spread[..., None])
    r, g, b = (c[..., i] for i in range(3))
    hue = np.where(rgb[..., 0] == high, b - g, np.where(rgb[..., 1] == high, 2 + r - b, 4 + g - r)) / 6
    return np.where(spread == 0, 0, fract(hue))


def _pure(hue: np.ndarray) -> np.ndarray:
    """The colour of a hue at full saturation and value, (…, 3)."""
    return saturate(np.abs(fract(hue[..., None] + np.array([0, 2 / 3, 1 / 3])) * 6 - 3) - 1)


def hsv_to_rgb(hsv: np.ndarray) -> np.ndarray:
    """The inverse of `rgb_to_hsv`."""
    return hsv[..., 2:] * lerp(np.ones(3), _pure(hsv[..., 0]), hsv[..., 1:2])


def hsl_to_rgb(hsl: np.ndarray) -> np.ndarray:
    """The inverse of `rgb_to_hsl`."""
    lightness = hsl[..., 2:]
    return (_pure(hsl[..., 0]) - 0.5) * (1 - np.abs(2 * lightness - 1)) * hsl[..., 1:2] + lightness


SEPARATE: dict[str, Formula] = {"RGB": lambda color: color, "HSV": rgb_to_hsv, "HSL": rgb_to_hsl}
COMBINE: dict[str, Formula] = {"RGB": lambda color: color, "HSV": hsv_to_rgb, "HSL": hsl_to_rgb}


def _overlay(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    return np.where(a < 0.5, a * (1 - t + 2 * t * b), 1 - (1 - t + 2 * t * (1 - b)) * (1 - a))


def _dodge(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    left = 1 - t * b
    return np.where(a == 0, 0, np.where(left <= 0, 1, np.minimum(divide(a, left), 1)))


def _burn(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    left = 1 - t + t * b
    return np.where(left <= 0, 0, saturate(1 - divide(1 - a, left)))


def _soft_light(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    screen = 1 - (1 - b) * (1 - a)
    return lerp(a, (1 - a) * b * a + a * screen, t)


def _with_hsv(a: np.ndarray, b: np.ndarray, taken: tuple[int, ...]) -> np.ndarray:
    """`a` with some of the hue, saturation and value of `b`."""
    hsv, other = rgb_to_hsv(a), rgb_to_hsv(b)
    for i in taken:
        hsv[..., i] = other[..., i]
    return hsv_to_rgb(hsv)


def _hue_of(a: np.ndarray, b: np.ndarray, t: np.ndarray, taken: tuple[int, ...]) -> np.ndarray:
    grey = np.ptp(b, axis=-1, keepdims=True) == 0
    return np.where(grey, a, lerp(a, _with_hsv(a, b, taken), t))


def _saturation(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    hsv, other = rgb_to_hsv(a), rgb_to_hsv(b)
    mixed = lerp(hsv[..., 1:2], other[..., 1:2], t)
    return np.where(hsv[..., 1:2] == 0, a, hsv_to_rgb(np.concatenate([hsv[..., :1], mixed, hsv[..., 2:]], axis=-1)))


def _value(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    hsv, other = rgb_to_hsv(a), rgb_to_hsv(b)
    return hsv_to_rgb(np.concatenate([hsv[..., :2], lerp(hsv[..., 2:], other[..., 2:], t)], axis=-1))


BLEND: dict[str, Formula] = {
    "MIX": lerp,
    "ADD": lambda a, b, t: a + t * b,
    "MULTIPLY": lambda a, b, t: lerp(a, a * b, t),
    "SCREEN": lambda a, b, t: 1 - (1 - t * b) * (1 - a),
    "OVERLAY": _overlay,
    "SUBTRACT": lambda a, b, t: a - t * b,
    "DIVIDE": lambda a, b, t: np.where(b == 0, a, lerp(a, divide(a, b), t)),
    "DIFFERENCE": lambda a, b, t: lerp(a, np.abs(a - b), t),
    "EXCLUSION": lambda a, b, t: np.maximum(lerp(a, a + b - 2 * a * b, t), 0),
    "DARKEN": lambda a, b, t: lerp(a, np.minimum(a, b), t),
    "LIGHTEN": lambda a, b, t: lerp(a, np.maximum(a, b), t),
    "DODGE": _dodge,
    "BURN": _burn,
    "HUE": lambda a, b, t: _hue_of(a, b, t, (0,)),
    "COLOR": lambda a, b, t: _hue_of(a, b, t, (0, 1)),
    "SATURATION": _saturation,
    "VALUE": _value,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda a, b, t: a + t * (2 * b - 1),
}
"""Blend types of the Mix node for colours: (first, second, factor)."""


def map_range(kind: str, value: np.ndarray, ends: list[np.ndarray], steps: np.ndarray, clamp: bool) -> np.ndarray:
    """The Map Range node.

    Parameters
    ----------
    kind : str
        Blender's interpolation type.
    value : (…, d)
    ends : list of (…, d)
        From min, from max, to min, to max.
    steps : (…, d)
    clamp : bool
    """
    from_min, from_max, to_min, to_max = ends
    t = divide(value - from_min, from_max - from_min)
    if kind == "STEPPED":
        t = np.where(steps > 0, divide(np.floor(t * (steps + 1)), steps), 0)
    elif kind == "SMOOTHSTEP":
        t = saturate(t)
        t = t * t * (3 - 2 * t)
    elif kind == "SMOOTHERSTEP":
        t = saturate(t)
        t = t**3 * (t * (6 * t - 15) + 10)
    mapped = np.where(from_min == from_max, 0, to_min + t * (to_max - to_min))
    if clamp and kind in {"LINEAR", "STEPPED"}:
        mapped = np.clip(mapped, np.minimum(to_min, to_max), np.maximum(to_min, to_max))
    return mapped


def dielectric_f0(ior: np.ndarray) -> np.ndarray:
    """Fresnel reflectance at normal incidence."""
    return ((ior - 1) / (ior + 1)) ** 2


def ior_of_f0(f0: np.ndarray) -> np.ndarray:
    """The index of refraction, at least 1, of a reflectance at normal incidence."""
    root = np.sqrt(np.clip(f0, 0, 0.99))
    return (1 + root) / (1 - root)


def mean_fresnel(ior: float) -> float:
    """Fresnel reflectance of a dielectric, averaged over directions by their cosine."""
    return float(_fresnel(ior).mean())


def fresnel_at(cosine: float, ior: float) -> float:
    """Fresnel reflectance of a dielectric at the cosine of an angle."""
    g2 = ior * ior - 1 + cosine * cosine
    if g2 <= 0:
        return 1.0
    g = g2**0.5
    a, b = (g - cosine) / (g + cosine), (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return a * a * (1 + b * b) / 2


def facing_at(cosine: float, blend: float) -> float:
    """Layer Weight's Facing at the cosine of an angle."""
    return float(1 - cosine ** _facing_exponent(blend))


def mean_of_facing(blend: float) -> float:
    """Layer Weight's Facing, averaged over directions by their cosine."""
    exponent = _facing_exponent(blend)
    return exponent / (exponent + 2)


def _facing_exponent(blend: float) -> float:
    blend = min(max(blend, 0), 1 - 1e-5)
    return 2 * blend if blend < 0.5 else 0.5 / (1 - blend)


def mean_of_pane(ior: float) -> tuple[float, float]:
    """Reflectance of a clear pane and the way through it in thicknesses, averaged over directions by their cosine."""
    once = _fresnel(ior)
    refracted = np.sqrt(np.maximum(1 - _SIN2 / ior**2, 1e-6))
    return float((2 * once / (1 + once)).mean()), float((1 / refracted).mean())


_SIN2 = (np.arange(256) + 0.5) / 256
"""Squared sines of angles; uniform in them is uniform by the cosine."""


def _fresnel(ior: float) -> np.ndarray:
    """Fresnel reflectance of a dielectric at the angles of `_SIN2`."""
    return dielectric_reflectance(np.sqrt(1 - _SIN2), ior)


def dielectric_reflectance(cos: np.ndarray, ior: float) -> np.ndarray:
    """Fresnel reflectance of a dielectric at cosines."""
    g = np.sqrt(np.maximum(ior * ior - 1 + cos * cos, 0))
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (g - cos) / (g + cos), (cos * (g + cos) - 1) / (cos * (g - cos) + 1)
        return np.nan_to_num(np.where(g > 0, a * a * (1 + b * b) / 2, 1))
