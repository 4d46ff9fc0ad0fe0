"""What several of the cases here have in common."""

import numpy as np

from ..stage import box, lamp, nodes, picture, probes, quad, room, shader

GROUP = "Surfaces"


def shiny_floor(material, at=(-1.5, 0, -0.5), size=1.0):
    """A dark room with a floor of the material, which throws a lamp's light to the right wall and the ceiling."""
    room(paint={"Floor": material}, dim=0.5)
    probes("Right Ceiling", 60, lambda p: p[0] > 0 and p[2] > -0.5)
    lamp("AREA", at, (0.2, 0, -2), size=size, energy=200)


def divided(material, thick=0.0):
    """A room divided by a screen, or by a block of some thickness; probes see what comes through.

    What goes straight through a transparent screen is direct light, and only its bounces count.
    """
    room()
    probes(n=48, where=lambda p: p[0] > 0.3)
    if thick:
        box("Screen", (0, 0, 0), (thick / 2, 2.1, 2.1), material)
    else:
        quad("Screen", (0, 0, 0), (0, 2, 0), (0, 0, 2), material)
    lamp("AREA", (-1.8, 0, 0), (0, 0, 0), size=2.5, energy=300)


def painted_floor(material):
    """A dim room with a floor of the material, and a lamp that shines down on it."""
    room(paint={"Floor": material}, dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("AREA", (0, 0, 0.5), size=1.0, energy=100)


def principled(**inputs):
    """A material of a Principled BSDF; a name's underscores are blanks."""
    return shader("BsdfPrincipled", {key.replace("_", " "): value for key, value in inputs.items()})


def mixed(fac, first, second):
    """A material that mixes two shaders; each argument makes one socket or value of a tree."""
    tree = nodes()
    parts = {"Fac": fac(tree), 1: first(tree), 2: second(tree)}
    return tree.done(tree.add("MixShader", parts))


def diffuse(color):
    return lambda tree: tree.add("BsdfDiffuse", {"Color": color})


def stripes(*values):
    """Grey stripes side by side, as an image without a colour space."""
    return picture(np.repeat(np.array(values, float)[None, :, None], 3, axis=2), colorspace="Non-Color")
