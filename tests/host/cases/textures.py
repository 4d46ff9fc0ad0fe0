"""Colours from textures, attributes and maths, on a floor under a lamp that lights its middle most."""

import bpy
import numpy as np

from .registry import case
from .stage import lamp, matte, missing_picture, picture, probes, room, tinted

GROUP = "Textures and colours"

RED, BLUE, WHITE, DARK = (0.8, 0.2, 0.1), (0.1, 0.2, 0.8), (0.9, 0.9, 0.9), (0.02, 0.02, 0.02)


def painted(make):
    """The dim room with a matte floor, whose colour is the node or socket that `make` adds to a tree."""
    room(paint={"Floor": tinted(make)}, dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("AREA", (0.3, 0.2, 0), size=0.8, energy=100)


def quarters(*colors):
    """An image of four colours: below left and right, above left and right."""
    return np.array(colors, float).reshape(2, 2, 3).repeat(4, axis=0).repeat(4, axis=1)


def spot_of(color, around):
    """An image with a square of one colour in the middle, a quarter of its area."""
    pixels = np.empty((8, 8, 3))
    pixels[:] = around
    pixels[2:6, 2:6] = color
    return pixels


def texture(tree, pixels, vector=None, colorspace="Non-Color", **properties):
    """An image texture node; the pixels are the colours as they are, unless `colorspace` says otherwise."""
    properties = {"interpolation": "Closest", **properties}
    node = tree.add("TexImage", image=picture(pixels, colorspace=colorspace), **properties)
    if vector is not None:
        tree.feed(node.inputs["Vector"], vector)
    return node


def coordinates(tree, kind):
    return tree.add("TexCoord").outputs[kind]


def mix(tree, blend, factor, first, second):
    """A Mix Color node's result."""
    node = tree.add("Mix", data_type="RGBA", blend_type=blend)
    for index, value in ((0, factor), (6, first), (7, second)):
        tree.feed(node.inputs[index], value)
    return node.outputs[2]


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


@case("Checker Texture", GROUP)
def checker():
    # Three fields a side, on UV coordinates.
    def make(tree):
        inputs = {"Vector": coordinates(tree, "UV"), "Color1": RED, "Color2": BLUE, "Scale": 3.0}
        return tree.add("TexChecker", inputs)

    painted(make)


@case("Brick Texture", GROUP)
def brick():
    def make(tree):
        colors = {"Color1": (0.8, 0.3, 0.1), "Color2": (0.6, 0.2, 0.1), "Mortar": (0.1, 0.2, 0.6)}
        sizes = {"Scale": 3.0, "Mortar Size": 0.06, "Mortar Smooth": 0.0}
        return tree.add("TexBrick", {"Vector": coordinates(tree, "UV"), **colors, **sizes})

    painted(make)


@case("Noise Texture", GROUP)
def noise():
    # Through a steep ramp: patches of red and blue.
    def make(tree):
        patches = tree.add("TexNoise", {"Vector": coordinates(tree, "UV"), "Scale": 4.0, "Detail": 2.0})
        ramp = tree.add("ValToRGB", {"Fac": patches.outputs[0]})
        elements = ramp.color_ramp.elements
        elements[0].position, elements[0].color = 0.5, (*RED, 1)
        elements[1].position, elements[1].color = 0.55, (*BLUE, 1)
        return ramp

    painted(make)


@case("Voronoi Texture", GROUP, since=(5, 0))
def voronoi():
    # The distance to scattered points, as a grey. Cycles 4.5 scatters them otherwise: a tenth less light.
    def make(tree):
        return tree.add("TexVoronoi", {"Vector": coordinates(tree, "UV"), "Scale": 3.0}).outputs["Distance"]

    painted(make)


@case("Wave Texture", GROUP)
def wave():
    def make(tree):
        rings = {"wave_type": "RINGS", "rings_direction": "Z"}
        waves = tree.add("TexWave", {"Vector": coordinates(tree, "Object"), "Scale": 0.5}, **rings)
        return mix(tree, "MIX", waves.outputs["Fac"], RED, BLUE)

    painted(make)


@case("Gradient Texture", GROUP)
def gradient():
    def make(tree):
        ball = tree.add("TexGradient", {"Vector": coordinates(tree, "Object")}, gradient_type="RADIAL")
        return mix(tree, "MIX", ball.outputs["Fac"], RED, BLUE)

    painted(make)


@case("Magic Texture", GROUP)
def magic():
    def make(tree):
        return tree.add("TexMagic", {"Vector": coordinates(tree, "UV"), "Scale": 1.0, "Distortion": 1.5})

    painted(make)


@case("White Noise", GROUP)
def white_noise():
    # A grey for each of 12 × 12 fields.
    def make(tree):
        fields = tree.add("VectorMath", {0: coordinates(tree, "UV"), 1: (1 / 12, 1 / 12, 1)}, operation="SNAP")
        return tree.add("TexWhiteNoise", {"Vector": fields}).outputs["Color"]

    painted(make)


@case("Object coordinates", GROUP)
def object_coordinates():
    # A checker of metres.
    def make(tree):
        inputs = {"Vector": coordinates(tree, "Object"), "Color1": RED, "Color2": BLUE, "Scale": 0.7}
        return tree.add("TexChecker", inputs)

    painted(make)
    floor = bpy.data.objects["Floor"]
    floor.location.z, floor.rotation_euler.z = -0.001, 0.4  # the coordinates turn with the floor
    floor.scale = (1.5, 1.5, 1)


@case("Object coordinates of another object", GROUP)
def other_object_coordinates():
    def make(tree):
        where = tree.add("TexCoord", object=bpy.data.objects["Back"])
        bpy.data.objects["Back"].location = (0.4, 0, 0)
        inputs = {"Vector": where.outputs["Object"], "Color1": RED, "Color2": BLUE, "Scale": 0.7}
        return tree.add("TexChecker", inputs)

    room(dim=0.5)
    bpy.data.objects["Floor"].data.materials[0] = tinted(make)
    probes("Left Right Front Back Ceiling", 32)
    lamp("AREA", (0.3, 0.2, 0), size=0.8, energy=100)


@case("Generated coordinates", GROUP)
def generated_coordinates():
    # From 0 to 1 across the floor, whatever its place.
    def make(tree):
        where = tree.add("SeparateXYZ", {"Vector": coordinates(tree, "Generated")})
        return mix(tree, "MIX", where.outputs["X"], RED, BLUE)

    painted(make)


@case("Position (Geometry)", GROUP)
def position():
    def make(tree):
        where = tree.add("NewGeometry").outputs["Position"]
        inputs = {"Vector": where, "Color1": RED, "Color2": BLUE, "Scale": 0.6}
        return tree.add("TexChecker", inputs)

    painted(make)
    bpy.data.objects["Floor"].location = (0.3, 0.2, 0)
    bpy.data.objects["Floor"].scale = (1.3, 1.3, 1)


@case("Normal (Geometry)", GROUP)
def normal():
    # Up is blue: a colour of (0, 0, 1) and a little of each.
    def make(tree):
        up = tree.add("NewGeometry").outputs["Normal"]
        return tree.add("VectorMath", {0: up, 1: (0.5, 0.4, 0.6), 2: (0.2, 0.1, 0.1)}, operation="MULTIPLY_ADD")

    painted(make)


@case("Colours in a node group", GROUP)
def color_group():
    # A group in a group doubles a colour and halves its red.
    inner = bpy.data.node_groups.new("Double", "ShaderNodeTree")
    inner.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    factor = inner.nodes.new("ShaderNodeVectorMath")
    factor.operation = "MULTIPLY"
    factor.inputs[1].default_value = (1, 2, 2)
    inner.links.new(start.outputs[0], factor.inputs[0])
    inner.links.new(factor.outputs[0], end.inputs[0])

    def make(tree):
        node = tree.add("Group", node_tree=inner)
        tree.feed(node.inputs[0], texture(tree, quarters(RED, RED, (0.1, 0.2, 0.4), RED)))
        return node

    painted(make)


@case("A colour through a muted node and a reroute", GROUP)
def muted():
    # Invert is muted: its colour goes through.
    def make(tree):
        inverted = tree.add("Invert", {"Color": texture(tree, quarters(RED, WHITE, BLUE, RED))})
        inverted.mute = True
        reroute = tree.tree.nodes.new("NodeReroute")
        tree.feed(reroute.inputs[0], inverted)
        return reroute

    painted(make)


@case("An override of the view layer's material", GROUP)
def material_override():
    # The walls' colours do not count: all surfaces are blue.
    painted(lambda tree: texture(tree, quarters(RED, RED, RED, RED)))
    bpy.context.view_layer.material_override = matte(BLUE, "Override")
