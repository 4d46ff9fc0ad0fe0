"""Volumes: media that absorb and scatter light, inside of meshes and everywhere.

A room with a lamp below its ceiling, with a medium between the lamp, the walls and the probes on them. The probes are
outside of meshes: where rays of Cycles' bakes start inside of one, they know nothing of its medium, as its renders do.
Volume bounces, none by default, are as many as the others.
"""

import bpy

from .registry import case
from .stage import box, cloud, glow, lamp, nodes, probes, quad, room, sky, world

GROUP = "Volumes"

BOTH_PHASES = "their mean; Cycles' is brighter than with either alone"
LARGE_LAMP = "all its light; in Cycles media within a lamp's radius, which it sees as a disc, get less"


def lit_room(where=lambda p: True):
    bpy.context.scene.cycles.volume_bounces = 32
    room()
    probes(n=32, where=where)
    lamp("AREA", (0.4, 0.2, 1.9), size=1.0, energy=120)


def filled(kind, inputs=None, **properties):
    """A material of a volume shader alone."""
    tree = nodes("Medium")
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], tree.add("Volume" + kind, inputs, **properties))
    return tree.block


def filled_with(density, kind="Scatter", inputs=None):
    """A material of a volume shader whose density is a node that `density` adds to its tree."""
    tree = nodes("Medium")
    shader = tree.add("Volume" + kind, (inputs or {}) | {"Density": density(tree)})
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], shader)
    return tree.block


def coordinate(tree, output, axis="Z"):
    """A coordinate of a place."""
    node = tree.add("NewGeometry") if output == "Position" else tree.add("TexCoord")
    return tree.add("SeparateXYZ", {0: node.outputs[output]}).outputs[axis]


def scaled(tree, value, by, offset=0.0):
    """A value times and plus a number, not below zero."""
    return tree.add(
        "Math", {0: tree.add("Math", {0: value, 1: by, 2: offset}, operation="MULTIPLY_ADD"), 1: 0}, operation="MAXIMUM"
    )


@case("Fog in the room (Principled Volume)", GROUP, effort=4)
def fog():
    lit_room()
    box("Fog", (0, 0, 0), (1.9, 1.9, 1.8), filled("Principled", {"Density": 0.5}))


@case("Smoke that scatters forwards", GROUP, effort=4)
def smoke_forwards():
    lit_room()
    box("Smoke", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), filled("Scatter", {"Density": 3.0, "Anisotropy": 0.8}))


@case("Smoke that scatters backwards, in a color", GROUP, effort=4)
def smoke_backwards():
    lit_room()
    smoke = filled("Scatter", {"Color": (0.9, 0.5, 0.1), "Density": 1.5, "Anisotropy": -0.5})
    box("Smoke", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), smoke)


@case("Colored water over the floor (Volume Absorption)", GROUP)
def water():
    lit_room(lambda p: p[2] > -0.4)
    box("Water", (0, 0, -1.5), (1.99, 1.99, 0.6), filled("Absorption", {"Color": (0.2, 0.6, 0.9), "Density": 1.0}))


@case("Absorption color of a Principled Volume", GROUP, effort=4)
def absorption_color():
    lit_room()
    tinted = {"Color": (0.3, 0.3, 0.3), "Density": 1.0, "Absorption Color": (0.9, 0.2, 0.1)}
    box("Fog", (0, 0, 0), (1.5, 1.5, 1.5), filled("Principled", tinted))


@case("Volume Coefficients", GROUP, effort=4)
def coefficients():
    lit_room()
    parts = {"Absorption Coefficients": (0.1, 0.4, 0.8), "Scatter Coefficients": (0.8, 0.4, 0.2), "Anisotropy": 0.3}
    box("Fog", (0, 0, 0), (1.5, 1.5, 1.5), filled("Coefficients", parts))


@case("Absorption mixed with scattering", GROUP, effort=4)
def mixed_volumes():
    lit_room()
    tree = nodes("Medium")
    parts = {0: 0.7, 1: tree.add("VolumeAbsorption", {"Color": (0.9, 0.3, 0.3), "Density": 2.0})}
    parts[2] = tree.add("VolumeScatter", {"Density": 1.5})
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], tree.add("MixShader", parts))
    box("Fog", (0, 0, 0), (1.5, 1.5, 1.5), tree.block)


@case("Fog inside of fog", GROUP, effort=4)
def nested_fog():
    lit_room()
    box("Fog", (0, 0, 0), (1.7, 1.7, 1.7), filled("Scatter", {"Density": 0.3}))
    box("Core", (0.2, 0.1, 0.2), (0.7, 0.7, 0.7), filled("Absorption", {"Color": (0.1, 0.5, 0.9), "Density": 2.0}))


