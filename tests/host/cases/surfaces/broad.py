"""Rough diffuse, sheen and toon."""

from ..registry import case
from ..stage import lamp, nodes, probes, room, shader, world
from .stage import GROUP, diffuse, divided, mixed, painted_floor, principled


def grazed_floor(material, dim=0.4):
    """A floor that a lamp grazes; probes see what it throws back towards the lamp."""
    room(paint={"Floor": material}, dim=dim)
    probes("Left", 90, lambda p: p[2] > -0.95)
    lamp("AREA", (-1.8, 0, -1.4), (0.5, 0, -2), size=0.5, energy=100)


@case("Diffuse BSDF, roughness 1 (Oren-Nayar)", GROUP)
def oren_nayar():
    # The lamp grazes the floor, which throws more light back towards it than a Lambertian one.
    room(paint={"Floor": shader("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Roughness": 1.0})}, dim=0.4)
    probes("Left", 90, lambda p: p[2] > -0.95)
    lamp("AREA", (-1.8, 0, -1.4), (0.5, 0, -2), size=0.5, energy=100)


@case("Principled BSDF, diffuse roughness", GROUP)
def principled_diffuse_roughness():
    floor = principled(Base_Color=(0.8, 0.8, 0.8), Diffuse_Roughness=1.0, Specular_IOR_Level=0.0)
    room(paint={"Floor": floor}, dim=0.4)
    probes("Left", 90, lambda p: p[2] > -0.95)
    lamp("AREA", (-1.8, 0, -1.4), (0.5, 0, -2), size=0.5, energy=100)


@case("Rough plaster on all walls", GROUP)
def rough_walls():
    # Colours get deeper from wall to wall.
    plaster = dict.fromkeys(("Left", "Right", "Front", "Back", "Floor", "Ceiling"), (0.8, 0.65, 0.5))
    room(paint={name: shader("BsdfDiffuse", {"Color": c, "Roughness": 0.6}, name) for name, c in plaster.items()})
    probes()
    lamp("AREA", (0, 0, 1.5), size=1.0, energy=100)


@case("Rough diffuse under a layer of gloss", GROUP, effort=2)
def rough_under_gloss():
    grazed_floor(principled(Base_Color=(0.7, 0.6, 0.5), Diffuse_Roughness=0.8, Roughness=0.5))


@case("Principled BSDF, sheen", GROUP)
def sheen():
    inputs = {"Base Color": (0.02, 0.02, 0.02), "Roughness": 1.0, "Specular IOR Level": 0.0}
    velvet = {"Sheen Weight": 1.0, "Sheen Roughness": 0.3}
    room(paint={"Floor": shader("BsdfPrincipled", {**inputs, **velvet}, "Velvet")}, dim=0.3)
    probes("Left Right", 48)
    lamp("AREA", (-1.8, 0, -1.5), (0.5, 0, -2), size=0.5, energy=100)


@case("Sheen with a tint over rough diffuse", GROUP)
def sheen_over_rough():
    # Blue dust on red cloth.
    cloth = {"Base_Color": (0.6, 0.2, 0.1), "Diffuse_Roughness": 0.7, "Specular_IOR_Level": 0.0}
    grazed_floor(principled(Sheen_Weight=1.0, Sheen_Roughness=0.6, Sheen_Tint=(0.2, 0.4, 1.0), **cloth))


@case("Sheen under an even sky", GROUP, effort=4)
def sheen_under_sky():
    floor = principled(Base_Color=(0.1, 0.1, 0.1), Sheen_Weight=1.0, Specular_IOR_Level=0.0)
    room(without=("Ceiling",), paint={"Floor": floor}, dim=0.3)
    probes("Left Right Front Back", 40)
    world((0.8, 0.9, 1.0), 2.0)


@case("Rough diffuse under an even sky", GROUP, effort=8)
def rough_under_sky():
    room(
        without=("Ceiling",),
        paint={"Floor": shader("BsdfDiffuse", {"Color": (0.8, 0.6, 0.4), "Roughness": 1.0})},
        dim=0.3,
    )
    probes("Left Right Front Back", 40)
    world((0.8, 0.9, 1.0), 2.0)


@case("Sheen BSDF, microfibres", GROUP)
def sheen_bsdf():
    grazed_floor(shader("BsdfSheen", {"Color": (0.9, 0.6, 0.3), "Roughness": 0.6}))


@case("Sheen BSDF, Ashikhmin", GROUP)
def sheen_ashikhmin():
    grazed_floor(shader("BsdfSheen", {"Color": (0.9, 0.6, 0.3), "Roughness": 0.5}, distribution="ASHIKHMIN"))


@case("Velvet curtain lit from behind", GROUP)
def velvet_curtain():
    # What shines through is red, and the pile on top is grey.
    tree = nodes()
    velvet = tree.add("BsdfSheen", {"Color": (0.8, 0.8, 0.8), "Roughness": 0.5})
    cloth = tree.add("BsdfTranslucent", {"Color": (0.6, 0.1, 0.05)})
    divided(tree.done(tree.add("AddShader", {0: velvet, 1: cloth})))


@case("Toon BSDF", GROUP)
def toon():
    painted_floor(shader("BsdfToon", {"Color": (0.8, 0.5, 0.3), "Size": 0.3}, "Toon"))


@case("Toon BSDF with a soft edge, mixed with diffuse", GROUP)
def toon_soft():
    def soft(tree):
        return tree.add("BsdfToon", {"Color": (0.9, 0.8, 0.2), "Size": 0.5, "Smooth": 0.4})

    painted_floor(mixed(lambda tree: 0.6, diffuse((0.1, 0.2, 0.6)), soft))


@case("Toon BSDF, glossy", GROUP, effort=4)
def toon_glossy():
    inputs = {"Color": (0.8, 0.6, 0.4), "Size": 0.4, "Smooth": 0.1}
    painted_floor(shader("BsdfToon", inputs, component="GLOSSY"))
