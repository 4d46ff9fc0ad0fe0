"""Gloss: Principled, metal, and what a texture makes of them."""

from ..registry import case
from ..stage import lamp, nodes, probes, room, shader
from .stage import GROUP, mixed, painted_floor, principled, shiny_floor, stripes


@case("Principled BSDF, as new", GROUP)
def principled_default():
    # On a dark base, what gloss reflects doubles the light.
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05)))


@case("Principled BSDF, matte", GROUP)
def principled_matte():
    painted_floor(principled(Base_Color=(0.7, 0.5, 0.2), Roughness=1.0, Specular_IOR_Level=0.0))


@case("Principled BSDF, roughness 0.1", GROUP, effort=3)
def principled_glossy():
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05), Roughness=0.1))


@case("Principled BSDF, high IOR", GROUP, effort=3)
def principled_ior():
    # Reflects four times what IOR 1.5 does.
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05), Roughness=0.3, IOR=2.5))


@case("Principled BSDF, full specular level", GROUP, effort=3)
def principled_specular():
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05), Roughness=0.3, Specular_IOR_Level=1.0))


@case("Principled BSDF, specular tint", GROUP)
def principled_tint():
    # The gloss is blue.
    inputs = {"Base_Color": (0.05, 0.05, 0.05), "Roughness": 0.3, "Specular_Tint": (0.1, 0.3, 1)}
    shiny_floor(principled(Specular_IOR_Level=1.0, **inputs))


@case("Metal, mirror", GROUP, effort=6)
def metal_mirror():
    shiny_floor(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.0))


@case("Metal, roughness 0.3", GROUP, effort=6)
def metal_brushed():
    shiny_floor(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.3))


@case("Metal, roughness 1", GROUP)
def metal_rough():
    # Darker than a matte surface, and still with a direction.
    shiny_floor(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=1.0))


@case("Metal, half", GROUP, effort=4)
def metal_half():
    shiny_floor(principled(Base_Color=(0.8, 0.5, 0.2), Metallic=0.5, Roughness=0.3, Specular_IOR_Level=0.0))


@case("Metal by a texture", GROUP, effort=4)
def metal_textured():
    # Metal in stripes on a red floor.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(0, 1, 0, 1, 1, 0, 1, 1), interpolation="Closest")
    inputs = {"Base Color": (0.9, 0.2, 0.1), "Metallic": image, "Roughness": 0.2, "Specular IOR Level": 0.0}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Roughness by a texture", GROUP, effort=2)
def roughness_textured():
    # Half of the floor is a mirror.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(0.05, 0.9, 0.05, 0.9, 0.05, 0.9), interpolation="Closest")
    inputs = {"Base Color": (0.8, 0.8, 0.8), "Metallic": 1.0, "Roughness": image}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Glossy BSDF", GROUP, effort=4)
def glossy():
    shiny_floor(shader("BsdfAnisotropic", {"Color": (0.3, 0.6, 0.9), "Roughness": 0.4}))


@case("Glossy BSDFs of roughness 0.15 and 0.8, mixed", GROUP, effort=6)
def glossy_mixed():
    # A sharp red lobe and a wide blue one: the mean of their roughness would be neither.
    def glossy_of(color, roughness):
        return lambda tree: tree.add("BsdfAnisotropic", {"Color": color, "Roughness": roughness})

    shiny_floor(mixed(lambda tree: 0.6, glossy_of((0.9, 0.4, 0.1), 0.15), glossy_of((0.1, 0.5, 0.9), 0.8)))


@case("Metallic BSDF", GROUP, effort=6)
def metallic():
    inputs = {"Base Color": (0.6, 0.5, 0.2), "Edge Tint": (0.9, 0.9, 0.9), "Roughness": 0.3}
    shiny_floor(shader("BsdfMetallic", inputs))


@case("Two mirrors (light by way of both)", GROUP, effort=9)
def two_mirrors():
    # Between a mirror floor and a mirror ceiling.
    mirror = shader("BsdfAnisotropic", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.0})
    room(paint={"Floor": mirror, "Ceiling": mirror}, dim=0.5)
    probes("Right Back Front", 60)
    lamp("AREA", (-1.5, 0, -0.5), (-0.5, 0, -2), size=1, energy=200)
