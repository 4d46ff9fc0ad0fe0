"""Lamps of every kind and setting. The room's left wall is red and its right wall green, so colours tell directions."""

import bpy

from .registry import case
from .stage import Nodes, box, lamp, matte, probes, put, quad, room, shader

GROUP = "Lamps"
BLACK = (0, 0, 0)
DOWN, LEFT, RIGHT = (0, 0, -2), (-2, 0, 0), (2, 0, 0)


def plate(at, half_x, half_y):
    """A black plate under a lamp."""
    quad("Plate", at, (half_x, 0, 0), (0, half_y, 0), matte(BLACK, "Black"))


def frame(hole, z, half=1.0):
    """A black plate with a square hole of side 2 × hole in its middle."""
    wide = (half - hole) / 2
    black = matte(BLACK, "Black")
    for x, y, half_x, half_y in (
        (hole + wide, 0, wide, half),
        (-hole - wide, 0, wide, half),
        (0, hole + wide, hole, wide),
        (0, -hole - wide, hole, wide),
    ):
        quad("Frame", (x, y, z), (half_x, 0, 0), (0, half_y, 0), black)


def lit_room(*args, **settings):
    """The closed room with one lamp."""
    room()
    probes()
    return lamp(*args, **settings)


def collection_of(*objects):
    """A collection outside the scene, for linking lights."""
    collection = bpy.data.collections.new("Linked")
    for obj in objects:
        collection.objects.link(obj)
    return collection


@case("Point, radius 0", GROUP)
def point():
    # The inverse square: most of the light falls on the red wall, which is near.
    lit_room("POINT", (-1.2, 0.2, 0.3), energy=100, shadow_soft_size=0)


@case("Point with a radius", GROUP)
def point_radius():
    # The plate keeps a quarter of the light of a point away; a disc of this radius shines past it.
    lit_room("POINT", (0, 0, 0), energy=100, shadow_soft_size=0.5)
    plate((0, 0, -0.15), 0.3, 0.3)


@case("Point with a radius, soft falloff off", GROUP)
def point_sphere():
    # The plate keeps a disc from the floor, and not the lower part of a sphere.
    lit_room("POINT", (0, 0, 0), energy=100, shadow_soft_size=0.4, use_soft_falloff=False)
    plate((0, 0, -0.15), 0.6, 0.6)


@case("Point, Normalize off", GROUP, since=(5, 0))
def point_not_normalized():
    # Four times the light of a normalized lamp of this radius and power.
    lit_room("POINT", energy=20, shadow_soft_size=0.4, normalize=False)


@case("Spot, radius 0, blend 0", GROUP)
def spot():
    # The cone falls on the red wall alone.
    lit_room("SPOT", (0.5, 0, 0), LEFT, energy=100, shadow_soft_size=0, spot_size=1, spot_blend=0)


@case("Spot with a radius", GROUP, effort=2)
def spot_radius():
    # The hole lets a third less of the light of a wide lamp through than of a point.
    lit_room("SPOT", (0, 0, 1), DOWN, energy=100, shadow_soft_size=0.4, spot_size=1.5, spot_blend=0)
    frame(0.15, 0.5)


@case("Spot with a radius, soft falloff off", GROUP)
def spot_sphere():
    # The plate hides a disc, and not the lower part of a sphere.
    settings = {"shadow_soft_size": 0.4, "spot_size": 2.4, "spot_blend": 0, "use_soft_falloff": False}
    lit_room("SPOT", (0, 0, 0), DOWN, energy=100, **settings)
    plate((0, 0, -0.15), 0.6, 0.6)


@case("Spot, blend 0.5", GROUP)
def spot_blend():
    # The blend takes a third of the cone's light.
    lit_room("SPOT", (0.5, 0, 0), LEFT, energy=100, shadow_soft_size=0, spot_size=1.2, spot_blend=0.5)


@case("Spot, a wide cone with blend 1", GROUP)
def spot_wide():
    # The cone reaches the walls beside it; the blend makes it half as bright.
    lit_room("SPOT", (0.5, 0, 0), LEFT, energy=100, shadow_soft_size=0, spot_size=2.9, spot_blend=1)


@case("Spot, scaled unevenly", GROUP)
def spot_elliptical():
    # A cone wide to the red and green walls, and narrow to the grey ones.
    lit_room("SPOT", (0, 0, 1), DOWN, scale=(3, 0.4, 1), energy=100, shadow_soft_size=0, spot_size=1.2, spot_blend=0)


@case("Sun, angle 0", GROUP)
def sun():
    # Straight onto the green wall through the open front.
    room(without=["Front"])
    probes("Left Right Back Floor Ceiling")
    lamp("SUN", (0, -5, 0), (3, 0, -1), energy=5, angle=0)


@case("Sun, a large angle", GROUP)
def sun_wide():
    # A small sun above would light the floor alone, and this one lights the coloured walls too.
    room(without=["Ceiling"])
    probes("Left Right Front Back Floor")
    lamp("SUN", (0, 0, 5), energy=5, angle=2.2)


