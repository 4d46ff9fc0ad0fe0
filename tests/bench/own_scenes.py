"""Scenes of our own, built by code: a room lit through its window, houses round a courtyard, a hall of many lamps;
and the hard interiors of own_interiors.py.

Lengths in metres, z up. Boxes stand side by side as bricks do, so that no light gets in where it should not.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import radians

import bpy  # isort: skip  (the module brings mathutils)
import numpy as np
from mathutils import Vector
from own_interiors import glazed, stairs
from scene_parts import ball, box, column, house, lamp, material, matte, sun, table, turned_box, wall_with_hole


@dataclass(frozen=True)
class OwnScene:
    """What builds a scene, and the box (2, 3) of it in which an artist would look."""

    build: Callable[[], None]
    region: tuple[tuple[float, float, float], tuple[float, float, float]]


def build(name):
    """Replace Blender's scene by one of `OWN_SCENES`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    OWN_SCENES[name].build()
    bpy.context.view_layer.update()


# --- the scenes ------------------------------------------------------------------------------------------------------


def _window():
    """A room of 6 × 4 m: sun and sky come in by one window, the floor is varnished."""
    white, red, green = (
        matte("White", 0.78, 0.76, 0.72),
        matte("Red", 0.6, 0.1, 0.07),
        matte("Green", 0.2, 0.45, 0.2),
    )
    varnish = material("Varnish", (0.42, 0.26, 0.14), roughness=0.35, specular=0.5)
    box("Floor", (-0.2, -0.2, -0.2), (6.2, 4.2, 0), varnish)
    box("Ceiling", (-0.2, -0.2, 2.8), (6.2, 4.2, 3), white)
    wall_with_hole("Window Wall", 0, (-0.2, 0), (-0.2, 4.2), (0, 2.8), (1.0, 2.8, 0.8, 2.3), white)
    box("East Wall", (6, -0.2, 0), (6.2, 4.2, 2.8), white)
    box("South Wall", (0, -0.2, 0), (6, 0, 2.8), red)
    box("North Wall", (0, 4, 0), (6, 4.2, 2.8), green)
    box("Post", (-0.13, 1.87, 0.8), (-0.07, 1.93, 2.3), white)
    box("Bar", (-0.13, 1.0, 1.6), (-0.07, 1.87, 1.65), white)
    box("Sill", (0, 0.9, 0.74), (0.2, 2.9, 0.78), white)
    _furnish_room()
    box("Ground", (-40, -40, -0.6), (40, 40, -0.3), matte("Grass", 0.2, 0.26, 0.1))
    sun((-0.75, 0.2, 0.55), 5.0, sky=1.2)


def _furnish_room():
    oak, blue, clay = matte("Oak", 0.5, 0.33, 0.18), matte("Blue", 0.12, 0.2, 0.5), matte("Clay", 0.7, 0.5, 0.35)
    table("Table", (2.2, 1.2), (1.6, 0.9, 0.74), oak)
    table("Stool", (1.4, 2.4), (0.4, 0.4, 0.45), oak)
    table("Bench", (2.3, 2.45), (1.3, 0.4, 0.45), oak)
    box("Bed", (3.9, 2.0, 0.12), (5.9, 4, 0.5), blue)
    box("Headboard", (5.9, 1.9, 0), (6, 4, 1), oak)
    for i, z in enumerate((0.05, 0.5, 0.95, 1.4, 1.85)):
        box(f"Shelf {i + 1}", (4.05, 0, z), (5.55, 0.35, z + 0.03), oak)
    for i, x in enumerate((4.0, 5.55)):
        box(f"Side {i + 1}", (x, 0, 0), (x + 0.05, 0.35, 1.95), oak)
    for i, (x, z) in enumerate(product((4.2, 4.7, 5.2), (0.08, 0.53, 0.98))):
        box(f"Books {i + 1}", (x, 0.05, z), (x + 0.25, 0.28, z + 0.28), (clay, blue)[i % 2])
    ball("Vase", (2.7, 1.6, 0.92), 0.18, clay)
    turned_box("Chest", (0.6, 3.5, 0.25), (0.8, 0.5, 0.5), 15, clay)


def _outdoor():
    """Houses, an arcade, steps and trees round a courtyard of 16 × 16 m under sun and sky."""
    plaster, ochre, stone = (
        matte("Plaster", 0.75, 0.7, 0.6),
        matte("Ochre", 0.6, 0.4, 0.15),
        matte("Stone", 0.4, 0.4, 0.38),
    )
    tiles = matte("Tiles", 0.5, 0.17, 0.09)
    box("Ground", (-60, -60, -0.5), (60, 60, 0), matte("Gravel", 0.35, 0.3, 0.24))
    for i, (x, y, width, depth, height, paint) in enumerate(
        [
            (-12, 0, 6, 14, 5, plaster),
            (12, -2, 6, 10, 6, ochre),
            (-1, -12, 14, 6, 4.5, plaster),
            (11, 10, 8, 6, 4, plaster),
        ]
    ):
        house(f"House {i + 1}", (x, y), (width, depth, height), paint, tiles)
    box("Arcade Roof", (-8, 9, 3), (6, 12, 3.3), stone)
    box("Arcade Wall", (-8, 12, 0), (6, 12.4, 3.3), ochre)
    for i, x in enumerate(np.linspace(-7.6, 5.6, 7)):
        column(f"Column {i + 1}", (x, 9.3), 0.2, 3, stone)
    for i in range(6):
        box(f"Step {i + 1}", (5.4 + 0.3 * i, -4, 0), (5.7 + 0.3 * i if i < 5 else 9, -1, 0.16 * (i + 1)), stone)
    column("Well", (-1, 1), 0.9, 0.8, stone)
    for i, (x, y) in enumerate([(-4, -4), (3, 5)]):
        column(f"Trunk {i + 1}", (x, y), 0.15, 2.2, matte("Bark", 0.2, 0.14, 0.09))
        ball(f"Crown {i + 1}", (x, y, 3.2), 1.4, matte("Leaves", 0.12, 0.3, 0.08))
    for i, y in enumerate((-2, 2)):
        table(f"Bench {i + 1}", (-7.5, y), (0.5, 1.8, 0.45), matte("Oak", 0.5, 0.33, 0.18))
    sun((-0.5, -0.6, 0.75), 6.0, sky=0.6)


