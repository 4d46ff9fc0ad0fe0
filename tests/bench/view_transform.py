"""Measures what the table of live light's view transform is off by between its points, in steps of 8 bits.

    python tests/bench/run.py --only view_transform

The table is looked up as the shader does it, and compared with Blender's own colour management.
"""

import bpy
import numpy as np
from figures import table
from photon_bake.addon.blender.viewport.view_transform import BEND, LARGEST, SIDE, table_of, transformed
from scipy.ndimage import map_coordinates

VIEWS = [("Standard", "None"), ("Filmic", "None"), ("AgX", "None"), ("AgX", "AgX - High Contrast")]
VIEWS += [("Khronos PBR Neutral", "None")]
DARKEST, BRIGHTEST = -8.0, 6.5  # stops from middle grey


def colors(shape=(64, 1024)):
    """Random radiances, some grey and some saturated."""
    random = np.random.default_rng(1)
    grey = 0.18 * 2 ** random.uniform(DARKEST, BRIGHTEST, (*shape, 1))
    return grey * random.uniform(0, 1, (*shape, 3)) ** random.uniform(0, 2, (*shape, 1))


def looked_up(values, radiance):
    """Linear between the table's points; without one, Standard as it is computed."""
    if values is None:
        x = np.minimum(radiance, 1)
        return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    at = np.minimum(np.log2(1 + BEND * radiance) / np.log2(1 + BEND * LARGEST), 1) * (SIDE - 1)
    places = np.moveaxis(at[..., ::-1], -1, 0)  # by blue, green and red
    return np.stack([map_coordinates(values[..., channel], places, order=1) for channel in range(3)], axis=-1)


def tables(*_):
    """A Markdown table."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, radiance, rows = bpy.context.scene, colors(), []
    for view, look in VIEWS:
        scene.view_settings.view_transform, scene.view_settings.look = view, look
        off = 255 * np.abs(looked_up(table_of(scene), radiance) - transformed(scene, radiance))
        rows.append([f"{view}, {look}", f"{off.mean():.2f}", f"{np.quantile(off, 0.99):.1f}", f"{off.max():.1f}"])
    title = f"View transforms of live light, over {radiance.size // 3:,} colors, steps of 8 bits"
    return [table(title, ["View transform, look", "Mean", "99 %", "Most"], rows)]
