"""Image textures, and where their coordinates come from."""

import bpy
import numpy as np

from ..registry import case
from ..stage import missing_picture, picture
from .stage import BLUE, DARK, GROUP, RED, WHITE, coordinates, painted, quarters, spot_of, texture


@case("Image texture", GROUP)
def image():
    # The brightest quarter lies under the lamp.
    painted(lambda tree: texture(tree, quarters(DARK, RED, BLUE, WHITE)))


@case("Image texture, linear interpolation", GROUP)
def image_linear():
    # A picture of 2 × 2 pixels, which interpolation makes into a gradient without dark quarters.
    painted(lambda tree: texture(tree, [[DARK, RED], [BLUE, WHITE]], interpolation="Linear", extension="EXTEND"))


@case("Image texture, cubic interpolation", GROUP)
def image_cubic():
    painted(lambda tree: texture(tree, [[DARK, RED], [BLUE, WHITE]], interpolation="Cubic", extension="EXTEND"))


@case("Image texture, sRGB", GROUP)
def image_srgb():
    # Encoded 0.5 is 0.21 of the light.
    pixels = quarters((0.5, 0.6, 0.7), (0.5, 0.4, 0.3), (0.4, 0.4, 0.4), (0.7, 0.5, 0.5))
    painted(lambda tree: texture(tree, pixels, colorspace="sRGB"))


@case("Image texture, sRGB, linear interpolation", GROUP)
def image_srgb_linear():
    # Between black and white the bytes are interpolated, which is darker than the mean of both.
    dark, light = (0, 0, 0), (1, 1, 1)
    pixels = [[dark, light], [light, dark]]
    painted(lambda tree: texture(tree, pixels, colorspace="sRGB", interpolation="Linear"))


@case("Image texture of many pixels, sRGB, linear interpolation", GROUP)
def image_srgb_fine():
    pixels = np.zeros((300, 300, 3))
    pixels[::2, ::2], pixels[1::2, 1::2] = (1, 0.9, 0.8), (1, 0.9, 0.8)
    painted(lambda tree: texture(tree, pixels, colorspace="sRGB", interpolation="Linear"))


@case("Image texture of floats", GROUP)
def image_float():
    # Linear without being told.
    def make(tree):
        pixels = quarters((0.5, 0.6, 0.7), (0.5, 0.4, 0.3), (0.4, 0.4, 0.4), (0.7, 0.5, 0.5))
        return tree.add("TexImage", image=picture(pixels, byte=False), interpolation="Closest")

    painted(make)


@case("Image texture whose file is missing", GROUP)
def image_missing():
    # Magenta.
    painted(lambda tree: tree.add("TexImage", image=missing_picture()))


@case("Image texture by the name of a UV map", GROUP)
def image_uv_map():
    # The second UV map shows the white quarter alone.
    painted(lambda tree: texture(tree, quarters(DARK, RED, BLUE, WHITE), tree.add("UVMap", uv_map="Second")))
    add_uv_map("Second", [0.6, 0.6, 0.9, 0.6, 0.9, 0.9, 0.6, 0.9])


@case("Image texture by the render UV map", GROUP)
def image_render_uv_map():
    # The second of two maps is active for rendering, the first for editing.
    painted(lambda tree: texture(tree, quarters(DARK, RED, BLUE, WHITE)))
    add_uv_map("Second", [0.6, 0.1, 0.9, 0.1, 0.9, 0.4, 0.6, 0.4]).active_render = True


def add_uv_map(name, corners):
    """A second UV map on the floor."""
    layer = bpy.data.objects["Floor"].data.uv_layers.new(name=name)
    layer.uv.foreach_set("vector", corners)
    return layer


@case("Image texture by a UV map on points", GROUP)
def image_uv_on_points():
    # A generic 2D vector of each vertex, which shows the white quarter alone.
    painted(lambda tree: texture(tree, quarters(DARK, RED, BLUE, WHITE), tree.add("UVMap", uv_map="Second")))
    layer = bpy.data.objects["Floor"].data.attributes.new("Second", "FLOAT2", "POINT")
    layer.data.foreach_set("vector", [0.6, 0.6, 0.9, 0.6, 0.9, 0.9, 0.6, 0.9])


@case("Texture Mapping of the image's own node", GROUP)
def texture_mapping():
    # Turned by 90°, enlarged and moved, so that red and white lie under the lamp.
    def make(tree):
        node = texture(tree, quarters(DARK, RED, BLUE, WHITE))
        mapping = node.texture_mapping
        mapping.translation, mapping.rotation, mapping.scale = (0.9, 0.1, 0), (0, 0, np.pi / 2), (0.8, 0.5, 1)
        return node

    painted(make)


@case("Mapping node", GROUP)
def mapping():
    # Turned by 90°, enlarged and moved, so that red and white lie under the lamp.
    def make(tree):
        inputs = {"Vector": coordinates(tree, "UV"), "Location": (0.9, 0.1, 0), "Rotation": (0, 0, np.pi / 2)}
        turned = tree.add("Mapping", {**inputs, "Scale": (0.8, 0.5, 1)})
        return texture(tree, quarters(DARK, RED, BLUE, WHITE), turned)

    painted(make)


def twice(tree):
    """UV coordinates from −0.5 to 1.5."""
    return tree.add("Mapping", {"Vector": coordinates(tree, "UV"), "Location": (-0.5, -0.5, 0), "Scale": (2, 2, 1)})


@case("Image repeated", GROUP)
def image_repeat():
    # White around the middle, and repeated.
    painted(lambda tree: texture(tree, spot_of(DARK, (0.6, 0.8, 0.9)), twice(tree)))


@case("Image clipped", GROUP)
def image_clip():
    # Black beyond the picture.
    painted(lambda tree: texture(tree, quarters(WHITE, RED, BLUE, WHITE), twice(tree), extension="CLIP"))


@case("Image extended", GROUP)
def image_extend():
    # The colours of its edge go on, to the floor's.
    painted(lambda tree: texture(tree, spot_of(DARK, RED), twice(tree), extension="EXTEND"))


@case("Image mirrored", GROUP)
def image_mirror():
    # Every side of the picture meets its like.
    pixels = np.full((8, 8, 3), 0.02)
    pixels[:, :2] = (0.9, 0.7, 0.3)
    painted(lambda tree: texture(tree, pixels, twice(tree), extension="MIRROR"))


@case("Image by box projection", GROUP)
def image_box():
    def make(tree):
        where = coordinates(tree, "Object")
        return texture(tree, quarters(DARK, RED, BLUE, WHITE), where, projection="BOX", extension="EXTEND")

    painted(make)
