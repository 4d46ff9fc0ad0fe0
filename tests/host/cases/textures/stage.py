"""What several of the cases here have in common."""

import numpy as np

from ..stage import lamp, picture, probes, room, tinted

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
