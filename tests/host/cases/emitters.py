"""Surfaces that emit, and worlds."""

import bpy
import numpy as np

from .registry import case
from .stage import box, glow, lamp, matte, missing_picture, nodes, picture, probes, quad, room, shader, sky, world

GROUP = "Emitting surfaces and worlds"


def lit_by(material):
    """The closed room with an emissive square under its ceiling, facing down."""
    room()
    probes()
    return quad("Emitter", (0, 0, 1.5), (0, 0.8, 0), (0.8, 0, 0), material)


def open_room(without="Front"):
    """The room, open to the world on one side."""
    room(without=[without])
    sides = "Left Right Front Back Floor Ceiling"
    probes(" ".join(side for side in sides.split() if side != without))


def halves(left, right, height=8, width=8):
    """An image of two colours side by side."""
    pixels = np.zeros((height, width, 3))
    pixels[:, : width // 2], pixels[:, width // 2 :] = left, right
    return pixels


@case("Emission shader", GROUP)
def emissive():
    lit_by(glow((1, 0.8, 0.5), 5))


@case("Emission strength of the Principled BSDF", GROUP)
def emissive_principled():
    inputs = {"Base Color": (0.5, 0.5, 0.5), "Emission Color": (0.5, 0.8, 1), "Emission Strength": 5.0}
    lit_by(shader("BsdfPrincipled", {**inputs, "Specular IOR Level": 0.0}))


@case("A sky that is a mesh", GROUP, effort=4)
def emissive_dome():
    # A box of 400 m around the room, whose front is open: next to none of its light comes in.
    open_room()
    box("Sky", (0, 0, 0), (200, 200, 200), glow((0.6, 0.8, 1), 2))


@case("Emission from a texture", GROUP, effort=4)
def emissive_textured():
    # The part of the ceiling beside the green wall is bright.
    pixels = np.full((6, 6, 3), 0.02)
    pixels[:, :1] = (1, 0.6, 0.3)
    tree = nodes()
    image = tree.add("TexImage", image=picture(pixels), interpolation="Closest")
    room(paint={"Ceiling": tree.done(tree.add("Emission", {"Color": image, "Strength": 10.0}))})
    probes("Left Right Front Back Floor")


@case("Emission strength from nodes", GROUP)
def emissive_strength_nodes():
    # Two thirds of the strength that stands in the first node.
    tree = nodes()
    strength = tree.add("Math", {0: 12.0, 1: 2 / 3}, operation="MULTIPLY")
    lit_by(tree.done(tree.add("Emission", {"Strength": strength})))


@case("Emission mixed with a matte surface", GROUP)
def emissive_mixed():
    # A quarter of the emission.
    tree = nodes()
    light, surface = tree.add("Emission", {"Strength": 20.0}), tree.add("BsdfDiffuse", {"Color": (0.6, 0.6, 0.6)})
    lit_by(tree.done(tree.add("MixShader", {"Fac": 0.25, 1: surface, 2: light})))


@case("Emission added to a matte surface", GROUP)
def emissive_added():
    # The emitter is the floor, and reflects what comes back to it.
    tree = nodes()
    light, surface = tree.add("Emission", {"Strength": 1.0}), tree.add("BsdfDiffuse", {"Color": (0.9, 0.9, 0.9)})
    room(paint={"Floor": tree.done(tree.add("AddShader", {0: surface, 1: light}))})
    probes()


@case("Emission on one side (Backfacing)", GROUP)
def emissive_one_side():
    # Upright in the middle, it shines at the red wall alone.
    tree = nodes()
    back = tree.add("NewGeometry").outputs["Backfacing"]
    light = tree.add("Emission", {"Strength": tree.add("Math", {0: 1.0, 1: back}, operation="SUBTRACT")})
    room()
    probes()
    quad("Emitter", (0, 0, 0), (0, 0, 0.8), (0, 0.8, 0), tree.done(light))


@case("Emission by a Blackbody node", GROUP)
def emissive_blackbody():
    tree = nodes()
    lit_by(tree.done(tree.add("Emission", {"Color": tree.add("Blackbody", {"Temperature": 3000.0}), "Strength": 5.0})))


@case("A surface that takes light away", GROUP)
def emissive_negative():
    # A panel of −1 under the ceiling, beside a lamp.
    lit_by(glow((1, 0.8, 0.5), -1))
    lamp("POINT", (0.3, 0.4, -0.2), energy=100, shadow_soft_size=0.1)


@case("A colour, an image and a Background node in the place of a shader", GROUP)
def emissive_without_shader():
    # Three parts of the ceiling, each lit its own way.
    room(without=["Ceiling"])
    probes("Left Right Front Back Floor")
    for i, kind in enumerate(("RGB", "TexImage", "Background")):
        tree = nodes()
        node = tree.add(kind)
        if kind == "RGB":
            node.outputs[0].default_value = (1, 0.5, 0.2, 1)
        elif kind == "TexImage":
            node.image, node.interpolation = picture(halves((0.2, 0.9, 0.3), (0.1, 0.1, 0.9))), "Closest"
        else:
            tree.feed(node.inputs["Color"], (0.2, 0.5, 1))
        quad("Panel", (1.3 * (i - 1), 0, 1.9), (0, 1.8, 0), (0.6, 0, 0), tree.done(node))


@case("World of one colour", GROUP)
def world_constant():
    open_room()
    world((0.4, 0.7, 1), 2)


@case("World that takes light away", GROUP)
def world_negative():
    # It takes away some of what a lamp gives.
    open_room()
    world((1, 0.7, 0.4), -0.2)
    lamp("POINT", (0.3, 0.4, -0.2), energy=100, shadow_soft_size=0.1)


@case("World picture by the node's own Texture Mapping", GROUP)
def world_texture_mapping():
    # The bright half is turned to the open side.
    open_room()
    tree = sky()
    image = tree.add("TexEnvironment", image=picture(halves((0.05, 0.05, 0.1), (1, 0.8, 0.5), 16, 32)))
    image.texture_mapping.rotation = (0, 0, 1.2)
    tree.done(tree.add("Background", {"Color": image, "Strength": 2.0}), "OutputWorld")


@case("World picture, turned, with a strength", GROUP)
def world_picture():
    # Unturned, the bright part of the picture would be behind the room's back.
    open_room()
    v, u = np.mgrid[0:32, 0:64] / 32
    pixels = np.stack([0.2 + 0 * u, 0.3 + 0 * u, 0.2 + 0.5 * v], axis=-1)
    pixels[14:26, 20:28] = (12, 10, 6)
    tree = sky()
    turned = tree.add("Mapping", {"Vector": tree.add("TexCoord"), "Rotation": (0, 0, 2.6)})
    image = tree.add("TexEnvironment", {"Vector": turned}, image=picture(pixels, byte=False))
    tree.done(tree.add("Background", {"Color": image, "Strength": 0.8}), "OutputWorld")


@case("World picture whose file is missing", GROUP)
def world_missing():
    # Magenta.
    open_room()
    tree = sky()
    image = tree.add("TexEnvironment", image=missing_picture())
    tree.done(tree.add("Background", {"Color": image, "Strength": 0.8}), "OutputWorld")


@case("World by a Sky Texture", GROUP, since=(5, 0))
def world_sky():
    # The sun's disc is off: the sky's colours, and the dark ground, come in.
    open_room()
    tree = sky()
    texture = tree.add("TexSky", sky_type="MULTIPLE_SCATTERING", sun_disc=False, sun_elevation=0.6)
    tree.done(tree.add("Background", {"Color": texture, "Strength": 0.1}), "OutputWorld")


@case("World by a Sky Texture with its sun", GROUP, since=(5, 0))
def world_sky_sun():
    # The sun shines onto the floor and the green wall.
    open_room()
    tree = sky()
    texture = tree.add("TexSky", sky_type="MULTIPLE_SCATTERING", sun_elevation=0.5, sun_rotation=2.6, sun_size=0.1)
    tree.done(tree.add("Background", {"Color": texture, "Strength": 0.02}), "OutputWorld")


@case("World by a Hosek-Wilkie sky", GROUP)
def world_sky_hosek():
    open_room()
    tree = sky()
    texture = tree.add("TexSky", sky_type="HOSEK_WILKIE", turbidity=3, sun_direction=(0.3, -0.8, 0.5))
    tree.done(tree.add("Background", {"Color": texture, "Strength": 0.3}), "OutputWorld")


@case("World by a gradient", GROUP, effort=2)
def world_gradient():
    # Dark below, bright above.
    open_room()
    tree = sky()
    up = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord")}).outputs["Z"]
    ramp = tree.add("ValToRGB", {"Fac": up})
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.02, 0, 1), (0.5, 3, 6, 1)
    tree.done(tree.add("Background", {"Color": ramp}), "OutputWorld")


