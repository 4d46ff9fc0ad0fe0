"""Attributes, and what nodes make of colours and numbers."""

import bpy
import numpy as np

from ..registry import case
from .stage import BLUE, DARK, GROUP, RED, WHITE, coordinates, mix, painted, quarters, spot_of, texture


@case("Colour attribute", GROUP)
def color_attribute():
    # Corners of four colours; red and white are nearest to the lamp.
    painted(lambda tree: tree.add("VertexColor", layer_name="Paint"))
    colors = np.ones((4, 4), np.float32)
    colors[:, :3] = (DARK, RED, WHITE, BLUE)
    layer = bpy.data.objects["Floor"].data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    layer.data.foreach_set("color", colors.ravel())


@case("Attribute node, on points", GROUP)
def point_attribute():
    def make(tree):
        return tree.add("Attribute", attribute_name="Heat").outputs["Color"]

    painted(make)
    layer = bpy.data.objects["Floor"].data.attributes.new("Heat", "FLOAT_VECTOR", "POINT")
    layer.data.foreach_set("vector", np.array([DARK, RED, WHITE, BLUE], np.float32).ravel())


@case("Attribute node, of the object", GROUP)
def object_attribute():
    def make(tree):
        return tree.add("Attribute", attribute_name="paint", attribute_type="OBJECT").outputs["Color"]

    painted(make)
    bpy.data.objects["Floor"]["paint"] = (0.8, 0.3, 0.1)


@case("Attribute node, of the view layer", GROUP)
def view_layer_attribute():
    def make(tree):
        return tree.add("Attribute", attribute_name="paint", attribute_type="VIEW_LAYER").outputs["Color"]

    painted(make)
    bpy.context.scene["paint"] = (0.8, 0.3, 0.1)


@case("Object Info, the object's colour", GROUP)
def object_color():
    painted(lambda tree: tree.add("ObjectInfo").outputs["Color"])
    bpy.data.objects["Floor"].color = (0.8, 0.3, 0.1, 1)


@case("Mix Color: multiply", GROUP)
def mix_multiply():
    painted(lambda tree: mix(tree, "MULTIPLY", 0.7, texture(tree, quarters(RED, WHITE, BLUE, WHITE)), (0.9, 0.5, 0.2)))


@case("Mix Color: mix by a texture", GROUP)
def mix_textured():
    painted(lambda tree: mix(tree, "MIX", texture(tree, spot_of((1, 1, 1), (0, 0, 0))), RED, BLUE))


@case("Mix Color: overlay, screen, difference", GROUP)
def mix_blends():
    def make(tree):
        one = mix(tree, "OVERLAY", 0.8, texture(tree, quarters(RED, WHITE, BLUE, WHITE)), (0.3, 0.5, 0.7))
        two = mix(tree, "SCREEN", 0.5, one, (0.3, 0.2, 0.1))
        return mix(tree, "DIFFERENCE", 0.9, two, (0.2, 0.3, 0.1))

    painted(make)


@case("Hue/Saturation/Value", GROUP)
def hue_saturation():
    def make(tree):
        inputs = {"Hue": 0.7, "Saturation": 0.8, "Value": 1.2, "Color": texture(tree, quarters(RED, RED, BLUE, RED))}
        return tree.add("HueSaturation", inputs)

    painted(make)


@case("RGB Curves", GROUP)
def rgb_curves():
    # Halves the red, and lifts the blue.
    def make(tree):
        node = tree.add("RGBCurve", {"Color": texture(tree, quarters(RED, WHITE, BLUE, WHITE))})
        node.mapping.curves[0].points[1].location = (1, 0.5)
        node.mapping.curves[2].points[0].location = (0, 0.4)
        node.mapping.update()
        return node

    painted(make)


@case("Color Ramp", GROUP)
def color_ramp():
    # Across the floor, in the order of red, white, blue.
    def make(tree):
        ramp = tree.add("ValToRGB", {"Fac": tree.add("SeparateXYZ", {"Vector": coordinates(tree, "UV")})})
        elements = ramp.color_ramp.elements
        elements[0].color, elements[1].color = (*RED, 1), (*BLUE, 1)
        elements.new(0.6).color = (*WHITE, 1)
        return ramp

    painted(make)


@case("Color Ramp, constant", GROUP)
def color_ramp_constant():
    def make(tree):
        ramp = tree.add("ValToRGB", {"Fac": tree.add("SeparateXYZ", {"Vector": coordinates(tree, "UV")})})
        ramp.color_ramp.interpolation = "CONSTANT"
        elements = ramp.color_ramp.elements
        elements[0].color, elements[1].color = (*RED, 1), (*BLUE, 1)
        elements[1].position = 0.8
        return ramp

    painted(make)


@case("Gamma and Brightness/Contrast", GROUP)
def gamma():
    def make(tree):
        dark = tree.add("Gamma", {"Color": texture(tree, quarters(RED, WHITE, BLUE, WHITE)), "Gamma": 2.2})
        return tree.add("BrightContrast", {"Color": dark, "Bright": 0.1, "Contrast": 0.2})

    painted(make)


@case("Invert", GROUP)
def invert():
    painted(lambda tree: tree.add("Invert", {"Fac": 0.9, "Color": texture(tree, quarters(RED, RED, BLUE, BLUE))}))


@case("Math and Combine Color", GROUP)
def math():
    def make(tree):
        across = tree.add("SeparateXYZ", {"Vector": coordinates(tree, "UV")})
        wave = tree.add("Math", {0: tree.add("Math", {0: across, 1: 12.0}, operation="MULTIPLY")}, operation="SINE")
        red = tree.add("Math", {0: wave, 1: 0.4, 2: 0.5}, operation="MULTIPLY_ADD")
        return tree.add("CombineColor", {"Red": red, "Green": 0.3, "Blue": across.outputs["Y"]})

    painted(make)


@case("Map Range, Clamp, Separate Color", GROUP)
def map_range():
    def make(tree):
        parts = tree.add("SeparateColor", {"Color": texture(tree, quarters(RED, WHITE, BLUE, WHITE))})
        inputs = {"Value": parts, "From Min": 0.2, "From Max": 0.8, "To Min": 0.7, "To Max": 0.2}
        red = tree.add("MapRange", inputs)
        blue = tree.add("Clamp", {"Value": parts.outputs["Blue"], "Min": 0.3, "Max": 0.5})
        return tree.add("CombineColor", {"Red": red, "Green": parts.outputs["Green"], "Blue": blue})

    painted(make)


@case("Vector Math", GROUP)
def vector_math():
    # Coordinates as colours, folded.
    def make(tree):
        scaled = tree.add("VectorMath", {0: coordinates(tree, "UV"), 1: (3, 2, 1)}, operation="MULTIPLY")
        return tree.add("VectorMath", {0: scaled}, operation="FRACTION")

    painted(make)


@case("Blackbody and RGB to BW", GROUP)
def blackbody():
    def make(tree):
        grey = tree.add("RGBToBW", {"Color": texture(tree, quarters(RED, WHITE, BLUE, WHITE))})
        warm = tree.add("Blackbody", {"Temperature": 3000.0})
        return mix(tree, "MULTIPLY", 1.0, grey, mix(tree, "DIVIDE", 1.0, warm, (3, 3, 3)))

    painted(make)
