"""Objects that some kinds of rays do not see."""

import bpy

from ..registry import case
from ..stage import glow, lamp, matte, probes, quad, room, shader
from .stage import GROUP


def spotlit_floor():
    """A dim room with a spot without a size above the floor: only shadow rays meet such a lamp."""
    room(dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("SPOT", (0, 0, 1), energy=100, shadow_soft_size=0, spot_size=1.5, spot_blend=0)


def screen_below(material, half, hidden_from):
    """A square under the lamp that kinds of rays do not see."""
    hide(quad("Plate", (0, 0, -0.5), (half, 0, 0), (0, half, 0), material), hidden_from)


@case("An object that only the camera sees", GROUP)
def camera_only():
    # The plate would keep the lamp from the floor.
    spotlit_floor()
    screen_below(matte((0, 0, 0)), 1.0, "diffuse glossy transmission shadow")


@case("An object that only shadow rays see", GROUP)
def shadow_only():
    # The black plate keeps the lamp from part of the floor, and no bounced light from anything.
    spotlit_floor()
    screen_below(matte((0, 0, 0)), 0.7, "camera diffuse glossy transmission")


@case("An object that shadow rays do not see", GROUP)
def no_shadow_object():
    # The lamp shines through the black plate, and bounced light does not.
    spotlit_floor()
    screen_below(matte((0, 0, 0)), 1.0, "shadow")


@case("An object that diffuse rays do not see", GROUP)
def not_diffuse():
    # The white plate keeps the lamp from part of the floor, and sends no light back.
    spotlit_floor()
    screen_below(matte((0.9, 0.9, 0.9)), 0.7, "diffuse")


@case("An object that glossy rays do not see", GROUP)
def not_glossy():
    # A glowing square that a mirror floor does not show.
    mirror = shader("BsdfAnisotropic", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.0})
    room(paint={"Floor": mirror}, dim=0.5)
    probes("Right Ceiling", 60)
    quad("Emitter", (-1.5, 0, -0.5), (0, 0.8, 0), (0.8, 0, 0), glow((1, 0.8, 0.6), 10))
    hide(bpy.data.objects["Emitter"], "glossy")


def hide(obj, rays):
    """Hide an object from kinds of rays."""
    for kind in rays.split():
        setattr(obj, "visible_" + kind, False)