@case("World mixed for camera rays (Light Path)", GROUP)
def world_light_path():
    # The camera would see red; light is blue.
    open_room()
    tree = sky()
    camera = tree.add("LightPath").outputs["Is Camera Ray"]
    seen = tree.add("Background", {"Color": (1, 0, 0), "Strength": 5.0})
    real = tree.add("Background", {"Color": (0.2, 0.5, 1), "Strength": 2.0})
    tree.done(tree.add("MixShader", {"Fac": camera, 1: real, 2: seen}), "OutputWorld")


@case("World that diffuse rays do not see", GROUP)
def world_not_diffuse():
    # The lamp lights alone.
    open_room()
    world((0.2, 0.5, 1), 2).cycles_visibility.diffuse = False
    lamp("POINT", energy=100, color=(1, 0.6, 0.3))


@case("Portal of a window, world of a picture", GROUP, effort=4)
def portal():
    # The area lamp in the window only guides Cycles' samples; the window is 80 cm wide.
    open_room()
    for x, z, half_x, half_z in ((-1.2, 0, 0.8, 2), (1.2, 0, 0.8, 2), (0, 1.2, 0.4, 0.8), (0, -1.2, 0.4, 0.8)):
        quad("Wall", (x, -2, z), (half_x, 0, 0), (0, 0, half_z), matte((0.6, 0.6, 0.6), "Wall"))
    tree = sky()
    image = tree.add("TexEnvironment", image=picture(halves((0.2, 0.3, 0.6), (1, 0.8, 0.5), 16, 32)))
    tree.done(tree.add("Background", {"Color": image, "Strength": 4.0}), "OutputWorld")
    light = lamp("AREA", (0, -2, 0), (0, 0, 0), size=0.8, energy=1000)
    light.data.cycles.is_portal = True


