"""Meshes: their shading, transforms and modifiers, and what renders alone show."""

import bpy
import numpy as np
from mathutils import Matrix

from ..registry import case
from ..stage import SIDES, box, lamp, matte, mesh, probes, put, quad, room
from .stage import GROUP, modified, plate, red, shaded_room


def zigzag_room():
    """A room whose floor is a zigzag of steep slopes; returns the floor."""
    room(without=["Floor", "Ceiling"], dim=0.5)
    probes("Left Right Front Back", 32)
    n = 20
    x = np.linspace(-2, 2, n + 1)
    z = np.where(np.arange(n + 1) % 2, -1.7, -2.0)
    rows = np.concatenate([np.stack([x, np.full(n + 1, y), z], 1) for y in (-2, 2)])
    faces = [(i, i + 1, n + 2 + i, n + 1 + i) for i in range(n)]
    lamp("SUN", energy=3, angle=0)
    return mesh("Zigzag", rows, faces, matte((0.7, 0.7, 0.7), "Zigzag"))


@case("N-gon", GROUP)
def ngon():
    # A concave star under the lamp; a fan of triangles would fill its bays.
    shaded_room()
    k = np.arange(10)
    r = np.where(k % 2, 0.35, 1.2)
    star = np.stack([r * np.cos(k * np.pi / 5), r * np.sin(k * np.pi / 5), 0 * k], 1)
    mesh("Shape", star, [tuple(range(10))], red())


@case("Flat shading", GROUP)
def flat():
    zigzag_room()


@case("Smooth shading", GROUP)
def smooth():
    # The normals of the zigzag are nearly upright, so that it reflects more of the sun than it gets.
    zigzag_room().data.shade_smooth()


@case("Sharp edges", GROUP)
def sharp_edges():
    # Smooth, with sharp edges where its slopes meet: as flat.
    data = zigzag_room().data
    data.shade_smooth()
    data.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data.foreach_set("value", [True] * len(data.edges))


@case("Custom normals", GROUP)
def custom_normals():
    # A level floor with normals that lean by 45° to the lamp.
    room(dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("SPOT", (-1.8, 0, -1.2), (0, 0, -2), energy=100, shadow_soft_size=0, spot_size=1.0, spot_blend=0)
    data = bpy.data.objects["Floor"].data
    data.shade_smooth()
    data.normals_split_custom_set([(-0.7071, 0, 0.7071)] * len(data.loops))


@case("Negative scale", GROUP)
def negative_scale():
    # Lies to the red side; as it is modelled, to the green one.
    shaded_room()
    quad("Shape", (0.6, 0, 0), (0.5, 0, 0), (0, 1, 0), red()).scale = (-1, 1, 1)


@case("Uneven scale, turned", GROUP)
def uneven_scale():
    shaded_room()
    shape = box("Shape", (0, 0, 0), (0.3, 0.3, 0.1), red())
    shape.scale, shape.rotation_euler = (4, 1, 1), (0, 0, 0.6)


@case("A child of a turned parent (shear)", GROUP)
def sheared():
    # A long rhombus, of a third of the area of the square that its lengths alone would make.
    shaded_room()
    shape = plate(0.25)
    shape.rotation_euler = (0, 0, np.pi / 4)
    shape.parent = put("Parent", None)
    shape.parent.scale = (5, 1, 1)


@case("Parented with an inverse", GROUP)
def parent_inverse():
    # The inverse takes back what the parent moves.
    shaded_room()
    shape = plate(0.6)
    shape.parent = put("Parent", None)
    shape.parent.location = (1.5, 0, -1)
    shape.matrix_parent_inverse = Matrix.Translation((-1.5, 0, 1))


@case("Delta transform", GROUP)
def delta_transform():
    shaded_room()
    shape = plate(0.6, (0, 0, 0))
    shape.location, shape.delta_location = (1.5, 0, -1), (-1.5, 0, 1)


@case("Constraint", GROUP)
def constraint():
    # Copies the place of an empty under the lamp.
    shaded_room()
    shape = plate(0.6)
    shape.location = (1.5, 0, -1)
    constraint = shape.constraints.new("COPY_LOCATION")
    constraint.target = put("Target", None)


@case("Subdivision Surface modifier", GROUP, effort=2)
def subdivision():
    # Rounds a box to half its breadth.
    shaded_room()
    modified(box("Shape", (0, 0, -0.4), (0.8, 0.8, 0.8), red()), "SUBSURF", levels=3, render_levels=3)


@case("Mirror modifier", GROUP)
def mirror():
    shaded_room()
    modified(quad("Shape", (0.75, 0, 0), (0.65, 0, 0), (0, 1, 0), red()), "MIRROR")


@case("Array modifier", GROUP)
def array():
    shaded_room()
    shape = quad("Shape", (-1, 0, 0), (0.15, 0, 0), (0, 1, 0), red())
    settings = {"count": 5, "use_relative_offset": False, "use_constant_offset": True}
    modified(shape, "ARRAY", **settings, constant_offset_displace=(0.5, 0, 0))


@case("Solidify modifier", GROUP)
def solidify():
    # A thin sheet upright beside the lamp grows to a slab that nearly reaches it.
    shaded_room(at=(0, 0, 0))
    shape = quad("Shape", (0.9, 0, 0), (0, 0.5, 0), (0, 0, 0.5), red())
    modified(shape, "SOLIDIFY", thickness=0.7, offset=-1)


@case("Bevel modifier", GROUP, effort=2)
def bevel():
    # Takes the corners off a box under the lamp.
    shaded_room()
    modified(box("Shape", (0, 0, -0.4), (0.7, 0.7, 0.7), red()), "BEVEL", width=0.6, segments=4)


@case("Displace modifier", GROUP)
def displace():
    # Inflates a box.
    shaded_room()
    modified(box("Shape", (0, 0, -0.5), (0.3, 0.3, 0.3), red()), "DISPLACE", strength=0.7, mid_level=0)


@case("A modifier that the viewport does not show", GROUP)
def render_modifier():
    # In renders, five plates instead of one.
    shaded_room()
    shape = quad("Shape", (-1, 0, 0), (0.15, 0, 0), (0, 1, 0), red())
    settings = {"count": 5, "use_relative_offset": False, "use_constant_offset": True}
    modified(shape, "ARRAY", **settings, constant_offset_displace=(0.5, 0, 0), show_viewport=False)


@case("More subdivisions in renders", GROUP)
def render_levels():
    # A box in the viewport, a ball in renders.
    shaded_room()
    modified(box("Shape", (0, 0, -0.4), (0.8, 0.8, 0.8), red()), "SUBSURF", levels=0, render_levels=3)


@case("An object hidden in the viewport", GROUP)
def viewport_hidden():
    shaded_room()
    plate(0.8).hide_viewport = True


def into_set(objects):
    """Move objects into the scene's Background Set."""
    background = bpy.context.scene.background_set = bpy.data.scenes.new("Set")
    for obj in objects:
        bpy.context.scene.collection.objects.unlink(obj)
        background.collection.objects.link(obj)


@case("Background Set with a lamp", GROUP)
def lamp_in_set():
    shaded_room()
    into_set([obj for obj in bpy.data.objects if obj.type == "LIGHT"])


@case("Background Set with walls", GROUP)
def walls_in_set():
    shaded_room()
    into_set([bpy.data.objects[name] for name in SIDES])
