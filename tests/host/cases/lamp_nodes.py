"""Lamps whose nodes make light differ by direction, by place or by distance.

IES Textures are others in Blender 4.5 than in 5.2, by up to 8 %; what a bake takes of them is each version's own.
"""

import bpy
import numpy as np

from .lamps import GROUP, LEFT, RIGHT, lit_room, plate
from .registry import case
from .stage import Nodes, box, lamp, picture, probes, room, shader

BEAM = """IESNA:LM-63-1995
TILT=NONE
1 1000 1 7 1 1 2 0 0 0
1 1 1
0 10 20 30 60 90 180
0
900 850 500 150 40 5 0
"""
"""A narrow beam along the lamp's axis, alike all around."""

WASHER = """IESNA:LM-63-1995
TILT=NONE
1 1000 1 5 5 1 2 0 0 0
1 1 1
0 30 60 90 180
0 90 180 270 360
100 100 100 100 100
200 400 900 300 20
100 50 20 10 0
200 20 10 0 0
100 100 100 100 100
"""
"""A wall washer, which throws most of its light to one side."""


def profile(text):
    """A text block of an IES profile."""
    block = bpy.data.texts.new("Profile")
    block.write(text)
    return block


def emission(light, make):
    """Make the strength of a lamp's Emission node what `make` adds to its tree."""
    tree = Nodes(light.data)
    tree.done(tree.add("Emission", {"Strength": make(tree)}), "OutputLight")
    return light


def coloured(light, make):
    """Make the colour of a lamp's Emission node what `make` adds to its tree."""
    tree = Nodes(light.data)
    tree.done(tree.add("Emission", {"Color": make(tree)}), "OutputLight")
    return light


def ies(text=BEAM, strength=1.0):
    """An IES Texture node by an internal text."""
    return lambda tree: tree.add("TexIES", {"Strength": strength}, ies=profile(text))


def on_plane(tree, scale=1.0):
    """Coordinates of a gobo: where the lamp's light crosses a plane before it."""
    normal = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["Normal"]})
    x, y = (
        tree.add("Math", {0: normal.outputs[axis], 1: normal.outputs["Z"]}, operation="DIVIDE") for axis in ("X", "Y")
    )
    plane = tree.add("CombineXYZ", {"X": x, "Y": y})
    return tree.add("Mapping", {"Vector": plane, "Scale": (scale, scale, scale), "Location": (0.5, 0.5, 0)})


def stripes(left, right):
    """An image of two colours side by side, with a dark border."""
    pixels = np.zeros((16, 16, 3))
    pixels[2:14, 2:8], pixels[2:14, 8:14] = left, right
    return picture(pixels)


@case("IES Texture on a point", GROUP, changed=(5, 2))
def ies_point():
    # Most of the light goes down.
    emission(lit_room("POINT", (-0.5, 0, 0.5), energy=20, shadow_soft_size=0), ies(strength=0.02))


@case("IES Texture on a point that is turned", GROUP, changed=(5, 2))
def ies_turned():
    # The washer throws its light at the green wall.
    light = lit_room("POINT", (0, 0, 0.5), RIGHT, energy=20, shadow_soft_size=0.1)
    emission(light, ies(WASHER, 0.05))


@case("IES Texture on a spot", GROUP, changed=(5, 2))
def ies_spot():
    light = lit_room("SPOT", (0.5, 0, 0), LEFT, energy=100, shadow_soft_size=0.02, spot_size=1.2, spot_blend=0.4)
    emission(light, ies(BEAM, 0.005))


@case("IES Texture on a sphere (soft falloff off)", GROUP, changed=(5, 2))
def ies_sphere():
    # The profile is by the direction in which light leaves, from wherever on the sphere.
    light = lit_room("POINT", (0.8, 0, 0.2), RIGHT, energy=20, shadow_soft_size=0.4, use_soft_falloff=False)
    emission(light, ies(WASHER, 0.05))


@case("IES Texture on an area lamp", GROUP, changed=(5, 2))
def ies_area():
    # A downlight that is a disk.
    light = lit_room("AREA", (0.3, 0, 0.8), shape="DISK", size=0.6, energy=20)
    emission(light, ies(BEAM, 0.01))