def linked(*objects):
    """A collection outside the scene, for linking lights."""
    collection = bpy.data.collections.new("Linked")
    for obj in objects:
        collection.objects.link(obj)
    return collection


@case("Light linking of an emissive mesh", GROUP)
def emissive_linked():
    # It lights the red wall alone.
    emitter = lit_by(glow((1, 0.8, 0.5), 5))
    emitter.light_linking.receiver_collection = linked(bpy.data.objects["Left"])


@case("Light linking of two emissive meshes, one excluding", GROUP)
def emissive_excluding():
    # The blue one lights all but the floor.
    lit_by(glow((1, 0.6, 0.3), 2))
    other = quad("Other", (0.9, 0, 0), (0, 0.5, 0), (0, 0, 0.5), glow((0.2, 0.4, 1), 5))
    collection = linked(bpy.data.objects["Floor"])
    collection.collection_objects[0].light_linking.link_state = "EXCLUDE"
    other.light_linking.receiver_collection = collection


@case("Shadow linking of an emissive mesh", GROUP)
def emissive_shadow_linked():
    # Of two plates under it, one casts a shadow.
    emitter = lit_by(glow((1, 0.8, 0.5), 5))
    black = matte((0, 0, 0), "Black")
    first = quad("First", (0.5, 0, 0.8), (0.5, 0, 0), (0, 1.2, 0), black)
    quad("Second", (-0.5, 0, 0.8), (0.5, 0, 0), (0, 1.2, 0), black)
    emitter.light_linking.blocker_collection = linked(first)