def _lamps():
    """A hall of six rooms of 8 × 8 m with sixty lamps: ten of four kinds in each room."""
    white, floor = matte("White", 0.75, 0.75, 0.73), matte("Concrete", 0.35, 0.34, 0.33)
    box("Floor", (-0.3, -0.3, -0.3), (24.3, 16.3, 0), floor)
    box("Ceiling", (-0.3, -0.3, 3.5), (24.3, 16.3, 3.8), white)
    for name, low, high in [
        ("West", (-0.3, -0.3), (0, 16.3)),
        ("East", (24, -0.3), (24.3, 16.3)),
        ("South", (0, -0.3), (24, 0)),
        ("North", (0, 16), (24, 16.3)),
    ]:
        box(f"{name} Wall", (*low, 0), (*high, 3.5), white)
    paints = [matte("Brick", 0.55, 0.2, 0.12), matte("Teal", 0.1, 0.35, 0.38), matte("Yellow", 0.65, 0.5, 0.12)]
    for i, (x, (y, end)) in enumerate(product((8, 16), ((0, 7.9), (8.1, 16)))):
        door = (y + 3, y + 4.2, 0, 2.2)
        wall_with_hole(f"Partition {i + 1}", 0, (x - 0.1, x + 0.1), (y, end), (0, 3.5), door, paints[i % 3])
    for i, x in enumerate((0, 8, 16)):
        wall_with_hole(f"Spine {i + 1}", 1, (7.9, 8.1), (x, x + 8), (0, 3.5), (x + 5, x + 6.2, 0, 2.2), paints[i])
    colors = [(1, 0.75, 0.5), (1, 1, 1), (0.6, 0.8, 1), (1, 0.85, 0.7), (0.9, 1, 0.8), (1, 0.6, 0.4)]
    random = np.random.default_rng(5)
    for i, (x, y) in enumerate(product((0, 8, 16), (0, 8))):
        _furnish_hall(f"{i + 1}", x, y, random, [*paints, white])
        _light_hall(f"{i + 1}", x, y, colors[i])


def _furnish_hall(name, x, y, random, paints):
    """Crates and a table in the room whose corner is at x, y."""
    for i in range(6):
        size = random.uniform(0.4, 1.1, 3)
        across, along = random.uniform(1.2, 6.8, 2)
        place = (x + across, y + along, size[2] / 2)
        turned_box(f"Crate {name}.{i + 1}", place, size, random.uniform(0, 90), paints[i % len(paints)])
    table(f"Table {name}", (x + 3.5, y + 1.2), (1.8, 0.8, 0.75), paints[0])


def _light_hall(name, x, y, color):
    for i, (across, along) in enumerate(product((2.5, 5.5), (2, 6))):
        lamp(f"Bulb {name}.{i + 1}", "POINT", (x + across, y + along, 2.6), 8, color, shadow_soft_size=0.05)
    for i, across in enumerate((2.5, 5.5)):
        lamp(f"Panel {name}.{i + 1}", "AREA", (x + across, y + 4, 3.45), 20, (1, 1, 1), shape="SQUARE", size=0.6)
    lamp(f"Disk {name}", "AREA", (x + 4, y + 2, 3.4), 15, color, shape="DISK", size=0.4)
    for i, (across, along) in enumerate(((1, 1), (7, 7), (1, 7))):
        down = Vector(((across - 4) / 6, (along - 4) / 6, -1.5))
        spot = {"spot_size": radians(70), "spot_blend": 0.3, "shadow_soft_size": 0.04}
        lamp(f"Spot {name}.{i + 1}", "SPOT", (x + across, y + along, 3.2), 40, color, towards=down, **spot)


OWN_SCENES = {
    "window": OwnScene(_window, ((0, 0, 0), (6, 4, 2.8))),
    "outdoor": OwnScene(_outdoor, ((-9.05, -9.05, 0), (9.05, 12, 6))),
    "lamps": OwnScene(_lamps, ((0, 0, 0), (24, 16, 3.5))),
    "glazed": OwnScene(glazed, ((0, 0, 0), (5, 4, 2.7))),
    "stairs": OwnScene(stairs, ((0, 0, 0), (6, 5, 5.6))),
}
