"""Subsurface scattering: light through bodies, and back out of them. Diffuse rays of Cycles 4.5 do not see it."""

import bpy

from ..registry import case
from ..stage import box, lamp, nodes, probes, room, shader
from .normals import mapped, tiles
from .stage import GROUP, divided, painted_floor, principled


@case("Principled BSDF, subsurface", GROUP, since=(5, 2))
def subsurface():
    # A thin slab of wax lets light through.
    inputs = {"Base Color": (0.8, 0.5, 0.3), "Roughness": 1.0, "Specular IOR Level": 0.0}
    wax = {"Subsurface Weight": 1.0, "Subsurface Radius": (1, 0.5, 0.3), "Subsurface Scale": 0.5}
    divided(shader("BsdfPrincipled", {**inputs, **wax}, "Wax"), 0.1)


@case("Subsurface scattering in a ball", GROUP, since=(5, 2))
def subsurface_ball():
    # Jade between a lamp and the probes, under its specular layer.
    room(dim=0.5)
    probes(n=40, where=lambda p: p[0] > 0.3)
    jade = {"Subsurface_Weight": 1.0, "Subsurface_Radius": (0.6, 1.0, 0.8), "Subsurface_Scale": 0.2}
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.8)
    bpy.context.object.data.materials.append(principled(Base_Color=(0.3, 0.8, 0.5), **jade))
    lamp("AREA", (-1.7, 0, 0), (0, 0, 0), size=0.5, energy=300)


@case("Subsurface scattering in marble, deep in red", GROUP, since=(5, 2))
def subsurface_marble():
    inputs = {"Base_Color": (0.9, 0.8, 0.7), "Roughness": 0.3, "IOR": 1.6}
    divided(principled(Subsurface_Weight=1.0, Subsurface_Radius=(1, 0.5, 0.25), Subsurface_Scale=0.2, **inputs), 0.2)


@case("Subsurface scattering half with diffuse, under a coat and sheen", GROUP, effort=4, since=(5, 2))
def subsurface_layered():
    layers = {"Coat_Weight": 1.0, "Coat_Roughness": 0.4, "Sheen_Weight": 0.5, "Sheen_Roughness": 0.5}
    skin = {"Subsurface_Weight": 0.5, "Subsurface_Radius": (1, 0.4, 0.3), "Subsurface_Scale": 0.1}
    divided(principled(Base_Color=(0.8, 0.6, 0.5), **layers, **skin), 0.1)


@case("Subsurface scattering of millimetres on a wall", GROUP, since=(5, 2))
def subsurface_shallow():
    # As Lambertian as it gets, but in a colour of its own: views are refracted.
    shallow = {"Subsurface_Weight": 1.0, "Subsurface_Radius": (1, 0.2, 0.1), "Subsurface_Scale": 0.001}
    room(dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    box("Slab", (0, 0, -1.9), (1.9, 1.9, 0.09), principled(Base_Color=(0.6, 0.4, 0.2), Roughness=0.3, **shallow))
    lamp("AREA", (0, 0, 0.5), size=1.0, energy=100)


@case("Subsurface scattering forwards", GROUP, since=(5, 2))
def subsurface_forwards():
    milk = {"Subsurface_Weight": 1.0, "Subsurface_Radius": (1, 0.8, 0.6), "Subsurface_Scale": 0.1}
    divided(principled(Base_Color=(0.8, 0.8, 0.8), Subsurface_Anisotropy=0.8, **milk), 0.15)


@case("Subsurface Scattering shader", GROUP, since=(5, 2))
def subsurface_shader():
    inputs = {"Color": (0.7, 0.5, 0.3), "Scale": 0.3, "Radius": (1, 0.5, 0.25), "Roughness": 0.6, "IOR": 1.3}
    divided(shader("SubsurfaceScattering", inputs, falloff="RANDOM_WALK"), 0.1)


@case("Subsurface scattering of skin", GROUP, since=(5, 2))
def subsurface_skin():
    tree = nodes()
    skin = tree.add("BsdfPrincipled", {"Base Color": (0.8, 0.5, 0.4)}, subsurface_method="RANDOM_WALK_SKIN")
    inputs = {"Weight": 1.0, "Radius": (1, 0.5, 0.25), "Scale": 0.3, "IOR": 1.4}
    for name, value in inputs.items():
        skin.inputs[f"Subsurface {name}"].default_value = value
    divided(tree.done(skin), 0.1)


@case("Subsurface scattering of old files", GROUP, since=(5, 2))
def subsurface_legacy():
    inputs = {"Color": (0.8, 0.6, 0.4), "Scale": 1.0, "Radius": (1, 0.8, 0.6), "Anisotropy": 0.3}
    divided(shader("SubsurfaceScattering", inputs, falloff="RANDOM_WALK_LEGACY"), 0.1)


@case("Subsurface scattering by Christensen and Burley", GROUP)
def subsurface_burley():
    # Diffuse rays see it as diffuse.
    inputs = {"Color": (0.8, 0.4, 0.3), "Scale": 0.5, "Radius": (1, 0.5, 0.2)}
    painted_floor(shader("SubsurfaceScattering", inputs, falloff="BURLEY"))


TURNED = "seen from elsewhere, the mean of normals that turn with the ways out"


@case("Subsurface scattering in a ball with a normal map", GROUP, since=(5, 2), differs=TURNED)
def subsurface_normal_map():
    # Both ends of each walk are bent.
    room(dim=0.5)
    probes(n=40, where=lambda p: p[0] > 0.3)
    tree = nodes()
    inputs = {"Base Color": (0.3, 0.8, 0.5), "Roughness": 0.3, "Normal": mapped(tree, tiles(0.8))}
    jade = {"Subsurface Weight": 1.0, "Subsurface Radius": (0.6, 1.0, 0.8), "Subsurface Scale": 0.2}
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.8)
    bpy.context.object.data.materials.append(tree.done(tree.add("BsdfPrincipled", inputs | jade)))
    lamp("AREA", (-1.7, 0, 0), (0, 0, 0), size=0.5, energy=300)
