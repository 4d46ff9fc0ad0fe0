"""Shaders that are mixed by the angle by which they are seen."""

from ..registry import case
from ..stage import lamp, probes, room
from .stage import GROUP, diffuse, divided, mixed, painted_floor, shiny_floor


def scaled(node, output, operation, value, **inputs):
    """A factor by an output of a node, through a Math node."""

    def factor(tree):
        by = tree.add(node, inputs).outputs[output]
        return tree.add("Math", {0: by, 1: value}, operation=operation)

    return factor


def gold(tree):
    return tree.add("BsdfAnisotropic", {"Color": (0.9, 0.6, 0.2), "Roughness": 0.4})


@case("Metal mixed with matte by part of Fresnel", GROUP, effort=6)
def fresnel_metal():
    by = scaled("Fresnel", 0, "MULTIPLY", 0.8, IOR=2.2)
    shiny_floor(mixed(by, diffuse((0.1, 0.1, 0.3)), gold), at=(-1.8, 0, -1.5), size=0.6)


@case("Velvet by Layer Weight's Facing to a power", GROUP)
def facing_velvet():
    # A lamp and walls that graze the cloth.
    velvet = mixed(
        scaled("LayerWeight", "Facing", "POWER", 2.0, Blend=0.6), diffuse((0.02, 0.0, 0.05)), diffuse((0.9, 0.5, 0.8))
    )
    room(paint={"Floor": velvet}, dim=0.4)
    probes("Left Right Front Back", 60, lambda p: p[2] < 0.3)
    lamp("AREA", (0, 0, 0.5), size=1.0, energy=100)


@case("Paint of two coats by Facing", GROUP, effort=2)
def facing_paint():
    def gloss(tree):
        return tree.add("BsdfAnisotropic", {"Color": (0.8, 0.1, 0.1), "Roughness": 0.5})

    painted_floor(mixed(scaled("LayerWeight", "Facing", "MULTIPLY", 1.0, Blend=0.3), gloss, diffuse((0.1, 0.2, 0.9))))


MEAN = "its mean over all directions"


@case("Curtain that reflects and lets through by Fresnel", GROUP, differs=MEAN)
def fresnel_curtain():
    def cloth(tree):
        return tree.add("BsdfTranslucent", {"Color": (0.8, 0.7, 0.5)})

    divided(mixed(scaled("Fresnel", 0, "MULTIPLY", 1.0, IOR=1.5), cloth, diffuse((0.3, 0.3, 0.3))))


@case("Emission by Layer Weight's Facing", GROUP, differs=MEAN)
def facing_emission():
    def glow(tree):
        return tree.add("Emission", {"Strength": 3.0})

    painted_floor(mixed(scaled("LayerWeight", "Facing", "POWER", 3.0, Blend=0.5), diffuse((0.3, 0.3, 0.3)), glow))
