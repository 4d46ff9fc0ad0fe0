"""Values of sockets: constants, or pictures over the texture space of one UV map."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import bpy
import numpy as np

from ..meshes.object_values import Values, of_scene, read_by
from .node_math import (
    BLEND,
    COMBINE,
    MATH,
    SEPARATE,
    VECTOR_MATH,
    facing_at,
    fresnel_at,
    lerp,
    map_range,
    mean_fresnel,
    mean_of_facing,
    saturate,
)
from .nodes import FROM_FRONT, Place, View
from .pictures.images import MISSING

Sampler = Callable[[Place], np.ndarray]
"""Colour and alpha of an image node at each texel of a grid, (h, w, 4); told one of the node's outputs. Of a Hair Info
node `picture_of_strands`.
"""

LUMINANCE = np.array([0.2126729, 0.7151522, 0.0721750], np.float32)
"""What Cycles weighs the three colours with where a colour feeds a number."""

TABLE_SIZE = 256
"""Cycles evaluates ramps and curves at this many points and interpolates between them."""

GROUPS_ARE_INLINED = bpy.app.version >= (5, 0, 0)
"""Whether the sockets of groups convert nothing: from 5.0 Cycles gets trees without groups."""


class UnreadableError(Exception):
    """A value comes from a node that only Cycles can evaluate."""

    def __init__(self, node: "bpy.types.Node") -> None:
        super().__init__(node.bl_label)
        self.node = node


def no_images(place: Place) -> np.ndarray:
    """A `Sampler` for those who want constants alone."""
    raise UnreadableError(place.socket.node)


@dataclass
class Evaluator:
    """Evaluates sockets, each output once.

    Attributes
    ----------
    sample : Sampler
    values : Values
        What is known of objects and the scene.
    view : View or None
        Without it what differs by how a surface is seen is unreadable.
    """

    sample: Sampler
    values: Values = of_scene
    view: View | None = FROM_FRONT
    _known: dict[Place, np.ndarray] = field(default_factory=dict)

    def value(self, place: Place) -> np.ndarray:
        """The value of a socket, (h, w, 1 or 3) float32; h = w = 1 where it is constant.

        Raises
        ------
        UnreadableError
        """
        before = place.origin if GROUPS_ARE_INLINED else place.upstream or place
        if before != place:
            return _converted(self.value(before), before.socket.type, place.socket.type)
        if not place.socket.is_output:
            return default_value(place.socket)
        if place not in self._known:
            with np.errstate(all="ignore"):
                value = np.nan_to_num(self._computed(place), posinf=0.0, neginf=0.0).astype(np.float32, copy=False)
            self._known[place] = _converted(value, "RGBA", place.socket.type)
        return self._known[place]

    def _computed(self, place: Place) -> np.ndarray:
        node = place.socket.node
        fixed = (self.view or FROM_FRONT).value(place.socket)
        if fixed is not None and self.view is None:
            raise UnreadableError(node)
        if fixed is not None:
            return np.full((1, 1, 1), fixed)
        read = read_by(place, self.values)
        if read is not None:
            return read.reshape(1, 1, -1)
        if node.type not in READERS:
            raise UnreadableError(node)
        return READERS[node.type](_Inputs(self, place))


def constant(place: Place, values: Values = of_scene, view: View | None = FROM_FRONT) -> np.ndarray | None:
    """The value of a socket if it is the same everywhere, (1 or 3,) float32, or None; see `Evaluator`."""
    try:
        value = Evaluator(no_images, values, view).value(place)
    except UnreadableError:
        return None
    return value[0, 0]


def default_value(socket: "bpy.types.NodeSocket") -> np.ndarray:
    """A socket's own value, (1, 1, 1 or 3) float32."""
    return np.atleast_1d(np.array(socket.default_value, np.float32))[:3].reshape(1, 1, -1)


def _converted(value: np.ndarray, kind: str, wanted: str) -> np.ndarray:
    """`value` as Cycles converts it between types of sockets."""
    if wanted in {"RGBA", "VECTOR"}:
        return np.repeat(value, 3, axis=2) if value.shape[2] == 1 else value
    if value.shape[2] == 3:
        value = value.mean(axis=2, keepdims=True) if kind == "VECTOR" else value @ LUMINANCE[:, None]
    return np.trunc(value) if wanted == "INT" else value


