"""Scenes of our own, built by code: a room lit through its window, houses round a courtyard, a hall of many lamps.

Lengths in metres, z up. Boxes stand side by side as bricks do, so that no light gets in where it should not.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import pi, radians

import bpy  # isort: skip  (the module brings mathutils)
import numpy as np
from mathutils import Matrix, Vector


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
        _matte("White", 0.78, 0.76, 0.72),
        _matte("Red", 0.6, 0.1, 0.07),
        _matte("Green", 0.2, 0.45, 0.2),
    )
    varnish = _material("Varnish", (0.42, 0.26, 0.14), roughness=0.35, specular=0.5)
    _box("Floor", (-0.2, -0.2, -0.2), (6.2, 4.2, 0), varnish)
    _box("Ceiling", (-0.2, -0.2, 2.8), (6.2, 4.2, 3), white)
    _wall_with_hole("Window Wall", 0, (-0.2, 0), (-0.2, 4.2), (0, 2.8), (1.0, 2.8, 0.8, 2.3), white)
    _box("East Wall", (6, -0.2, 0), (6.2, 4.2, 2.8), white)
    _box("South Wall", (0, -0.2, 0), (6, 0, 2.8), red)
    _box("North Wall", (0, 4, 0), (6, 4.2, 2.8), green)
    _box("Post", (-0.13, 1.87, 0.8), (-0.07, 1.93, 2.3), white)
    _box("Bar", (-0.13, 1.0, 1.6), (-0.07, 1.87, 1.65), white)
    _box("Sill", (0, 0.9, 0.74), (0.2, 2.9, 0.78), white)
    _furnish_room()
    _box("Ground", (-40, -40, -0.6), (40, 40, -0.3), _matte("Grass", 0.2, 0.26, 0.1))
    _sun((-0.75, 0.2, 0.55), 5.0, sky=1.2)


def _furnish_room():
    oak, blue, clay = _matte("Oak", 0.5, 0.33, 0.18), _matte("Blue", 0.12, 0.2, 0.5), _matte("Clay", 0.7, 0.5, 0.35)
    _table("Table", (2.2, 1.2), (1.6, 0.9, 0.74), oak)
    _table("Stool", (1.4, 2.4), (0.4, 0.4, 0.45), oak)
    _table("Bench", (2.3, 2.45), (1.3, 0.4, 0.45), oak)
    _box("Bed", (3.9, 2.0, 0.12), (5.9, 4, 0.5), blue)
    _box("Headboard", (5.9, 1.9, 0), (6, 4, 1), oak)
    for i, z in enumerate((0.05, 0.5, 0.95, 1.4, 1.85)):
        _box(f"Shelf {i + 1}", (4.05, 0, z), (5.55, 0.35, z + 0.03), oak)
    for i, x in enumerate((4.0, 5.55)):
        _box(f"Side {i + 1}", (x, 0, 0), (x + 0.05, 0.35, 1.95), oak)
    for i, (x, z) in enumerate(product((4.2, 4.7, 5.2), (0.08, 0.53, 0.98))):
        _box(f"Books {i + 1}", (x, 0.05, z), (x + 0.25, 0.28, z + 0.28), (clay, blue)[i % 2])
    _ball("Vase", (2.7, 1.6, 0.92), 0.18, clay)
    _turned_box("Chest", (0.6, 3.5, 0.25), (0.8, 0.5, 0.5), 15, clay)


def _outdoor():
    """Houses, an arcade, steps and trees round a courtyard of 16 × 16 m under sun and sky."""
    plaster, ochre, stone = (
        _matte("Plaster", 0.75, 0.7, 0.6),
        _matte("Ochre", 0.6, 0.4, 0.15),
        _matte("Stone", 0.4, 0.4, 0.38),
    )
    tiles = _matte("Tiles", 0.5, 0.17, 0.09)
    _box("Ground", (-60, -60, -0.5), (60, 60, 0), _matte("Gravel", 0.35, 0.3, 0.24))
    for i, (x, y, width, depth, height, paint) in enumerate(
        [
            (-12, 0, 6, 14, 5, plaster),
            (12, -2, 6, 10, 6, ochre),
            (-1, -12, 14, 6, 4.5, plaster),
            (11, 10, 8, 6, 4, plaster),
        ]
    ):
        _house(f"House {i + 1}", (x, y), (width, depth, height), paint, tiles)
    _box("Arcade Roof", (-8, 9, 3), (6, 12, 3.3), stone)
    _box("Arcade Wall", (-8, 12, 0), (6, 12.4, 3.3), ochre)
    for i, x in enumerate(np.linspace(-7.6, 5.6, 7)):
        _column(f"Column {i + 1}", (x, 9.3), 0.2, 3, stone)
    for i in range(6):
        _box(f"Step {i + 1}", (5.4 + 0.3 * i, -4, 0), (5.7 + 0.3 * i if i < 5 else 9, -1, 0.16 * (i + 1)), stone)
    _column("Well", (-1, 1), 0.9, 0.8, stone)
    for i, (x, y) in enumerate([(-4, -4), (3, 5)]):
        _column(f"Trunk {i + 1}", (x, y), 0.15, 2.2, _matte("Bark", 0.2, 0.14, 0.09))
        _ball(f"Crown {i + 1}", (x, y, 3.2), 1.4, _matte("Leaves", 0.12, 0.3, 0.08))
    for i, y in enumerate((-2, 2)):
        _table(f"Bench {i + 1}", (-7.5, y), (0.5, 1.8, 0.45), _matte("Oak", 0.5, 0.33, 0.18))
    _sun((-0.5, -0.6, 0.75), 6.0, sky=0.6)


def _lamps():
    """A hall of six rooms of 8 × 8 m with sixty lamps: ten of four kinds in each room."""
    white, floor = _matte("White", 0.75, 0.75, 0.73), _matte("Concrete", 0.35, 0.34, 0.33)
    _box("Floor", (-0.3, -0.3, -0.3), (24.3, 16.3, 0), floor)
    _box("Ceiling", (-0.3, -0.3, 3.5), (24.3, 16.3, 3.8), white)
    for name, low, high in [
        ("West", (-0.3, -0.3), (0, 16.3)),
        ("East", (24, -0.3), (24.3, 16.3)),
        ("South", (0, -0.3), (24, 0)),
        ("North", (0, 16), (24, 16.3)),
    ]:
        _box(f"{name} Wall", (*low, 0), (*high, 3.5), white)
    paints = [_matte("Brick", 0.55, 0.2, 0.12), _matte("Teal", 0.1, 0.35, 0.38), _matte("Yellow", 0.65, 0.5, 0.12)]
    for i, (x, (y, end)) in enumerate(product((8, 16), ((0, 7.9), (8.1, 16)))):
        door = (y + 3, y + 4.2, 0, 2.2)
        _wall_with_hole(f"Partition {i + 1}", 0, (x - 0.1, x + 0.1), (y, end), (0, 3.5), door, paints[i % 3])
    for i, x in enumerate((0, 8, 16)):
        _wall_with_hole(f"Spine {i + 1}", 1, (7.9, 8.1), (x, x + 8), (0, 3.5), (x + 5, x + 6.2, 0, 2.2), paints[i])
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
        _turned_box(f"Crate {name}.{i + 1}", place, size, random.uniform(0, 90), paints[i % len(paints)])
    _table(f"Table {name}", (x + 3.5, y + 1.2), (1.8, 0.8, 0.75), paints[0])


def _light_hall(name, x, y, color):
    for i, (across, along) in enumerate(product((2.5, 5.5), (2, 6))):
        _lamp(f"Bulb {name}.{i + 1}", "POINT", (x + across, y + along, 2.6), 8, color, shadow_soft_size=0.05)
    for i, across in enumerate((2.5, 5.5)):
        _lamp(f"Panel {name}.{i + 1}", "AREA", (x + across, y + 4, 3.45), 20, (1, 1, 1), shape="SQUARE", size=0.6)
    _lamp(f"Disk {name}", "AREA", (x + 4, y + 2, 3.4), 15, color, shape="DISK", size=0.4)
    for i, (across, along) in enumerate(((1, 1), (7, 7), (1, 7))):
        down = Vector(((across - 4) / 6, (along - 4) / 6, -1.5))
        spot = {"spot_size": radians(70), "spot_blend": 0.3, "shadow_soft_size": 0.04}
        _lamp(f"Spot {name}.{i + 1}", "SPOT", (x + across, y + along, 3.2), 40, color, towards=down, **spot)


OWN_SCENES = {
    "window": OwnScene(_window, ((0, 0, 0), (6, 4, 2.8))),
    "outdoor": OwnScene(_outdoor, ((-9.05, -9.05, 0), (9.05, 12, 6))),
    "lamps": OwnScene(_lamps, ((0, 0, 0), (24, 16, 3.5))),
}


# --- what they are made of -------------------------------------------------------------------------------------------

_BOX = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def _box(name, low, high, material):
    """A box from corner to corner, facing outward."""
    return _object(name, list(product(*zip(low, high, strict=True))), _BOX, material)


def _turned_box(name, middle, size, degrees, material):
    box = _box(name, -np.array(size) / 2, np.array(size) / 2, material)
    box.matrix_world = Matrix.Translation(middle) @ Matrix.Rotation(radians(degrees), 4, "Z")


def _table(name, corner, size, material):
    """A board on four legs."""
    (x, y), (width, depth, height), leg = corner, size, 0.06
    _box(f"{name} Top", (x, y, height - 0.04), (x + width, y + depth, height), material)
    for i, (across, along) in enumerate(product((x, x + width - leg), (y, y + depth - leg))):
        _box(f"{name} Leg {i + 1}", (across, along, 0), (across + leg, along + leg, height - 0.04), material)


def _wall_with_hole(name, axis, thick, length, up, hole, material):
    """Four boxes, or three where the hole reaches the floor; axis 0: the wall runs along y, 1: along x."""
    start, end, bottom, top = hole
    parts = [(length[0], start, *up), (end, length[1], *up), (start, end, top, up[1]), (start, end, up[0], bottom)]
    for i, (a, b, low, high) in enumerate(parts):
        if low < high:
            flat = [(thick[0], a), (thick[1], b)] if axis == 0 else [(a, thick[0]), (b, thick[1])]
            _box(f"{name} {i + 1}", (*flat[0], low), (*flat[1], high), material)


def _house(name, middle, size, paint, tiles):
    """A box under a gable roof that overhangs by half a metre, its ridge along y."""
    (x, y), (width, depth, height) = middle, size
    _box(name, (x - width / 2, y - depth / 2, 0), (x + width / 2, y + depth / 2, height), paint)
    a, b, ridge = width / 2 + 0.5, depth / 2 + 0.5, height + width / 3
    roof = [(x + s * a, y + t * b, height) for t in (-1, 1) for s in (-1, 1)] + [(x, y - b, ridge), (x, y + b, ridge)]
    _object(f"{name} Roof", roof, [(0, 2, 3, 1), (0, 1, 4), (1, 3, 5, 4), (3, 2, 5), (2, 0, 4, 5)], tiles)


def _column(name, middle, radius, height, material, n=24):
    """A cylinder, its sides smooth."""
    angle = np.arange(n) * 2 * pi / n
    ring = np.stack([middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle)], axis=1)
    vertices = [(*at, z) for z in (0, height) for at in ring.tolist()]
    sides = [(i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n)]
    _object(name, vertices, [*sides, tuple(range(n))[::-1], tuple(range(n, 2 * n))], material)


def _ball(name, middle, radius, material, n=32, n_rings=15):
    """A smooth ball; Blender's own numbers its vertices otherwise each time."""
    latitude, longitude = np.meshgrid(
        np.arange(1, n_rings + 1) * pi / (n_rings + 1), np.arange(n) * 2 * pi / n, indexing="ij"
    )
    around = np.stack(
        [np.sin(latitude) * np.cos(longitude), np.sin(latitude) * np.sin(longitude), np.cos(latitude)], axis=-1
    )
    vertices = np.concatenate([around.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]]) * radius + middle
    top, bottom, nexts = n * n_rings, n * n_rings + 1, np.roll(np.arange(n), -1)
    faces = [
        (i + r * n, i + r * n + n, nexts[i] + r * n + n, nexts[i] + r * n) for r in range(n_rings - 1) for i in range(n)
    ]
    faces += [(i, nexts[i], top) for i in range(n)] + [
        (nexts[i] + bottom - 1 - n, i + bottom - 1 - n, bottom) for i in range(n)
    ]
    _object(name, vertices, faces, material).data.shade_smooth()


