"""Shading normals: Normal Map and Bump nodes, coats and lobes with normals of their own."""

import bpy
import numpy as np
from mathutils import Matrix

from ..registry import case
from ..stage import box, lamp, mesh, nodes, picture, probes, quad, room
from .stage import GROUP, divided, shiny_floor


def lean(angle, towards=(-1, 0)):
    """The colour of a normal map that leans by an angle."""
    return 0.5 + 0.5 * np.sin(angle) * towards[0], 0.5 + 0.5 * np.sin(angle) * towards[1], 0.5 + 0.5 * np.cos(angle)


def one_colour(color):
    return np.full((4, 4, 3), color)


def tiles(tilt=0.9, n=4):
    """A normal map of n² tiles, each of which leans another way."""
    k = np.arange(n * n)
    x, y = np.sin(tilt) * np.cos(2.4 * k), np.sin(tilt) * np.sin(2.4 * k)
    normals = np.stack([x, y, np.full(n * n, np.cos(tilt))], axis=1).reshape(n, n, 3)
    return (0.5 + 0.5 * normals).repeat(4, axis=0).repeat(4, axis=1)


def mapped(tree, pixels, strength=1.0, vector=None, **properties):
    """A Normal Map node of a picture."""
    image = tree.add("TexImage", image=picture(pixels, colorspace="Non-Color"), interpolation="Closest")
    if vector is not None:
        tree.feed(image.inputs["Vector"], vector)
    return tree.add("NormalMap", {"Color": image, "Strength": strength}, **properties)


def lit_floor(make, dim=0.5, energy=100):
    """The dim room with a floor whose shader a function adds to a tree, and a lamp over its left half."""
    tree = nodes()
    room(paint={"Floor": tree.done(make(tree))}, dim=dim)
    probes("Left Right Front Back Ceiling", 40)
    lamp("AREA", (-1.0, 0.3, 0.2), (0.3, 0, -2), size=0.8, energy=energy)


def white(tree, normal):
    return tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Normal": normal})


def placed(material, turn=(0.0, 0.0, 0.0), scale=(1, 1, 1)):
    """The dim room with a floor of another object's mesh, turned and scaled."""
    room(without=("Floor",), dim=0.5)
    floor = quad("Floor", (0, 0, 0), (1, 0, 0), (0, 1, 0), material)
    floor.matrix_world = Matrix.LocRotScale((0, 0, -2), None, scale) @ Matrix.Rotation(turn[2], 4, "Z")
    probes("Left Right Front Back Ceiling", 40)
    lamp("AREA", (-1.0, 0.3, 0.2), (0.3, 0, -2), size=0.8, energy=100)


@case("Normal map", GROUP)
def normal_map():
    # Leans the floor by 40° to the red wall.
    tree = nodes("Tiles")
    pixels = np.full((4, 4, 3), (0.5 - 0.5 * np.sin(0.7), 0.5, 0.5 + 0.5 * np.cos(0.7)))
    image = tree.add("TexImage", image=picture(pixels, colorspace="Non-Color"))
    bumped = tree.add("NormalMap", {"Color": image})
    floor = tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Normal": bumped}))
    room(paint={"Floor": floor}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)


@case("Bump", GROUP, into_image=True)
def bump():
    # A slope of 45° without a slope.
    tree = nodes("Plaster")
    height = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["Object"]})
    bumped = tree.add("Bump", {"Height": height, "Distance": 1.0})
    floor = tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Normal": bumped}))
    room(paint={"Floor": floor}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)


@case("Normal map of half strength", GROUP)
def normal_map_half():
    lit_floor(lambda tree: white(tree, mapped(tree, one_colour(lean(0.9)), 0.5)))


@case("Normal map of double strength", GROUP)
def normal_map_double():
    lit_floor(lambda tree: white(tree, mapped(tree, one_colour(lean(0.4)), 2.0)))


@case("Normal map of tiles, repeated", GROUP)
def normal_map_tiles():
    def make(tree):
        mapping = tree.add("Mapping", {"Vector": tree.add("TexCoord").outputs["UV"], "Scale": (3, 3, 3)})
        return white(tree, mapped(tree, tiles(), vector=mapping))

    lit_floor(make)


@case("Normal map, object space", GROUP)
def normal_map_object():
    # Turned by 90° and mirrored.
    tree = nodes()
    material = tree.done(white(tree, mapped(tree, one_colour(lean(0.8, (0, -1))), 0.8, space="OBJECT")))
    placed(material, (0, 0, np.pi / 2), (2, -2, 2))


@case("Normal map, world space", GROUP)
def normal_map_world():
    lit_floor(lambda tree: white(tree, mapped(tree, one_colour(lean(0.8, (0.6, 0.8))), 1.0, space="WORLD")))


@case("Normal map, Blender's object space", GROUP)
def normal_map_blender():
    color = lean(0.8)
    flipped = (color[0], 1 - color[1], 1 - color[2])
    lit_floor(lambda tree: white(tree, mapped(tree, one_colour(flipped), 1.0, space="BLENDER_OBJECT")))


@case("Normal map on mirrored halves of a UV map, by name", GROUP)
def normal_map_mirrored():
    tree = nodes()
    material = tree.done(white(tree, mapped(tree, one_colour(lean(0.9)), uv_map="Mirrored")))
    room(without=("Floor",), dim=0.5)
    x = [-2, 0, 2]
    vertices = [(a, b, -2) for b in (-2, 2) for a in x]
    floor = mesh("Floor", vertices, [(0, 1, 4, 3), (1, 2, 5, 4)], material)
    floor.data.uv_layers.new(name="UVMap")
    mirrored = floor.data.uv_layers.new(name="Mirrored")
    mirrored.uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1, 1, 0, 0, 0, 0, 1, 1, 1])
    probes("Left Right Front Back Ceiling", 40)
    lamp("AREA", (0, 0.3, 0.2), (0, 0, -2), size=0.8, energy=100)


