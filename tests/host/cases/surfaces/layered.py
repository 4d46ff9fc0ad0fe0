"""Coats: over diffuse, metal, glass and light, tinted and not, under sheen."""

from ..registry import case
from ..stage import nodes, probes, quad, room, shader
from .broad import grazed_floor
from .stage import GROUP, divided, painted_floor, principled, shiny_floor


@case("Principled BSDF, coat", GROUP, effort=4)
def coat():
    inputs = {"Base Color": (0.05, 0.05, 0.05), "Roughness": 1.0, "Specular IOR Level": 0.0}
    coated = {"Coat Weight": 1.0, "Coat Roughness": 0.1, "Coat IOR": 2.0}
    shiny_floor(shader("BsdfPrincipled", {**inputs, **coated}, "Coated"))


@case("Coat with a tint over diffuse", GROUP)
def coat_tinted():
    # The floor is white, its coat amber.
    coated = {"Coat_Weight": 1.0, "Coat_Roughness": 0.4, "Coat_Tint": (0.9, 0.6, 0.2), "Coat_IOR": 1.6}
    painted_floor(principled(Base_Color=(0.8, 0.8, 0.8), Specular_IOR_Level=0.0, **coated))


@case("Half a coat, rough, over gloss", GROUP, effort=2)
def coat_half():
    coated = {"Coat_Weight": 0.5, "Coat_Roughness": 0.6, "Coat_Tint": (0.5, 0.8, 0.9)}
    painted_floor(principled(Base_Color=(0.7, 0.6, 0.5), Roughness=0.5, **coated))


@case("Coat over metal", GROUP, effort=6)
def coat_over_metal():
    inputs = {"Base_Color": (0.9, 0.6, 0.3), "Metallic": 1.0, "Roughness": 0.5}
    shiny_floor(principled(Coat_Weight=1.0, Coat_Roughness=0.2, Coat_Tint=(0.7, 0.8, 0.9), **inputs))


@case("Car paint", GROUP, effort=6)
def car_paint():
    # Flakes of metal in red, under clear lacquer.
    inputs = {"Base_Color": (0.6, 0.03, 0.02), "Metallic": 0.4, "Roughness": 0.45}
    shiny_floor(principled(Coat_Weight=1.0, Coat_Roughness=0.15, **inputs))


@case("Coat over glass", GROUP, effort=9)
def coat_over_glass():
    inputs = {"Base_Color": (0.8, 0.9, 0.95), "Transmission_Weight": 1.0, "Roughness": 0.3}
    divided(principled(Coat_Weight=1.0, Coat_Roughness=0.2, Coat_Tint=(0.9, 0.8, 0.6), **inputs), 0.2)


@case("Light under a coat with a tint", GROUP, effort=6)
def coat_over_emission():
    room()
    probes()
    inputs = {"Base_Color": (0, 0, 0), "Specular_IOR_Level": 0.0, "Emission_Color": (1, 1, 1), "Emission_Strength": 8.0}
    lit = principled(Coat_Weight=1.0, Coat_Roughness=0.3, Coat_IOR=1.8, Coat_Tint=(0.9, 0.5, 0.3), **inputs)
    quad("Panel", (0, 0, 1.9), (0, 0.5, 0), (0.5, 0, 0), lit)


@case("Sheen over a coat over diffuse", GROUP)
def sheen_over_coat():
    # Dust on lacquer.
    inputs = {"Base_Color": (0.7, 0.3, 0.2), "Roughness": 0.6, "Coat_Weight": 1.0, "Coat_Roughness": 0.4}
    grazed_floor(principled(Sheen_Weight=0.7, Sheen_Roughness=0.7, Coat_Tint=(0.8, 0.9, 0.6), **inputs))


@case("Coat by a texture", GROUP, effort=2)
def coat_textured():
    # Lacquer in a checker on wood.
    tree = nodes()
    checker = tree.add("TexChecker", {"Scale": 8.0, "Color1": (1, 1, 1), "Color2": (0, 0, 0)})
    inputs = {"Base Color": (0.3, 0.15, 0.05), "Specular IOR Level": 0.0, "Coat Weight": checker}
    coated = {"Coat Roughness": 0.3, "Coat IOR": 2.0, "Coat Tint": (0.9, 0.6, 0.4)}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", {**inputs, **coated})))


@case("Subsurface scattering with a thin wall", GROUP, since=(5, 2))
def thin_sheet():
    # A leaf: more goes through than comes back.
    inputs = {"Base_Color": (0.5, 0.8, 0.3), "Roughness": 0.5, "Thin_Wall": True}
    divided(principled(Subsurface_Weight=0.8, Subsurface_Anisotropy=0.4, **inputs))
