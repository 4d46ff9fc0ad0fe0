"""Lamps and worlds that rays of some kinds do not see."""

import bpy

from .emitters import GROUP as WORLDS
from .emitters import halves, open_room
from .lamps import GROUP, lit_room
from .registry import case
from .stage import box, lamp, picture, quad, shader, sky, world


def ball_of(material):
    """A ball that the lamps of a case shine on, over the floor."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.6, location=(0, 0, -0.8))
    ball = bpy.context.object
    ball.data.materials.append(material)
    ball.data.polygons.foreach_set("use_smooth", [True] * len(ball.data.polygons))


@case("A lamp that glossy rays do not see", GROUP, effort=2)
def lamp_not_glossy():
    # Without it a third of the light would be what the metal ball reflects.
    light = lit_room("POINT", (0, 0, 1), energy=100, shadow_soft_size=0.3)
    light.visible_glossy = False
    ball_of(shader("BsdfGlossy", {"Roughness": 0.3, "Color": (0.9, 0.9, 0.9)}))


@case("A lamp that only glossy rays see", GROUP, effort=4)
def lamp_only_glossy():
    # The red lamp shines by the rough metal ball alone.
    light = lit_room("AREA", (0, 0, 1.2), size=1, energy=300, color=(1, 0.2, 0.1), name="Unseen")
    light.visible_diffuse = light.visible_transmission = False
    lamp("POINT", (1, 0, 0.5), energy=30, color=(0.1, 0.3, 1))
    ball_of(shader("BsdfGlossy", {"Roughness": 0.4, "Color": (0.9, 0.9, 0.9)}))


@case("A lamp that transmitted rays do not see", GROUP, effort=8)
def lamp_not_transmitted():
    # The pane under the lamp keeps its light from the floor.
    light = lit_room("AREA", (0, 0, 1), size=0.5, energy=100)
    light.visible_transmission = False
    glass = shader("BsdfGlass", {"Roughness": 0.0, "IOR": 1.45})
    box("Pane", (0, 0, 0), (1.2, 1.2, 0.03), glass)


def mirror_floor(roughness):
    """A plate of metal on the floor."""
    quad("Plate", (0, 0, -1.9), (1.5, 0, 0), (0, 1.5, 0), shader("BsdfGlossy", {"Roughness": roughness}))


@case("World that glossy rays do not see", WORLDS, effort=2)
def world_not_glossy():
    # The plate of metal on the floor mirrors the room alone.
    open_room()
    world((0.4, 0.7, 1), 2).cycles_visibility.glossy = False
    mirror_floor(0.2)


@case("World picture that only glossy rays see", WORLDS, effort=4)
def world_only_glossy():
    # What the plate reflects of it lights the ceiling; a lamp lights the rest.
    open_room()
    tree = sky()
    image = tree.add("TexEnvironment", image=picture(halves((0.3, 0.3, 0.1), (1, 0.8, 0.5), 16, 32)))
    visibility = tree.done(tree.add("Background", {"Color": image, "Strength": 6.0}), "OutputWorld").cycles_visibility
    visibility.diffuse = visibility.transmission = False
    lamp("POINT", (1, 0, 0.5), energy=30, color=(0.1, 0.3, 1))
    mirror_floor(0.3)
