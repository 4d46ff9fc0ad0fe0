"""Distributions of facets, and what facets of metal reflect."""

from ..registry import case
from ..stage import lamp, nodes, probes, room, shader
from .stage import GROUP, divided, principled, shiny_floor, stripes


def grazed_floor(material):
    """A dark room with a floor of the material, over which a lamp's light grazes to the right wall."""
    room(paint={"Floor": material}, dim=0.5)
    probes("Right", 80, lambda p: p[2] < 0.5)
    lamp("AREA", (-1.7, 0, -1.55), (0.4, 0, -2), size=0.4, energy=100)


def glossy(distribution, roughness, **inputs):
    """A material of the Glossy BSDF."""
    inputs = {"Color": (0.3, 0.6, 0.9), "Roughness": roughness, **inputs}
    return shader("BsdfAnisotropic", inputs, distribution=distribution)


def glass(distribution, roughness, kind="Glass"):
    """A material of the Glass or the Refraction BSDF."""
    inputs = {"Color": (0.7, 0.8, 0.95), "Roughness": roughness, "IOR": 1.5}
    return shader(f"Bsdf{kind}", inputs, distribution=distribution)


@case("Glossy BSDF, Beckmann", GROUP, effort=3)
def glossy_beckmann():
    shiny_floor(glossy("BECKMANN", 0.5))


@case("Glossy BSDF, Beckmann, roughness 0.2", GROUP, effort=6)
def glossy_beckmann_sharp():
    shiny_floor(glossy("BECKMANN", 0.2))


@case("Glossy BSDF, Ashikhmin–Shirley, roughness 0.6", GROUP, effort=3)
def glossy_ashikhmin_shirley():
    shiny_floor(glossy("ASHIKHMIN_SHIRLEY", 0.6))


@case("Glossy BSDF, Ashikhmin–Shirley, roughness 0.2", GROUP, effort=6)
def glossy_ashikhmin_shirley_sharp():
    shiny_floor(glossy("ASHIKHMIN_SHIRLEY", 0.2))


@case("Glossy BSDF, GGX without energy compensation", GROUP, effort=2)
def glossy_ggx():
    shiny_floor(glossy("GGX", 0.9))


@case("Glass BSDF, Beckmann", GROUP, effort=9)
def glass_beckmann():
    divided(glass("BECKMANN", 0.5), 0.2)


@case("Glass BSDF, Beckmann, roughness 0.2", GROUP, effort=14)
def glass_beckmann_sharp():
    divided(glass("BECKMANN", 0.2), 0.2)


@case("Glass BSDF, GGX without energy compensation", GROUP, effort=9)
def glass_ggx():
    divided(glass("GGX", 0.7), 0.2)


@case("Refraction BSDF, Beckmann", GROUP, effort=9)
def refraction_beckmann():
    divided(glass("BECKMANN", 0.4, "Refraction"), 0.2)


@case("Metallic BSDF, a dark edge (F82)", GROUP, effort=16)
def metallic_f82():
    inputs = {"Base Color": (0.9, 0.7, 0.5), "Edge Tint": (0.1, 0.4, 0.9), "Roughness": 0.3}
    grazed_floor(shader("BsdfMetallic", inputs))


@case("Principled metal with a specular tint", GROUP, effort=12)
def metal_tinted():
    inputs = {"Base_Color": (0.6, 0.5, 0.4), "Metallic": 1.0, "Specular_Tint": (0.2, 0.6, 1)}
    grazed_floor(principled(**inputs, Roughness=0.4))


@case("Metallic BSDF, Beckmann", GROUP, effort=4)
def metallic_beckmann():
    inputs = {"Base Color": (0.9, 0.7, 0.5), "Edge Tint": (0.5, 0.5, 0.5), "Roughness": 0.4}
    shiny_floor(shader("BsdfMetallic", inputs, distribution="BECKMANN"))


@case("Metallic BSDF, gold as a physical conductor", GROUP, effort=6)
def metallic_gold():
    inputs = {"IOR": (0.18, 0.42, 1.37), "Extinction": (3.42, 2.35, 1.77), "Roughness": 0.3}
    shiny_floor(shader("BsdfMetallic", inputs, fresnel_type="PHYSICAL_CONDUCTOR"))


@case("Metallic BSDF, chromium as a physical conductor, at grazing angles", GROUP, effort=6)
def metallic_chromium():
    inputs = {"IOR": (3.18, 3.18, 2.23), "Extinction": (3.32, 3.33, 3.05), "Roughness": 0.3}
    grazed_floor(shader("BsdfMetallic", inputs, fresnel_type="PHYSICAL_CONDUCTOR"))


@case("A soap film (Principled thin film)", GROUP, effort=4, since=(5, 0))
def soap_film():
    # Between air and air: nothing but the film reflects.
    film = {"Thin_Film_Thickness": 420.0, "Thin_Film_IOR": 1.6}
    shiny_floor(principled(Base_Color=(1, 1, 1), Transmission_Weight=1.0, IOR=1.001, Roughness=0.2, **film))


@case("A thin film on glass (Glass BSDF)", GROUP, effort=4, since=(5, 0))
def filmed_glass():
    # As lenses are coated, but with a film that reflects more than the glass.
    inputs = {"Color": (1, 1, 1), "Roughness": 0.2, "IOR": 1.5, "Thin Film Thickness": 150.0, "Thin Film IOR": 2.2}
    shiny_floor(shader("BsdfGlass", inputs))


@case("A thin film on a glass pane, seen through", GROUP, effort=12, since=(5, 0))
def filmed_pane():
    inputs = {"Color": (1, 1, 1), "Roughness": 0.3, "IOR": 1.5, "Thin Film Thickness": 600.0, "Thin Film IOR": 2.4}
    divided(shader("BsdfGlass", inputs), 0.2)


@case("A thin film on plastic (Principled thin film)", GROUP, effort=3, since=(5, 0))
def filmed_plastic():
    inputs = {"Base_Color": (0.1, 0.1, 0.3), "Roughness": 0.4, "Thin_Film_Thickness": 300.0}
    shiny_floor(principled(**inputs, Thin_Film_IOR=2.0))


@case("A thin film on metal (Principled thin film)", GROUP, effort=6, since=(5, 0))
def filmed_metal():
    # Anodised titanium.
    inputs = {"Base_Color": (0.5, 0.5, 0.5), "Metallic": 1.0, "Specular_Tint": (0.9, 0.9, 0.9), "Roughness": 0.3}
    shiny_floor(principled(**inputs, Thin_Film_Thickness=90.0, Thin_Film_IOR=2.4))


@case("A thin film on a physical conductor, by a texture", GROUP, effort=6, since=(5, 0))
def filmed_conductor():
    # Tempering colours of steel, in stripes.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(0, 0.25, 0.5, 0.75, 1), interpolation="Closest")
    thickness = tree.add("Math", {0: image, 1: 200.0}, operation="MULTIPLY")
    inputs = {"IOR": (2.9, 2.9, 2.4), "Extinction": (3.1, 2.9, 2.6), "Roughness": 0.3, "Thin Film IOR": 2.3}
    metal = tree.add("BsdfMetallic", inputs | {"Thin Film Thickness": thickness}, fresnel_type="PHYSICAL_CONDUCTOR")
    shiny_floor(tree.done(metal))