def _object(name, vertices, faces, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], [tuple(map(int, face)) for face in faces])
    mesh.materials.append(material)
    return _placed(bpy.data.objects.new(name, mesh))


def _placed(thing):
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _lamp(name, kind, location, watts, color, towards=(0, 0, -1), **settings):
    lamp = bpy.data.lights.new(name, kind)
    lamp.energy, lamp.color = watts, color
    for key, value in settings.items():
        setattr(lamp, key, value)
    thing = _placed(bpy.data.objects.new(name, lamp))
    thing.location, thing.rotation_euler = location, Vector(towards).to_track_quat("-Z", "Y").to_euler()


def _sun(towards_sun, strength, sky):
    """A sun of so many W/m², and a blue sky, brighter at the horizon."""
    _lamp("Sun", "SUN", (0, 0, 20), strength, (1, 0.9, 0.75), towards=-Vector(towards_sun), angle=radians(1))
    world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
    _use_nodes(world)
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    nodes.clear()
    place, apart, mix = (nodes.new(f"ShaderNode{kind}") for kind in ("TexCoord", "SeparateXYZ", "Mix"))
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    mix.data_type = "RGBA"
    mix.inputs[6].default_value, mix.inputs[7].default_value = (0.9, 0.95, 1, 1), (0.2, 0.4, 0.9, 1)
    background.inputs["Strength"].default_value = sky
    link(place.outputs["Generated"], apart.inputs[0])
    link(apart.outputs["Z"], mix.inputs[0])
    link(mix.outputs[2], background.inputs["Color"])
    link(background.outputs[0], output.inputs["Surface"])


def _matte(name, *color):
    return _material(name, color, roughness=1, specular=0)


def _material(name, color, roughness, specular):
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        _use_nodes(material)
        principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        principled.inputs["Base Color"].default_value = (*color, 1)
        principled.inputs["Roughness"].default_value = roughness
        principled.inputs["Specular IOR Level"].default_value = specular
    return material


def _use_nodes(owner):
    """Give a material or world its nodes; from Blender 5 on it always has them."""
    if bpy.app.version < (5, 0):
        owner.use_nodes = True