@case("Normal map on a smooth ball", GROUP)
def normal_map_smooth():
    tree = nodes()
    material = tree.done(white(tree, mapped(tree, tiles(0.7))))
    room(dim=0.5)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, radius=0.9, location=(0, 0, -0.9))
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material)
    probes("Left Right Front Back", 40)
    lamp("AREA", (0, 0, 1.5), size=0.6, energy=100)


@case("Normal map on rough metal", GROUP, effort=6)
def normal_map_metal():
    tree = nodes()
    inputs = {"Base Color": (0.9, 0.6, 0.3), "Metallic": 1.0, "Roughness": 0.4}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", {**inputs, "Normal": mapped(tree, tiles(0.5))})))


@case("Normal map on plastic", GROUP, effort=2)
def normal_map_plastic():
    tree = nodes()
    inputs = {"Base Color": (0.6, 0.3, 0.2), "Roughness": 0.3, "Normal": mapped(tree, tiles(0.6))}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Normal map on rough glass", GROUP, effort=4)
def normal_map_glass():
    tree = nodes()
    glass = {"Color": (0.9, 0.95, 1.0), "Roughness": 0.3, "IOR": 1.45, "Normal": mapped(tree, tiles(0.4))}
    room()
    probes(n=48, where=lambda p: p[0] > 0.3)
    material = tree.done(tree.add("BsdfGlass", glass))
    pane = box("Pane", (0, 0, 0), (0.1, 2.1, 2.1), material)
    pane.data.uv_layers.new(name="UVMap")
    lamp("AREA", (-1.8, 0, 0), (0, 0, 0), size=2.5, energy=300)


@case("Diffuse of one normal map and gloss of another", GROUP, effort=2)
def normal_maps_of_lobes():
    tree = nodes()
    base = tree.add("BsdfDiffuse", {"Color": (0.7, 0.4, 0.2), "Normal": mapped(tree, one_colour(lean(0.8)))})
    gloss = {"Color": (0.8, 0.8, 0.8), "Roughness": 0.5, "Normal": mapped(tree, one_colour(lean(0.5, (1, 0))))}
    parts = {"Fac": 0.5, 1: base, 2: tree.add("BsdfAnisotropic", gloss)}
    shiny_floor(tree.done(tree.add("MixShader", parts)))


@case("Normals by vector nodes", GROUP)
def normal_vectors():
    def make(tree):
        wave = tree.add("VectorMath", {0: tree.add("TexCoord").outputs["Object"], 1: (3, 2, 0)}, operation="MULTIPLY")
        sine = tree.add("VectorMath", {0: wave}, operation="SINE")
        return white(tree, tree.add("VectorMath", {0: sine, 1: (0, 0, 1.5)}, operation="ADD"))

    lit_floor(make)


def slope_picture():
    """Stripes of slopes up and down, 64 texels wide, as a height between 0 and 1."""
    ramp = np.concatenate([np.linspace(0, 1, 24), np.linspace(1, 0, 8)])
    return np.repeat(np.tile(ramp, 2)[None, :, None], 8, axis=0).repeat(3, axis=2)


@case("Bump of an image", GROUP, into_image=True)
def bump_image():
    # Long slopes that face the lamp, short ones that face away.
    def make(tree):
        height = tree.add("TexImage", image=picture(slope_picture(), colorspace="Non-Color", byte=False))
        return white(tree, tree.add("Bump", {"Height": height, "Distance": 0.6, "Strength": 1.0}))

    lit_floor(make)


@case("Bump of an image, half strength and inverted", GROUP, into_image=True)
def bump_image_inverted():
    def make(tree):
        height = tree.add("TexImage", image=picture(slope_picture(), colorspace="Non-Color", byte=False))
        bump = tree.add("Bump", {"Height": height, "Distance": 0.8, "Strength": 0.5}, invert=True)
        return white(tree, bump)

    lit_floor(make)


@case("Bump of a noise", GROUP, into_image=True)
def bump_noise():
    def make(tree):
        noise = tree.add("TexNoise", {"Vector": tree.add("TexCoord").outputs["Object"], "Scale": 2.0, "Detail": 1.0})
        return white(tree, tree.add("Bump", {"Height": noise.outputs[0], "Distance": 0.8}))

    lit_floor(make)


@case("Bump chained after a normal map", GROUP, into_image=True)
def bump_chained():
    def make(tree):
        wave = tree.add("TexWave", {"Vector": tree.add("TexCoord").outputs["Object"], "Scale": 0.6})
        normal = mapped(tree, one_colour(lean(0.5)))
        return white(tree, tree.add("Bump", {"Height": wave.outputs["Fac"], "Distance": 0.3, "Normal": normal}))

    lit_floor(make)


@case("Normal map on an object that is scaled unevenly", GROUP)
def normal_map_scaled():
    tree = nodes()
    placed(tree.done(white(tree, mapped(tree, one_colour(lean(1.0))))), (0, 0, 0.6), (2, 2, 0.7))


@case("Normal map on a back-lit leaf", GROUP, effort=2)
def normal_map_leaf():
    # Reflects and transmits, seen from both sides.
    tree = nodes()
    normal = mapped(tree, tiles(0.8))
    both = {
        1: tree.add("BsdfDiffuse", {"Color": (0.2, 0.6, 0.1), "Normal": normal}),
        2: tree.add("BsdfTranslucent", {"Color": (0.5, 0.8, 0.2), "Normal": normal}),
    }
    divided(tree.done(tree.add("MixShader", {"Fac": 0.5, **both})))