@dataclass(frozen=True)
class _Inputs:
    """A node that is being evaluated: its inputs by identifier, and which of its outputs is asked for."""

    evaluator: Evaluator
    output: Place

    @cached_property
    def node(self) -> "bpy.types.Node":
        return self.output.socket.node

    @property
    def asked(self) -> str:
        return self.output.socket.identifier

    def __getitem__(self, identifier: str) -> np.ndarray:
        return self.evaluator.value(self.output.input(identifier))

    def first(self) -> np.ndarray:
        return self[self.node.inputs[0].identifier]

    def all(self) -> list[np.ndarray]:
        return [self[one.identifier] for one in self.node.inputs]


def _image(at: _Inputs) -> np.ndarray:
    pixels = MISSING if at.node.image is None else at.evaluator.sample(at.output)
    return pixels[..., 3:] if at.asked == "Alpha" else pixels[..., :3]


def _hair_info(at: _Inputs) -> np.ndarray:
    channel = {"Random": 0, "Intercept": 1}.get(at.asked)
    if channel is None:
        raise UnreadableError(at.node)
    return at.evaluator.sample(at.output)[..., channel : channel + 1]


def _own_value(at: _Inputs) -> np.ndarray:
    return default_value(at.output.socket)


def _mix_rgb(at: _Inputs) -> np.ndarray:
    mixed = BLEND[at.node.blend_type](at["Color1"], at["Color2"], saturate(at["Fac"]))
    return saturate(mixed) if at.node.use_clamp else mixed


def _mix(at: _Inputs) -> np.ndarray:
    node = at.node
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
    if kind is None:
        raise UnreadableError(node)
    uneven = kind == "Vector" and node.factor_mode == "NON_UNIFORM"
    factor = at["Factor_Vector" if uneven else "Factor_Float"]
    factor = saturate(factor) if node.clamp_factor else factor
    blend = BLEND[node.blend_type] if kind == "Color" else lerp
    mixed = blend(at[f"A_{kind}"], at[f"B_{kind}"], factor)
    return saturate(mixed) if kind == "Color" and node.clamp_result else mixed


def _math(at: _Inputs) -> np.ndarray:
    if at.node.operation not in MATH:
        raise UnreadableError(at.node)
    result = MATH[at.node.operation](*at.all())
    return saturate(result) if at.node.use_clamp else result


def _vector_math(at: _Inputs) -> np.ndarray:
    if at.node.operation == "SCALE":
        return at["Vector"] * at["Scale"]
    if at.node.operation not in VECTOR_MATH:
        raise UnreadableError(at.node)
    return VECTOR_MATH[at.node.operation](*at.all()[:3])


def _invert(at: _Inputs) -> np.ndarray:
    return lerp(at["Color"], 1 - at["Color"], at["Fac"])


def _gamma(at: _Inputs) -> np.ndarray:
    color = at["Color"]
    return np.where(color > 0, np.power(np.maximum(color, 1e-30), at["Gamma"]), color)


def _bright_contrast(at: _Inputs) -> np.ndarray:
    contrast = at["Contrast"]
    return np.maximum(at["Color"] * (1 + contrast) + at["Bright"] - contrast / 2, 0)


def _hue_saturation(at: _Inputs) -> np.ndarray:
    hsv = SEPARATE["HSV"](at["Color"])
    hue = (hsv[..., :1] + at["Hue"] + 0.5) % 1
    saturation, value = saturate(hsv[..., 1:2] * at["Saturation"]), hsv[..., 2:] * at["Value"]
    shifted = COMBINE["HSV"](np.concatenate(np.broadcast_arrays(hue, saturation, value), axis=-1))
    return np.maximum(lerp(at["Color"], shifted, at["Fac"]), 0)


def _color_ramp(at: _Inputs) -> np.ndarray:
    ramp = at.node.color_ramp
    table = np.array([ramp.evaluate(i / (TABLE_SIZE - 1)) for i in range(TABLE_SIZE)])
    position = saturate(at["Fac"])[..., 0] * (TABLE_SIZE - 1)
    columns = [3] if at.asked == "Alpha" else [0, 1, 2]
    if ramp.interpolation == "CONSTANT":
        return table[position.astype(int)][..., columns]
    return np.stack([np.interp(position, np.arange(TABLE_SIZE), table[:, i]) for i in columns], axis=-1)


