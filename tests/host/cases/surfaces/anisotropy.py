"""Brushed surfaces: facets stretched along tangents."""

import bpy

from ..registry import case
from ..stage import lamp, nodes, probes, room
from .stage import GROUP, shiny_floor, stripes


def brushed(tangent=None, kind="BsdfPrincipled", inputs=None, **properties):
    """A material of one shader; `tangent` makes its tangents, and `inputs` are called with its tree if they can be."""
    tree = nodes()
    given = {"Roughness": 0.4, **(inputs(tree) if callable(inputs) else inputs or {})}
    if tangent is not None:
        given["Tangent"] = tree.add("Tangent", **tangent)
    return tree.done(tree.add(kind, given, **properties))


METAL = {"Base Color": (0.8, 0.8, 0.8), "Metallic": 1.0}
ALONG_UV = {"direction_type": "UV_MAP"}


@case("Principled BSDF, anisotropic metal", GROUP, effort=6)
def anisotropic():
    # Brushed in circles around the floor's middle.
    shiny_floor(brushed(inputs={**METAL, "Anisotropic": 0.9}))


@case("Anisotropic metal, turned by a quarter", GROUP, effort=6)
def anisotropic_turned():
    shiny_floor(brushed(inputs={**METAL, "Anisotropic": 0.9, "Anisotropic Rotation": 0.25}))


@case("Anisotropic metal along a UV map", GROUP, effort=6)
def anisotropic_uv():
    shiny_floor(brushed(ALONG_UV, inputs={**METAL, "Anisotropic": 0.9}))


@case("Anisotropic metal along a UV map, turned by a texture", GROUP, effort=6)
def anisotropic_turned_by_texture():
    def inputs(tree):
        turn = tree.add("TexImage", image=stripes(0, 0.1, 0.25, 0.4), interpolation="Closest")
        return {**METAL, "Anisotropic": 0.8, "Anisotropic Rotation": turn}

    shiny_floor(brushed(ALONG_UV, inputs=inputs))


@case("Principled BSDF, anisotropic plastic", GROUP, effort=4)
def anisotropic_plastic():
    inputs = {"Base Color": (0.05, 0.05, 0.05), "Roughness": 0.3, "IOR": 2.0, "Anisotropic": 0.8}
    shiny_floor(brushed(ALONG_UV, inputs=inputs))


@case("Glossy BSDF, anisotropic, Beckmann", GROUP, effort=6)
def anisotropic_beckmann():
    inputs = {"Color": (0.3, 0.6, 0.9), "Roughness": 0.4, "Anisotropy": 0.5, "Rotation": 0.1}
    shiny_floor(brushed(kind="BsdfAnisotropic", inputs=inputs, distribution="BECKMANN"))


@case("Glossy BSDF, Ashikhmin–Shirley, anisotropic the other way", GROUP, effort=6)
def anisotropic_ashikhmin_shirley():
    inputs = {"Color": (0.3, 0.6, 0.9), "Roughness": 0.4, "Anisotropy": -0.6}
    shiny_floor(brushed(ALONG_UV, "BsdfAnisotropic", inputs, distribution="ASHIKHMIN_SHIRLEY"))


@case("Metallic BSDF, a brushed cylinder (tangents around Z)", GROUP, effort=6)
def anisotropic_cylinder():
    # A pot brushed on a lathe throws the lamp's light onto the floor and the wall beside it.
    room(dim=0.5)
    probes("Right Floor", 80, lambda p: p[0] > 0.2)
    metal = brushed({"axis": "Z"}, "BsdfMetallic", {"Base Color": (0.9, 0.7, 0.5), "Roughness": 0.4, "Anisotropy": 0.9})
    bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=0.8, depth=2.4, location=(-0.6, 0, -0.8))
    pot = bpy.context.object
    pot.data.shade_smooth()
    pot.data.set_sharp_from_angle(angle=0.7)
    pot.data.materials.append(metal)
    lamp("AREA", (1.5, -0.8, 0.5), (-0.4, 0, -0.8), size=0.6, energy=200)
