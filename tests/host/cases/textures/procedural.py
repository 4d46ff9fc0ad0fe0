"""Procedural textures, coordinates of objects, groups."""

import bpy

from ..registry import case
from ..stage import lamp, matte, probes, room, tinted
from .stage import BLUE, GROUP, RED, WHITE, coordinates, mix, painted, quarters, texture


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