@case("Glass block with a tinted interior", GROUP, effort=12)
def tinted_glass():
    lit_room()
    tree = nodes("Tinted Glass")
    output = tree.add("OutputMaterial", {"Surface": tree.add("BsdfGlass", {"Color": (1, 1, 1), "IOR": 1.33})})
    tree.feed(output.inputs["Volume"], tree.add("VolumeAbsorption", {"Color": (0.9, 0.4, 0.1), "Density": 2.0}))
    box("Glass", (0, 0, -1.2), (1.2, 1.2, 0.4), tree.block)


@case("Glowing panel in fog", GROUP, effort=8)
def panel_in_fog():
    bpy.context.scene.cycles.volume_bounces = 32
    room()
    probes(n=32)
    quad("Panel", (0, 0, 1.5), (0.4, 0, 0), (0, -0.4, 0), glow((1, 0.8, 0.5), 20))
    box("Fog", (0, 0, 0), (1.9, 1.9, 1.9), filled("Scatter", {"Density": 0.5}))


@case("Smoke under the sky", GROUP, effort=4)
def smoke_under_sky():
    bpy.context.scene.cycles.volume_bounces = 32
    room(without=("Ceiling", "Right"))
    probes("Left Front Back Floor", 32)
    world((0.6, 0.8, 1.0))
    box("Smoke", (0.5, 0, 0.5), (1.0, 1.0, 1.0), filled("Scatter", {"Density": 1.0, "Anisotropy": 0.4}))


@case("Haze of the world (Volume Scatter)", GROUP, effort=4)
def world_haze():
    lit_room()
    tree = sky()
    tree.feed(tree.add("OutputWorld").inputs["Volume"], tree.add("VolumeScatter", {"Density": 0.3}))


@case("Haze of the world, which no sun passes", GROUP, effort=4)
def world_haze_under_sun():
    lit_room()
    bpy.data.objects.remove(bpy.data.objects["Ceiling"])
    tree = sky()
    output = tree.add("OutputWorld", {"Surface": tree.add("Background", {"Strength": 1.0})})
    tree.feed(output.inputs["Volume"], tree.add("VolumeScatter", {"Density": 0.3}))
    lamp("SUN", (0, 0, 5), (0.3, 0, 0), name="Sun", energy=3)


@case("Haze by Rayleigh's phase function", GROUP, effort=4)
def rayleigh_haze():
    lit_room()
    haze = filled("Scatter", {"Color": (0.3, 0.6, 1.0), "Density": 0.8}, phase="RAYLEIGH")
    box("Haze", (0.3, 0.2, 0.2), (1.2, 1.2, 1.2), haze)


@case("Fog of droplets (Mie)", GROUP, effort=4)
def mie_fog():
    lit_room()
    fog = filled("Scatter", {"Color": (1, 1, 1), "Density": 2.0}, phase="MIE")
    fog.node_tree.nodes["Volume Scatter"].inputs["Diameter"].default_value = 3.0
    box("Fog", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), fog)


@case("Dust by Draine's phase function", GROUP, effort=4)
def draine_dust():
    lit_room()
    dust = filled("Scatter", {"Color": (0.9, 0.8, 0.6), "Density": 2.0, "Anisotropy": 0.3}, phase="DRAINE")
    dust.node_tree.nodes["Volume Scatter"].inputs["Alpha"].default_value = 5.0
    box("Dust", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), dust)


@case("Sea water (Fournier–Forand)", GROUP, effort=4)
def sea_water():
    lit_room(lambda p: p[2] > -0.4)
    water = nodes("Water")
    parts = {"Absorption Coefficients": (1.0, 0.3, 0.1), "Scatter Coefficients": (1.0, 1.2, 1.5)}
    shader = water.add("VolumeCoefficients", parts, phase="FOURNIER_FORAND")
    shader.inputs["IOR"].default_value, shader.inputs["Backscatter"].default_value = 1.2, 0.1
    water.feed(water.add("OutputMaterial").inputs["Volume"], shader)
    box("Water", (0, 0, -1.5), (1.99, 1.99, 0.6), water.block)


@case("Smoke of two phase functions, added", GROUP, effort=4, differs=BOTH_PHASES)
def two_phase_functions():
    lit_room()
    tree = nodes("Medium")
    parts = [tree.add("VolumeScatter", {"Density": 1.5, "Anisotropy": g}) for g in (0.9, -0.6)]
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], tree.add("AddShader", {0: parts[0], 1: parts[1]}))
    box("Smoke", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), tree.block)


@case("Fog that lies on the floor (density by height)", GROUP, effort=4)
def ground_fog():
    lit_room()
    fog = filled_with(lambda tree: scaled(tree, coordinate(tree, "Position"), -2.0, 0.5), "Principled")
    box("Fog", (0, 0, 0), (1.9, 1.9, 1.9), fog)


