"""Materials that move vertices."""

import numpy as np

from ..registry import case
from ..stage import lamp, mesh, nodes, probes, room
from .stage import GROUP


@case("Displacement", GROUP)
def displacement():
    # Makes a slope of the floor, up to the green wall.
    tree = nodes("Ramp")
    tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8)}))
    height = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["Object"]})
    moved = tree.add("Displacement", {"Height": height, "Midlevel": -2.0, "Scale": 0.4})
    tree.feed(tree.tree.get_output_node("ALL").inputs["Displacement"], moved)
    tree.block.displacement_method = "DISPLACEMENT"
    room(paint={"Floor": tree.block}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)


def grid(material, n=24, scale=1.0, smooth=False):
    """A square of n × n faces above the floor of a dim room, with a UV map, and a lamp that grazes it."""
    room(dim=0.5)
    probes("Left Right Front Back Ceiling", 48)
    at = np.linspace(-1, 1, n + 1)
    x, y = (axis.ravel() for axis in np.meshgrid(at, at))
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.stack([first, first + 1, first + n + 2, first + n + 1], 1)
    obj = mesh("Grid", np.stack([x, y, 0 * x], 1) / scale, faces, material)
    corners = np.stack([(x + 1) / 2, (y + 1) / 2], 1)[faces.ravel()]
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", corners.ravel().astype(np.float32))
    obj.data.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    obj.location, obj.scale = (0, 0, -1.5), (scale, scale, scale)
    lamp("AREA", (-1.8, 0, -0.6), (0.5, 0, -1.5), size=0.6, energy=100)


def moved(make, method="DISPLACEMENT"):
    """A light grey material that is moved by what `make` adds to its tree."""
    tree = nodes("Moved")
    tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8)}))
    tree.feed(tree.tree.get_output_node("ALL").inputs["Displacement"], make(tree))
    tree.block.displacement_method = method
    return tree.block


def waves(tree):
    """Ridges along y."""
    across = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["UV"]})
    turns = tree.add("Math", {0: across, 1: 25.0}, operation="MULTIPLY")
    return tree.add("Math", {0: turns}, operation="SINE")


@case("Displacement of a fine mesh in world space", GROUP)
def displacement_waves():
    def up(tree):
        return tree.add("Displacement", {"Height": waves(tree), "Midlevel": 0.0, "Scale": 0.15}, space="WORLD")

    grid(moved(up), n=40, scale=0.5, smooth=True)


@case("Displacement by a texture of a scaled object", GROUP)
def displacement_noise():
    def up(tree):
        noise = tree.add("TexNoise", {"Scale": 3.0})
        return tree.add("Displacement", {"Height": noise, "Midlevel": 0.5, "Scale": 0.6})

    grid(moved(up), n=20, scale=1.4)


@case("Vector displacement in object space", GROUP)
def displacement_vector():
    # Leans the square like a roof, and shifts it.
    def aside(tree):
        height = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["Object"]})
        ramp = tree.add("Math", {0: height}, operation="ABSOLUTE")
        vector = tree.add("CombineXYZ", {0: 0.2, 2: ramp})
        return tree.add("VectorDisplacement", {"Vector": vector, "Scale": 0.8}, space="OBJECT")

    grid(moved(aside), n=8)


@case("Vector displacement in tangent space", GROUP)
def displacement_tangent():
    def aside(tree):
        vector = tree.add("CombineXYZ", {0: waves(tree), 1: waves(tree), 2: 0.5})
        return tree.add("VectorDisplacement", {"Vector": vector, "Scale": 0.12}, space="TANGENT")

    grid(moved(aside), n=40)
