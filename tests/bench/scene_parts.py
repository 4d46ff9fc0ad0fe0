"""What the benchmark's own scenes are made of: boxes, tables, walls with holes, lamps, a sky, materials.

Lengths in metres, z up.
"""

from itertools import product
from math import pi, radians

import bpy  # isort: skip  (the module brings mathutils)
import numpy as np
from mathutils import Matrix, Vector

BOX_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def box(name, low, high, material):
    """A box from corner to corner, facing outward."""
    return mesh_object(name, list(product(*zip(low, high, strict=True))), BOX_FACES, material)


def turned_box(name, middle, size, degrees, material):
    turned = box(name, -np.array(size) / 2, np.array(size) / 2, material)
    turned.matrix_world = Matrix.Translation(middle) @ Matrix.Rotation(radians(degrees), 4, "Z")


def table(name, corner, size, material):
    """A board on four legs."""
    (x, y), (width, depth, height), leg = corner, size, 0.06
    box(f"{name} Top", (x, y, height - 0.04), (x + width, y + depth, height), material)
    for i, (across, along) in enumerate(product((x, x + width - leg), (y, y + depth - leg))):
        box(f"{name} Leg {i + 1}", (across, along, 0), (across + leg, along + leg, height - 0.04), material)


def room(size, floor, walls, west, east):
    """A closed room from the origin to x, y, z = `size`, of boxes 20 cm thick; `walls` paints the ceiling, too."""
    (x, y, z), t = size, 0.2
    for name, low, high, paint in [
        ("Floor", (-t, -t, -t), (x + t, y + t, 0), floor),
        ("Ceiling", (-t, -t, z), (x + t, y + t, z + t), walls),
        ("West", (-t, -t, 0), (0, y + t, z), west),
        ("East", (x, -t, 0), (x + t, y + t, z), east),
        ("South", (0, -t, 0), (x, 0, z), walls),
        ("North", (0, y, 0), (x, y + t, z), walls),
    ]:
        box(name, low, high, paint)


def wall_with_hole(name, axis, thick, length, up, hole, material):
    """Four boxes, or three where the hole reaches the floor; axis 0: the wall runs along y, 1: along x."""
    start, end, bottom, top = hole
    parts = [(length[0], start, *up), (end, length[1], *up), (start, end, top, up[1]), (start, end, up[0], bottom)]
    for i, (a, b, low, high) in enumerate(parts):
        if low < high:
            flat = [(thick[0], a), (thick[1], b)] if axis == 0 else [(a, thick[0]), (b, thick[1])]
            box(f"{name} {i + 1}", (*flat[0], low), (*flat[1], high), material)


def house(name, middle, size, paint, tiles):
    """A box under a gable roof that overhangs by half a metre, its ridge along y."""
    (x, y), (width, depth, height) = middle, size
    box(name, (x - width / 2, y - depth / 2, 0), (x + width / 2, y + depth / 2, height), paint)
    a, b, ridge = width / 2 + 0.5, depth / 2 + 0.5, height + width / 3
    roof = [(x + s * a, y + t * b, height) for t in (-1, 1) for s in (-1, 1)] + [(x, y - b, ridge), (x, y + b, ridge)]
    mesh_object(f"{name} Roof", roof, [(0, 2, 3, 1), (0, 1, 4), (1, 3, 5, 4), (3, 2, 5), (2, 0, 4, 5)], tiles)


def column(name, middle, radius, top, material, n=24, bottom=0):
    """A cylinder, its sides smooth."""
    angle = np.arange(n) * 2 * pi / n
    ring = np.stack([middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle)], axis=1)
    vertices = [(*at, z) for z in (bottom, top) for at in ring.tolist()]
    sides = [(i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n)]
    mesh_object(name, vertices, [*sides, tuple(range(n))[::-1], tuple(range(n, 2 * n))], material)


def ball(name, middle, radius, material, n=32, n_rings=15):
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
    mesh_object(name, vertices, faces, material).data.shade_smooth()


def mesh_object(name, vertices, faces, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], [tuple(map(int, face)) for face in faces])
    mesh.materials.append(material)
    return placed(bpy.data.objects.new(name, mesh))


def placed(thing):
    bpy.context.scene.collection.objects.link(thing)
    return thing


def lamp(name, kind, location, watts, color, towards=(0, 0, -1), **settings):
    lamp = bpy.data.lights.new(name, kind)
    lamp.energy, lamp.color = watts, color
    for key, value in settings.items():
        setattr(lamp, key, value)
    thing = placed(bpy.data.objects.new(name, lamp))
    thing.location, thing.rotation_euler = location, Vector(towards).to_track_quat("-Z", "Y").to_euler()


def sun(towards_sun, strength, sky):
    """A sun of so many W/m², and a blue sky, brighter at the horizon."""
    lamp("Sun", "SUN", (0, 0, 20), strength, (1, 0.9, 0.75), towards=-Vector(towards_sun), angle=radians(1))
    world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
    use_nodes(world)
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


def matte(name, *color):
    return material(name, color, roughness=1, specular=0)


def material(name, color, roughness, specular):
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        use_nodes(material)
        principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        principled.inputs["Base Color"].default_value = (*color, 1)
        principled.inputs["Roughness"].default_value = roughness
        principled.inputs["Specular IOR Level"].default_value = specular
    return material


def use_nodes(owner):
    """Give a material or world its nodes; from Blender 5 on it always has them."""
    if bpy.app.version < (5, 0):
        owner.use_nodes = True