@case("Gobo of a Gradient Texture on a sphere, by its normal", GROUP)
def gobo_sphere():
    # Bright where its surface looks to the green wall.
    def make(tree):
        normal = tree.add("NewGeometry").outputs["Normal"]
        return tree.add("TexGradient", {"Vector": normal})

    light = lit_room("POINT", (0.5, 0, 0.2), energy=50, shadow_soft_size=0.4, use_soft_falloff=False)
    coloured(light, make)


@case("IES Texture through glass", GROUP, changed=(5, 2), effort=6)
def ies_glass():
    # A pane of glass under the lamp.
    light = lit_room("POINT", (-0.5, 0, 0.6), energy=20, shadow_soft_size=0.3, use_soft_falloff=False)
    emission(light, ies(BEAM, 0.02))
    glass = shader("BsdfGlass", {"Roughness": 0.0, "IOR": 1.45})
    box("Pane", (-0.5, 0, 0), (0.8, 0.8, 0.03), glass)


@case("IES Texture with a Vector, and a colour", GROUP, changed=(5, 2))
def ies_vector():
    # The profile is turned by a Mapping node.
    def make(tree):
        normal = tree.add("TexCoord").outputs["Normal"]
        turned = tree.add("Mapping", {"Vector": normal, "Rotation": (0, 1.2, 0)})
        node = tree.add("TexIES", {"Strength": 0.02, "Vector": turned}, ies=profile(BEAM))
        return tree.add("VectorMath", {0: node, 1: (1, 0.6, 0.3)}, operation="MULTIPLY")

    coloured(lit_room("POINT", (0, 0, 0.3), energy=20, shadow_soft_size=0), make)


@case("IES Texture, constant fall-off", GROUP, changed=(5, 2))
def ies_falloff():
    def make(tree):
        return tree.add("LightFalloff", {"Strength": ies(BEAM, 0.02)(tree)}).outputs["Constant"]

    emission(lit_room("POINT", (-0.5, 0, 1), energy=20, shadow_soft_size=0), make)


@case("Gobo of an image on a spot", GROUP)
def gobo_image():
    # The left half of the image is blue, and falls below the middle of the red wall.
    def make(tree):
        image = stripes((0.1, 0.2, 1), (1, 0.6, 0.1))
        return tree.add("TexImage", {"Vector": on_plane(tree, 0.7)}, image=image, extension="CLIP")

    light = lit_room("SPOT", (0.5, 0, 0.3), LEFT, energy=100, shadow_soft_size=0, spot_size=1.2, spot_blend=0.2)
    coloured(light, make)


@case("Gobo by the spot's UV coordinates", GROUP)
def gobo_uv():
    def make(tree):
        vector = tree.add("TexCoord").outputs["UV"]
        return tree.add("TexImage", {"Vector": vector}, image=stripes((0.1, 0.2, 1), (1, 0.6, 0.1)))

    light = lit_room("SPOT", (0.3, 0, 0), LEFT, energy=100, shadow_soft_size=0.05, spot_size=1.6, spot_blend=0)
    coloured(light, make)


@case("Gobo of a Brick Texture on a spot, scaled unevenly", GROUP)
def gobo_brick():
    def make(tree):
        colors = {"Color1": (1, 0.5, 0.2), "Color2": (0.2, 0.8, 0.3), "Mortar": (0, 0, 0), "Scale": 4.0}
        return tree.add("TexBrick", {"Vector": on_plane(tree), **colors, "Mortar Size": 0.05})

    settings = {"energy": 100, "shadow_soft_size": 0, "spot_size": 1.2, "spot_blend": 0.1}
    coloured(lit_room("SPOT", (0, 0, 1), scale=(1.8, 0.8, 1), **settings), make)