def under_sky(strength=0.1, **settings):
    """The room, open in front, under a Sky Texture."""
    open_room()
    tree = sky()
    texture = tree.add("TexSky", **settings)
    tree.done(tree.add("Background", {"Color": texture, "Strength": strength}), "OutputWorld")


def single_scattering():
    """What this Blender calls Nishita's sky."""
    kinds = bpy.types.ShaderNodeTexSky.bl_rna.properties["sky_type"].enum_items.keys()
    return "SINGLE_SCATTERING" if "SINGLE_SCATTERING" in kinds else "NISHITA"


@case("Sky Texture, single scattering, with the sun's own disc", GROUP, effort=2)
def sky_single():
    # The sun is 0.545° wide, and shines onto the floor and the green wall.
    settings = {"sun_elevation": 0.5, "sun_rotation": 2.6, "sun_size": 0.0095}
    under_sky(0.02, sky_type=single_scattering(), **settings)


def window():
    """Close the room's front but for a window of 80 cm."""
    for x, z, half_x, half_z in ((-1.2, 0, 0.8, 2), (1.2, 0, 0.8, 2), (0, 1.2, 0.4, 0.8), (0, -1.2, 0.4, 0.8)):
        quad("Wall", (x, -2, z), (half_x, 0, 0), (0, 0, half_z), matte((0.6, 0.6, 0.6), "Wall"))


@case("The sun of a Sky Texture through a window", GROUP, effort=2)
def sky_sun_window():
    under_sky(0.05, sky_type=single_scattering(), sun_elevation=0.5, sun_rotation=2.8, sun_size=0.0095)
    window()


@case("The sun of a multiple scattering sky through a window with a portal", GROUP, effort=2, since=(5, 0))
def sky_sun_portal():
    under_sky(0.05, sky_type="MULTIPLE_SCATTERING", sun_elevation=0.5, sun_rotation=2.8, sun_size=0.0095)
    window()
    light = lamp("AREA", (0, -2, 0), (0, 0, 0), size=0.8, energy=1000)
    light.data.cycles.is_portal = True


@case("A low sun of a Sky Texture", GROUP, effort=2, changed=(5, 0))
def sky_low_sun():
    # It stands 3° over the horizon, and shines onto the back wall.
    under_sky(0.1, sky_type=single_scattering(), sun_elevation=0.052, sun_rotation=3.0, sun_size=0.0095)


@case("Sky Texture, single scattering, without a sun", GROUP)
def sky_single_dark():
    under_sky(0.1, sky_type=single_scattering(), sun_disc=False, sun_elevation=0.1, sun_rotation=2.0)


@case("Sky Texture, multiple scattering, with the sun's own disc", GROUP, since=(5, 0), effort=2)
def sky_multiple():
    settings = {"sun_elevation": 0.4, "sun_rotation": 3.4, "sun_size": 0.0095}
    under_sky(0.02, sky_type="MULTIPLE_SCATTERING", **settings)


@case("Preetham's sky", GROUP)
def sky_preetham():
    under_sky(0.3, sky_type="PREETHAM", turbidity=4, sun_direction=(-0.4, -0.7, 0.4))


@case("World and a sun", GROUP)
def world_and_sun():
    # Each has about half of the light.
    open_room()
    world((0.3, 0.5, 1), 1)
    lamp("SUN", (0, -5, 3), (1, 0, -1), energy=5, angle=0.05)
