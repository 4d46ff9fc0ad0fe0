"""A scene's view transform as a table, which Blender's own colour management fills.

Exposure is a factor before all else, and not in the table. The rest (white balance, look, transform, curves, gamma) is,
between a display's colours of a lattice of radiances. Standard alone needs no table.
"""

import tempfile
from dataclasses import dataclass
from math import log2
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..temporary import Temporary

SIDE = 64
"""Points of the lattice along each channel."""

LARGEST, BEND = 64.0, 1024.0
"""The lattice is even in log2(1 + BEND x) up to the largest x, 8.5 stops over middle grey; over it all is as bright."""

_SETTINGS = ("view_transform", "look", "gamma", "use_curve_mapping")
_WHITE_BALANCE = ("use_white_balance", "white_balance_temperature", "white_balance_tint")


@dataclass(frozen=True)
class ViewTransform:
    """How radiance is shown.

    Attributes
    ----------
    exposure : float
        What it is multiplied by.
    table : (SIDE, SIDE, SIDE, 3) float32 or None
        Display colours in [0, 1] by blue, green and red; None where they are the radiance, encoded by the display.
    """

    exposure: float
    table: np.ndarray | None

    @property
    def shaper(self) -> tuple[float, float, float, float]:
        """As shaders/live/view_transform.glsl takes it."""
        return self.exposure, BEND, log2(1 + BEND * LARGEST), 0.0 if self.table is None else float(SIDE)


def key_of(scene: "bpy.types.Scene") -> tuple[Any, ...]:
    """What a table depends on."""
    view = scene.view_settings
    values = [getattr(view, name, None) for name in (*_SETTINGS, *_WHITE_BALANCE)]
    curves = _curves_key(view.curve_mapping) if view.use_curve_mapping and view.curve_mapping else ()
    return (*values, scene.display_settings.display_device, *curves)


def exposure_of(scene: "bpy.types.Scene") -> float:
    """The factor that a scene's exposure is."""
    return float(2.0**scene.view_settings.exposure)


def table_of(scene: "bpy.types.Scene") -> np.ndarray | None:
    """The table of a scene's view transform; not while Blender draws."""
    view = scene.view_settings
    plain = view.view_transform == "Standard" and view.look == "None" and view.gamma == 1
    if plain and not view.use_curve_mapping and not getattr(view, "use_white_balance", False):
        return None
    x = lattice()
    blue, green, red = np.meshgrid(x, x, x, indexing="ij")
    colors = np.stack([red, green, blue], axis=-1)
    return transformed(scene, colors.reshape(SIDE, SIDE * SIDE, 3)).reshape(SIDE, SIDE, SIDE, 3)


def lattice() -> np.ndarray:
    """Radiances along each channel, (SIDE,)."""
    return (np.exp2(np.linspace(0, log2(1 + BEND * LARGEST), SIDE)) - 1) / BEND


def transformed(scene: "bpy.types.Scene", colors: np.ndarray) -> np.ndarray:
    """Display colours of radiances (height, width, 3) by a scene's view transform without its exposure.

    Data-blocks of our own are there meanwhile, and a file in a temporary folder.
    """
    height, width = colors.shape[:2]
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = colors
    with Temporary() as temporary, tempfile.TemporaryDirectory() as folder:
        own = temporary.add(bpy.data.scenes.new("Photon Bake"))
        _copy_view(scene, own)
        settings = own.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
        settings.compression, own.render.dither_intensity = 0, 0
        picture = temporary.add(bpy.data.images.new("Photon Bake", width, height, float_buffer=True))
        picture.pixels.foreach_set(pixels.reshape(-1))
        path = Path(folder) / "transformed.png"
        picture.save_render(str(path), scene=own)
        result = temporary.add(bpy.data.images.load(str(path)))
        result.colorspace_settings.name = "Non-Color"
        found = np.empty(width * height * 4, np.float32)
        result.pixels.foreach_get(found)
    return found.reshape(height, width, 4)[..., :3]


def _copy_view(scene: "bpy.types.Scene", own: "bpy.types.Scene") -> None:
    own.display_settings.display_device = scene.display_settings.display_device
    view, other = scene.view_settings, own.view_settings
    for name in (*_SETTINGS, *_WHITE_BALANCE):
        if hasattr(view, name):
            setattr(other, name, getattr(view, name))
    other.exposure = 0
    if not view.use_curve_mapping:
        return
    for curve, copy in zip(view.curve_mapping.curves, other.curve_mapping.curves, strict=True):
        while len(copy.points) < len(curve.points):
            copy.points.new(0.5, 0.5)
        for point, copied in zip(curve.points, copy.points, strict=False):
            copied.location, copied.handle_type = point.location, point.handle_type
    other.curve_mapping.black_level = view.curve_mapping.black_level
    other.curve_mapping.white_level = view.curve_mapping.white_level
    other.curve_mapping.update()


def _curves_key(mapping: Any) -> tuple[Any, ...]:
    points = [(*point.location, point.handle_type) for curve in mapping.curves for point in curve.points]
    return (*points, *mapping.black_level, *mapping.white_level)
