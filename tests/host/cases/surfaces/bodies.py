"""Bodies with subsurface scattering that are baked themselves: light comes to them through themselves.

The probes of these cases are the bodies' own corners.
"""

import bpy
import numpy as np

from ..registry import case
from ..stage import lamp, nodes, room, shader
from .normals import mapped, tiles
from .stage import GROUP, principled

WAX = {"Subsurface_Weight": 1.0, "Subsurface_Radius": (1, 0.5, 0.3), "Subsurface_Scale": 0.3}


def baked_ball(material, at=(0, 0, 0), radius=0.8):
    """A smooth ball whose corners are the probes."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=radius, location=at)
    ball = bpy.context.object
    ball.name = "Probes"
    ball.data.materials.append(material)
    ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), bool))
    return ball


def lit_from_one_side():
    """A dim room with a lamp to the left, which what stands in the middle keeps from the rest."""
    room(dim=0.5)
    lamp("AREA", (-1.7, 0, 0), (-2, 0, 0), size=0.5, energy=100)


@case("Wax ball, on itself", GROUP, changed=(5, 2), effort=4)
def body_ball():
    lit_from_one_side()
    baked_ball(principled(Base_Color=(0.8, 0.6, 0.4), **WAX))


@case("Ball half of wax under a coat and sheen, on itself", GROUP, changed=(5, 2), effort=6)
def body_layered():
    lit_from_one_side()
    layers = {"Coat_Weight": 1.0, "Coat_Roughness": 0.4, "Sheen_Weight": 0.5, "Sheen_Roughness": 0.5}
    baked_ball(principled(Base_Color=(0.8, 0.6, 0.5), **layers, **WAX | {"Subsurface_Weight": 0.5}))


@case("Skin, on itself", GROUP, changed=(5, 2), effort=6)
def body_skin():
    lit_from_one_side()
    tree = nodes()
    skin = tree.add("BsdfPrincipled", {"Base Color": (0.8, 0.5, 0.4)}, subsurface_method="RANDOM_WALK_SKIN")
    inputs = {"Weight": 1.0, "Radius": (1, 0.5, 0.25), "Scale": 0.3, "IOR": 1.4, "Anisotropy": 0.5}
    for name, value in inputs.items():
        skin.inputs[f"Subsurface {name}"].default_value = value
    baked_ball(tree.done(skin))


@case("Wax on one half of a ball and paint on the other, on itself", GROUP, changed=(5, 2), effort=6)
def body_two_materials():
    lit_from_one_side()
    ball = baked_ball(principled(Base_Color=(0.8, 0.6, 0.4), **WAX))
    ball.data.materials.append(shader("BsdfDiffuse", {"Color": (0.2, 0.3, 0.6)}))
    right = [int(polygon.center.x > 0) for polygon in ball.data.polygons]
    ball.data.polygons.foreach_set("material_index", right)


@case("Wax ball beside a mirror, on itself", GROUP, changed=(5, 2), effort=4)
def body_caustic():
    # The lamp's light comes by the mirror alone.
    mirror = principled(Base_Color=(0.9, 0.9, 0.9), Metallic=1.0, Roughness=0.0)
    room(paint={"Left": mirror}, dim=0.3)
    lamp("AREA", (-0.5, 0, 1.0), (-2, 0, 0.5), size=1.2, energy=200)
    baked_ball(principled(Base_Color=(0.8, 0.6, 0.4), **WAX), (0.6, 0, -0.2))


@case("Wax ball with a normal map, on itself", GROUP, changed=(5, 2), effort=4)
def body_normal_map():
    lit_from_one_side()
    tree = nodes()
    wax = {name.replace("_", " "): value for name, value in WAX.items()}
    bent = mapped(tree, tiles(0.7, 3))  # whose edges are at no corner
    baked_ball(tree.done(tree.add("BsdfPrincipled", {"Base Color": (0.8, 0.6, 0.4), "Normal": bent, **wax})))