@case("Smoke of a noise texture", GROUP, effort=4)
def noise_smoke():
    lit_room()

    def density(tree):
        noise = tree.add("TexNoise", {"Scale": 1.5, "Detail": 2.0, "Vector": tree.add("TexCoord").outputs["Object"]})
        return scaled(tree, noise, 30.0, -14.0)

    box("Smoke", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), filled_with(density, "Principled", {"Anisotropy": 0.3}))


@case("Round cloud (spherical gradient), turned", GROUP, effort=4)
def round_cloud():
    lit_room()

    def density(tree):
        place = tree.add("Mapping", {"Vector": tree.add("TexCoord").outputs["Object"]})
        return scaled(tree, tree.add("TexGradient", {"Vector": place}, gradient_type="SPHERICAL").outputs[1], 8.0)

    cloud = box("Cloud", (0, 0, 0), (1.0, 1.0, 1.0), filled_with(density, "Scatter", {"Color": (0.95, 0.95, 0.95)}))
    cloud.location, cloud.rotation_euler, cloud.scale = (0.3, 0.2, 0.3), (0.5, 0.3, 0.2), (1.2, 0.9, 0.7)


@case("Absorbing ink that differs by generated coordinates", GROUP)
def ink():
    lit_room()

    def density(tree):
        return scaled(tree, coordinate(tree, "Generated", "X"), 4.0)

    box("Ink", (0, 0, -0.5), (1.2, 1.2, 0.8), filled_with(density, "Absorption", {"Color": (0.2, 0.4, 0.8)}))


@case("Column of smoke under the sky", GROUP, effort=4)
def smoke_column():
    bpy.context.scene.cycles.volume_bounces = 32
    room(without=("Ceiling", "Right"))
    probes("Left Front Back Floor", 32)
    world((0.6, 0.8, 1.0))

    def density(tree):
        away = tree.add("VectorMath", {0: tree.add("TexCoord").outputs["Object"], 1: (1, 1, 0)}, operation="MULTIPLY")
        length = tree.add("VectorMath", {0: away}, operation="LENGTH").outputs["Value"]
        return scaled(tree, length, -8.0, 5.0)

    box("Smoke", (0.2, 0.1, 0), (0.8, 0.8, 1.8), filled_with(density, "Scatter", {"Anisotropy": 0.4}))


@case("Fog of two densities, mixed by a checker", GROUP, effort=4)
def checkered_fog():
    lit_room()
    tree = nodes("Medium")
    place = tree.add("TexCoord").outputs["Object"]
    parts = {0: tree.add("TexChecker", {"Scale": 1.0, "Vector": place}).outputs[1]}
    parts |= {1: tree.add("VolumeScatter", {"Density": 0.3}), 2: tree.add("VolumeScatter", {"Density": 3.0})}
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], tree.add("MixShader", parts))
    box("Fog", (0.3, 0.2, 0.4), (1.0, 1.0, 1.0), tree.block)


@case("Lamp inside of a cloud", GROUP, effort=4)
def lamp_in_cloud():
    cloud_around_lamp(0.02)


@case("Lamp of 0.2 m inside of a cloud", GROUP, differs=LARGE_LAMP, effort=4)
def large_lamp_in_cloud():
    cloud_around_lamp(0.2)


def cloud_around_lamp(radius):
    bpy.context.scene.cycles.volume_bounces = 32
    room()
    probes(n=32)
    lamp("POINT", (0.2, 0.1, 0.1), shadow_soft_size=radius, energy=120)

    def density(tree):
        return scaled(tree, coordinate(tree, "Position"), 1.0, 0.6)

    box("Cloud", (0, 0, 0), (1.5, 1.5, 1.5), filled_with(density, "Scatter", {"Anisotropy": 0.6}))


@case("Cloud of a volume object's grid", GROUP, effort=4)
def grid_cloud():
    lit_room()

    def density(tree, x, y, z):
        length = tree.add("VectorMath", {0: tree.add("CombineXYZ", {0: x, 1: y, 2: z})}, operation="LENGTH")
        return scaled(tree, length.outputs["Value"], -6.0, 5.0)

    obj = cloud("Cloud", filled("Principled", {"Color": (0.9, 0.9, 0.9), "Density": 1.0, "Anisotropy": 0.3}), density)
    obj.location, obj.scale = (0.3, 0.2, 0.2), (1.3, 1.0, 1.1)


@case("Dark smoke of a grid by an Attribute node", GROUP, effort=4)
def grid_smoke():
    lit_room()
    tree = nodes("Medium")
    read = tree.add("Attribute", attribute_name="density").outputs["Fac"]
    shader = tree.add("VolumeAbsorption", {"Color": (0.5, 0.3, 0.2), "Density": scaled(tree, read, 3.0)})
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], shader)
    obj = cloud("Smoke", tree.block, lambda tree, x, y, z: scaled(tree, z, -0.5, 0.5))
    obj.location, obj.rotation_euler = (0.2, 0.2, 0), (0.2, 0.1, 0.6)