def _curve(mapping: "bpy.types.CurveMapping", curves: list[int], x: np.ndarray) -> np.ndarray:
    """Curves of a mapping, one after the other, at `x` by table."""
    ends = [(point.location[0]) for curve in curves for point in mapping.curves[curve].points]
    low, high = min([0.0, *ends]), max([1.0, *ends])
    if mapping.extend == "EXTRAPOLATED":
        low, high = min(low, float(x.min())), max(high, float(x.max()))
    at = np.linspace(low, high, TABLE_SIZE)
    table = at
    for curve in curves:
        table = np.array([mapping.evaluate(mapping.curves[curve], float(t)) for t in table])
    return np.interp(x, at, table)


def _rgb_curves(at: _Inputs) -> np.ndarray:
    at.node.mapping.initialize()
    color = at["Color"]
    curved = np.stack([_curve(at.node.mapping, [3, i], color[..., i]) for i in range(3)], axis=-1)
    return lerp(color, curved, at["Fac"])


def _float_curve(at: _Inputs) -> np.ndarray:
    at.node.mapping.initialize()
    value = at["Value"]
    return lerp(value, _curve(at.node.mapping, [0], value), at["Factor"])


def _separate(at: _Inputs) -> np.ndarray:
    order = [one.identifier for one in at.node.outputs]
    mode = {"SEPHSV": "HSV"}.get(at.node.type, getattr(at.node, "mode", "RGB"))
    return SEPARATE[mode](at.first())[..., [order.index(at.asked)]]


def _combine(at: _Inputs) -> np.ndarray:
    mode = {"COMBHSV": "HSV"}.get(at.node.type, getattr(at.node, "mode", "RGB"))
    return COMBINE[mode](np.concatenate(np.broadcast_arrays(*at.all()), axis=-1))


def _clamp(at: _Inputs) -> np.ndarray:
    low, high = at["Min"], at["Max"]
    if at.node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(at["Value"], low), high)


def _map_range(at: _Inputs) -> np.ndarray:
    node = at.node
    if node.data_type == "FLOAT":
        value, steps = at["Value"], at["Steps"]
        ends = [at[name] for name in ("From Min", "From Max", "To Min", "To Max")]
    else:
        value, steps = at["Vector"], at["Steps_FLOAT3"]
        ends = [at[name] for name in ("From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3")]
    return map_range(node.interpolation_type, value, ends, steps, node.clamp)


def _fresnel(at: _Inputs) -> np.ndarray:
    return np.full((1, 1, 1), _fresnel_seen(at, max(float(at["IOR"].mean()), 1e-5)))


def _fresnel_seen(at: _Inputs, ior: float) -> float:
    """Fresnel reflectance of the front in a view."""
    view = at.evaluator.view or FROM_FRONT
    return mean_fresnel(ior) if view.cosine is None else fresnel_at(view.cosine, 1 / ior if view.back else ior)


def _layer_weight(at: _Inputs) -> np.ndarray:
    view, blend = at.evaluator.view or FROM_FRONT, float(at["Blend"].mean())
    if at.asked == "Fresnel":
        weight = _fresnel_seen(at, 1 / max(1 - blend, 1e-5))
    else:
        weight = mean_of_facing(blend) if view.cosine is None else facing_at(view.cosine, blend)
    return np.full((1, 1, 1), weight)


READERS: dict[str, Callable[[_Inputs], np.ndarray]] = {
    "TEX_IMAGE": _image,
    "HAIR_INFO": _hair_info,
    "RGB": _own_value,
    "VALUE": _own_value,
    "MIX_RGB": _mix_rgb,
    "MIX": _mix,
    "MATH": _math,
    "VECT_MATH": _vector_math,
    "INVERT": _invert,
    "GAMMA": _gamma,
    "BRIGHTCONTRAST": _bright_contrast,
    "HUE_SAT": _hue_saturation,
    "VALTORGB": _color_ramp,
    "CURVE_RGB": _rgb_curves,
    "CURVE_FLOAT": _float_curve,
    "RGBTOBW": _Inputs.first,
    "SEPARATE_COLOR": _separate,
    "SEPRGB": _separate,
    "SEPHSV": _separate,
    "SEPXYZ": _separate,
    "COMBINE_COLOR": _combine,
    "COMBRGB": _combine,
    "COMBHSV": _combine,
    "COMBXYZ": _combine,
    "CLAMP": _clamp,
    "MAP_RANGE": _map_range,
    "FRESNEL": _fresnel,
    "LAYER_WEIGHT": _layer_weight,
}
"""Node types that can be evaluated without Cycles. Those that depend on the direction give their mean, or what the view
has of it.
"""