@case("Sun, Normalize off", GROUP, since=(5, 0))
def sun_not_normalized():
    # π sin²(angle / 2) = 0.19 of a normalized sun's light.
    room(without=["Ceiling"])
    probes("Left Right Front Back Floor")
    lamp("SUN", (0, 0, 5), energy=20, angle=0.5, normalize=False)


@case("Area, square", GROUP)
def area_square():
    # Half the light meets the frame.
    lit_room("AREA", (0, 0, 0.5), shape="SQUARE", size=1, energy=100)
    frame(0.36, 0.45)


@case("Area, rectangle", GROUP)
def area_rectangle():
    # The plate hides less than half of it, and would hide a square lamp of its area.
    lit_room("AREA", (0, 0, 0.5), shape="RECTANGLE", size=2, size_y=0.2, energy=100)
    plate((0, 0, 0.45), 0.5, 0.5)


@case("Area, disk", GROUP)
def area_disk():
    # A quarter more of it than of a square lies over the hole.
    lit_room("AREA", (0, 0, 0.5), shape="DISK", size=1, energy=100)
    frame(0.36, 0.45)


@case("Area, ellipse", GROUP)
def area_ellipse():
    # More of it than of a rectangle or a circle lies over the hole.
    lit_room("AREA", (0, 0, 0.5), shape="ELLIPSE", size=1.4, size_y=0.6, energy=100)
    frame(0.36, 0.45)


@case("Area with a spread of 40°", GROUP, effort=2)
def area_spread():
    # All of it falls on the green wall.
    lit_room("AREA", (-0.5, 0, 0), RIGHT, size=0.6, energy=100, spread=0.7)


@case("Area, Normalize off", GROUP, since=(5, 0))
def area_not_normalized():
    # Four times the light of a normalized lamp, by its area.
    lit_room("AREA", (0, 0, 1), size=2, energy=20, normalize=False)


@case("Area, unevenly scaled by its parent", GROUP)
def area_parented():
    # Scaled to 2 × 0.3: the plate would hide the square lamp, and hides less than half of the long one.
    light = lit_room("AREA", size=1, energy=100)
    light.parent = put("Parent", None)
    light.parent.location, light.parent.scale = (0, 0, 0.5), (2, 0.3, 1)
    plate((0, 0, 0.45), 0.5, 0.5)


@case("Coloured lamp", GROUP)
def coloured():
    lit_room("POINT", energy=100, color=(1, 0.5, 0.1), shadow_soft_size=0.1)


@case("Exposure", GROUP)
def exposure():
    lit_room("POINT", energy=100, exposure=-1.5, shadow_soft_size=0.1)


@case("Temperature", GROUP)
def temperature():
    lit_room("POINT", energy=100, use_temperature=True, temperature=3000, shadow_soft_size=0.1)


@case("Strength and colour by the lamp's nodes", GROUP)
def lamp_nodes():
    light = lit_room("POINT", energy=100, shadow_soft_size=0.1)
    tree = Nodes(light.data)
    tree.done(tree.add("Emission", {"Color": (0.2, 0.6, 1), "Strength": 2.5}), "OutputLight")


@case("Blackbody in the lamp's nodes", GROUP)
def lamp_blackbody():
    light = lit_room("POINT", energy=100, shadow_soft_size=0.1)
    tree = Nodes(light.data)
    tree.done(tree.add("Emission", {"Color": tree.add("Blackbody", {"Temperature": 2500.0})}), "OutputLight")


@case("One light group", GROUP, light_group="Key")
def light_group():
    # Two lamps, of which the blue one is in the group.
    layer = bpy.context.view_layer
    layer.lightgroups.add(name="Key")
    lit_room("POINT", (1, 0, 0), energy=100, color=(0.1, 0.3, 1), name="Key").lightgroup = "Key"
    lamp("POINT", (-1, 0, 0), energy=100, color=(1, 0.3, 0.1), name="Fill")


@case("Light linking to a receiver", GROUP)
def light_linking():
    # The lamp lights the red wall alone.
    light = lit_room("POINT", energy=100, shadow_soft_size=0.1)
    light.light_linking.receiver_collection = collection_of(bpy.data.objects["Left"])


@case("Shadow linking to a blocker", GROUP)
def shadow_linking():
    # Of two plates that keep the lamp from the floor and the ceiling, one casts a shadow.
    light = lit_room("POINT", energy=100, shadow_soft_size=0)
    plate((0, 0, -0.2), 0.8, 0.8)
    plate((0, 0, 0.2), 0.8, 0.8)
    light.light_linking.blocker_collection = collection_of(bpy.data.objects["Plate"])


@case("A lamp that casts no shadow", GROUP)
def no_shadow():
    # The plate would keep the lamp from half the room.
    lit_room("POINT", energy=100, shadow_soft_size=0, use_shadow=False)
    plate((0, 0, -0.2), 1, 1)