@case("Gobo of a Voronoi Texture on a point", GROUP, changed=(5, 2))
def gobo_voronoi():
    # By the direction in the world: it does not turn with the lamp.
    def make(tree):
        incoming = tree.add("NewGeometry").outputs["Incoming"]
        return tree.add("TexVoronoi", {"Vector": incoming, "Scale": 3.0}).outputs["Color"]

    coloured(lit_room("POINT", (0.3, 0, 0.3), (1, 1, -1), energy=100, shadow_soft_size=0), make)


@case("Textured area lamp", GROUP)
def area_textured():
    # Its left half is bright; the plate hides most of it from the floor.
    def make(tree):
        vector = tree.add("TexCoord").outputs["UV"]
        image = stripes((0.1, 0.2, 1), (1, 0.6, 0.1))
        return tree.add("TexImage", {"Vector": vector}, image=image, interpolation="Closest")

    coloured(lit_room("AREA", (0, 0, 0.5), shape="RECTANGLE", size=2, size_y=1, energy=100), make)
    plate((0.5, 0.2, 0.3), 0.5, 0.3)


@case("Textured disk with a spread", GROUP, effort=2)
def area_disk_textured():
    def make(tree):
        uv = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["UV"]})
        return tree.add("Math", {0: uv.outputs["X"], 1: 2.0}, operation="POWER")

    light = lit_room("AREA", (0, 0, 0.5), shape="DISK", size=1.5, energy=100, spread=1.5)
    emission(light, make)
    plate((0.5, 0, 0.3), 0.4, 0.7)


@case("Area lamp whose light differs by direction", GROUP)
def area_direction():
    # More to its side: 1 − cos θ, by Incoming and the normal.
    def make(tree):
        geometry = tree.add("NewGeometry")
        inputs = {0: geometry.outputs["Incoming"], 1: geometry.outputs["Normal"]}
        cosine = tree.add("VectorMath", inputs, operation="DOT_PRODUCT").outputs["Value"]
        return tree.add("Math", {0: 1.0, 1: cosine}, operation="SUBTRACT")

    emission(lit_room("AREA", (0, 0, 0.8), shape="SQUARE", size=0.6, energy=100), make)


@case("A sun with nodes", GROUP)
def sun_nodes():
    # Its colour comes through a Hue/Saturation node and a texture that is the same over its disc.
    def make(tree):
        noise = tree.add("TexNoise", {"Scale": 0.1}).outputs["Color"]
        return tree.add("HueSaturation", {"Color": noise, "Saturation": 3.0})

    room(without=["Front"])
    probes("Left Right Back Floor Ceiling")
    coloured(lamp("SUN", (0, -5, 0), (0, 0, -1), energy=5, angle=0.05), make)


@case("Light Falloff, constant", GROUP)
def falloff_constant():
    # The far walls get as much as the near one.
    def make(tree):
        return tree.add("LightFalloff", {"Strength": 1.0}).outputs["Constant"]

    emission(lit_room("POINT", (-1.4, 0, 0.3), energy=20, shadow_soft_size=0.1), make)


@case("Light Falloff, linear, of an area lamp", GROUP)
def falloff_linear():
    def make(tree):
        return tree.add("LightFalloff", {"Strength": 2.0}).outputs["Linear"]

    emission(lit_room("AREA", (-1.4, 0, 0.3), RIGHT, size=0.5, energy=50), make)


@case("Light Falloff, smooth", GROUP)
def falloff_smooth():
    # Close to the red wall, where smoothing counts most.
    def make(tree):
        return tree.add("LightFalloff", {"Strength": 1.0, "Smooth": 1.0}).outputs["Quadratic"]

    emission(lit_room("POINT", (-1.6, 0, 0.3), energy=100, shadow_soft_size=0), make)


@case("Light Falloff through a math node, of a spot", GROUP)
def falloff_spot():
    def make(tree):
        falloff = tree.add("LightFalloff", {"Strength": 1.0, "Smooth": 0.5}).outputs["Linear"]
        return tree.add("Math", {0: falloff, 1: 1.5}, operation="MULTIPLY")

    light = lit_room("SPOT", (0.5, 0, 0), LEFT, energy=100, shadow_soft_size=0.05, spot_size=1.2, spot_blend=0.5)
    emission(light, make)
