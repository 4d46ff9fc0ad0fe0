"""Glass, translucency and transparency."""

import bpy
import numpy as np

from ..registry import case
from ..stage import lamp, nodes, picture, probes, room, shader
from .stage import GROUP, divided, principled, stripes


@case("Glass pane (Principled transmission)", GROUP, effort=12)
def principled_glass():
    divided(principled(Transmission_Weight=1.0, Roughness=0.0, Base_Color=(0.6, 0.9, 0.7)), 0.2)


@case("Rough glass pane (Principled transmission)", GROUP, effort=15)
def principled_rough_glass():
    divided(principled(Transmission_Weight=1.0, Roughness=0.4, Base_Color=(0.6, 0.9, 0.7)), 0.2)


@case("Half transmission (Principled)", GROUP, effort=4)
def principled_half_glass():
    divided(principled(Transmission_Weight=0.5, Roughness=0.2, Base_Color=(0.6, 0.9, 0.7)), 0.2)


@case("Glass BSDF", GROUP, effort=9)
def glass():
    divided(shader("BsdfGlass", {"Color": (0.7, 0.8, 0.95), "Roughness": 0.0, "IOR": 1.5}), 0.2)


@case("Glass BSDF, rough", GROUP, effort=9)
def glass_rough():
    divided(shader("BsdfGlass", {"Color": (0.7, 0.8, 0.95), "Roughness": 0.5, "IOR": 1.5}), 0.2)


@case("Glass ball (a caustic)", GROUP, effort=16)
def glass_ball():
    # The ball gathers the light of a lamp above into a bright spot.
    room(dim=0.6)
    probes("Floor", 400, lambda p: np.hypot(p[0], p[1]) < 0.3)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.6, location=(0, 0, -0.7))
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(shader("BsdfGlass", {"Roughness": 0.0, "IOR": 1.5}))
    lamp("AREA", (0, 0, 1.9), size=3.0, energy=200)


@case("Glass ball over what no light stops at (a caustic in mid-air)", GROUP, effort=24)
def glass_ball_in_mid_air():
    # The bright spot falls on probes half a metre above the floor, and through them.
    room(dim=0.6)
    probes("Floor", 400, lambda p: np.hypot(p[0], p[1]) < 0.3)
    bpy.data.objects["Probes"].location.z = 0.5
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.6, location=(0, 0, -0.3))
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(shader("BsdfGlass", {"Roughness": 0.0, "IOR": 1.5}))
    lamp("AREA", (0, 0, 1.9), size=3.0, energy=200)


@case("Refraction BSDF", GROUP, effort=8)
def refraction():
    divided(shader("BsdfRefraction", {"Color": (0.9, 0.7, 0.5), "Roughness": 0.2, "IOR": 1.4}, distribution="GGX"), 0.2)


@case("Translucent BSDF", GROUP)
def translucent():
    divided(shader("BsdfTranslucent", {"Color": (0.8, 0.5, 0.3)}))


@case("Transparent BSDF, coloured", GROUP)
def transparent():
    divided(shader("BsdfTransparent", {"Color": (0.9, 0.5, 0.2)}))


@case("Alpha 0.5 (Principled)", GROUP)
def alpha():
    divided(principled(Alpha=0.5, Base_Color=(0.6, 0.6, 0.6), Specular_IOR_Level=0.0))


@case("Alpha by a texture", GROUP)
def alpha_textured():
    # Holes in a third of the screen.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(1, 1, 0, 1, 1, 0, 1, 1, 0), interpolation="Closest")
    inputs = {"Alpha": image, "Base Color": (0.6, 0.6, 0.6), "Specular IOR Level": 0.0}
    divided(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Alpha by a picture's own", GROUP)
def alpha_of_picture():
    # Leaves cut out of a card.
    pixels = np.ones((8, 8, 4))
    pixels[..., :3] = (0.3, 0.7, 0.2)
    pixels[2:6, 1:7, 3] = 0
    tree = nodes()
    image = tree.add("TexImage", image=picture(pixels), interpolation="Closest")
    inputs = {"Base Color": image, "Alpha": image.outputs["Alpha"], "Specular IOR Level": 0.0}
    divided(tree.done(tree.add("BsdfPrincipled", inputs)))