@case("A lamp that diffuse rays do not see", GROUP)
def lamp_not_diffuse():
    # The red lamp lights nothing that is matte.
    lit_room("POINT", (-1, 0, 0), energy=100, color=(1, 0.2, 0.1), name="Unseen").visible_diffuse = False
    lamp("POINT", (1, 0, 0), energy=100, color=(0.1, 0.3, 1))


@case("A lamp hidden from renders", GROUP)
def lamp_hidden():
    lit_room("POINT", (-1, 0, 0), energy=100, color=(1, 0.2, 0.1), name="Hidden").hide_render = True
    lamp("POINT", (1, 0, 0), energy=100, color=(0.1, 0.3, 1))


@case("Forty lamps", GROUP)
def forty_lamps():
    # Of many colours and powers: all have their share.
    room()
    probes()
    for i in range(40):
        at = (0.4 * (i % 8) - 1.4, 0.6 * (i // 8) - 1.2, 1.5)
        lamp("POINT", at, energy=0.5 + i % 5, color=(1, (i % 8) / 8, (i % 3) / 3), shadow_soft_size=0.05)


@case("A small lamp far away", GROUP, effort=4)
def far_lamp():
    # Of its light, one part in 10,000 comes through the open front.
    room(without=["Front"])
    probes("Left Right Back Floor Ceiling")
    lamp("POINT", (-60, -100, 40), energy=2e6, shadow_soft_size=0.2)


@case("A lamp outside, and a small window", GROUP, effort=4)
def through_window():
    # The front wall has a hole of 80 cm.
    room(without=["Front"])
    probes("Left Right Back Floor Ceiling")
    for x, z, half_x, half_z in ((-1.2, 0, 0.8, 2), (1.2, 0, 0.8, 2), (0, 1.2, 0.4, 0.8), (0, -1.2, 0.4, 0.8)):
        quad("Wall", (x, -2, z), (half_x, 0, 0), (0, 0, half_z), matte((0.6, 0.6, 0.6), "Wall"))
    lamp("AREA", (-2, -4, 0.5), (1, 0, 0), size=1, energy=1000)


@case("Max Bounces of a lamp", GROUP)
def lamp_max_bounces():
    # The lamp beside the red wall lights what its light meets first and no more; the other is not seen in the room.
    lit_room("POINT", (-1, 0, 0.3), energy=100, shadow_soft_size=0.1).data.cycles.max_bounces = 1
    lamp("POINT", (1, 0, -0.3), energy=500, shadow_soft_size=0.1, name="None").data.cycles.max_bounces = 0


@case("Max Bounces 0", GROUP)
def lamp_no_bounce():
    # Nothing of the red lamp is left in indirect light; it is not even reflected by the mirror.
    light = lit_room("POINT", (-1, 0, 0.3), energy=300, color=(1, 0.2, 0.1), shadow_soft_size=0, name="None")
    light.data.cycles.max_bounces = 0
    lamp("POINT", (1, 0, -0.3), energy=100, shadow_soft_size=0.1)
    quad("Mirror", (0, 1.5, 0), (0.8, 0, 0), (0, 0, 0.8), shader("BsdfGlossy", {"Roughness": 0.0}))


@case("Max Bounces 2 of an area lamp", GROUP)
def lamp_two_bounces():
    lit_room("AREA", (-0.5, 0, 1), size=0.5, energy=100).data.cycles.max_bounces = 2


@case("Negative power", GROUP)
def lamp_negative():
    # Beside the green wall a lamp takes away a third of what the one beside the red wall gives.
    lit_room("POINT", (-1, 0, 0.3), energy=150, shadow_soft_size=0.1)
    lamp("POINT", (1, 0, 0.3), energy=-50, shadow_soft_size=0.1, name="Dark")


@case("Instanced lamps", GROUP)
def instanced_lamps():
    # Two instances of a collection with one lamp; the collection itself is not in the scene.
    room()
    probes()
    light = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    light.data.energy = 50
    collection = collection_of(light)
    for x, scale in ((-1.2, 1), (0.3, 2)):
        instance = put("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        instance.location, instance.scale = (x, 0, 0.5), (scale, scale, scale)


@case("A lamp in a box with a slit", GROUP, effort=18)
def lamp_in_box():
    # Most light leaves the white box only after bounces in it. Its sides run into each other at the edges.
    lit_room("POINT", energy=200, shadow_soft_size=0.05)
    half = 0.5
    white = matte((0.8, 0.8, 0.8), "White")
    for axis in range(3):
        for sign in (-1, 1):
            center, size = [0.0, 0, 0], [half, half, half]
            center[axis], size[axis] = sign * half, 0.02
            if axis == 2 and sign < 0:
                center[0], size[0] = -0.3, 0.2  # the box's floor is open on its right
            box("Side", center, size, white)
