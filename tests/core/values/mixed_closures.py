"""Closures of every kind, points of planes that have some of them, and normals of their own."""

from dataclasses import replace

import numpy as np
from photon_bake.addon.bsdf import SMOOTH, Lobe
from photon_bake.addon.bsdf import closure as parts
from photon_bake.addon.scene import Channel, Materials, NormalSpace, RayKind, ShadingFrames
from photon_bake.tests.core.bsdf_points import closures, points_of
from photon_bake.tests.core.scenes import plane, scene_of
from photon_bake.tests.core.values.lobe_formulas import f, unit

DOWN = unit(0.3, 0.2, -0.6)


def point(*several, back=False, by_angle=None):
    """The arrays of a plane of some closures, and what a point of it does to light that comes to a side."""
    of = replace(closures(*several), by_angle=by_angle)
    scene = points_of(Materials.of(1, closures=of), 1).scene
    return scene, parts.bsdf_of(scene, 0, f(0.2), f(0.3), back)


WHITE_FLOOR = {"kind": Lobe.DIFFUSE, "weight": (0.6, 0.4, 0.2)}
THROUGH = {"kind": Lobe.TRANSLUCENT, "weight": (0.1, 0.3, 0.2)}
COAT = {"kind": Lobe.GLOSSY, "roughness": 0.4, "f0": 0.04, "f90": 1, "ior": 1.5}
METAL = {"kind": Lobe.GLOSSY, "roughness": 0.6, "f0": (0.4, 0.5, 0.6), "f90": 1, "weight": (0.5, 0.6, 0.7)}
MIRROR = {**METAL, "roughness": float(SMOOTH) / 2}
CLEAR = {"kind": Lobe.GLASS, "f0": (0.9, 0.8, 0.7), "f90": (0.5, 0.6, 0.95), "roughness": 0.5, "ior": 1.5}
ROUGH = {"kind": Lobe.ROUGH_DIFFUSE, "weight": (0.6, 0.4, 0.2), "f0": 0.5, "roughness": 0.8}
SHEEN = {"kind": Lobe.SHEEN, "weight": 1, "f0": (0.3, 0.5, 0.4), "roughness": 0.5}
VELVET = {"kind": Lobe.VELVET, "weight": (0.3, 0.2, 0.4), "roughness": 0.7}
TOON = {"kind": Lobe.TOON, "weight": (0.3, 0.2, 0.4), "roughness": 0.9, "f90": 0.1}
SHINY = {"kind": Lobe.GLOSSY_TOON, "weight": (0.3, 0.2, 0.4), "roughness": 0.9, "f90": 0.1}
TINT = {"kind": Lobe.ABSORBING, "f0": (0.9, 0.5, 0.2), "ior": 1.5, "roughness": 0.7}
PANE = {"kind": Lobe.PANE, "weight": 0.4, "roughness": 0.5}
SKIN = {"kind": Lobe.SUBSURFACE, "weight": (0.2, 0.3, 0.4), "f0": 0.5, "f90": 0.1, "ior": 1.4}
HAIR = {
    "kind": Lobe.FIBRE,
    "weight": (0.2, 0.3, 0.4),
    "f0": 0.3,
    "f90": (0.2, 0.04, 0.1),
    "ior": 1.55,
    "roughness": 0.1,
}
MIXED = [
    {**WHITE_FLOOR, "layer": 2},
    THROUGH,
    COAT,
    METAL,
    CLEAR,
    {**ROUGH, "layer": 2},
    SHEEN,
    VELVET,
    TOON,
    SHINY,
    TINT,
    PANE,
    SKIN,
    HAIR,
]


U, V = f(0.2), f(0.3)
SMOOTHED = np.array(unit(-0.3, 0.2, 1), np.float64)
TANGENTS = np.float32([(0.3, 1, 0.2), (-2, 0.1, 0), (0.8, 0.6, 0.5)])
DIFFUSE = int(RayKind.DIFFUSE)
LEAN = np.array(unit(0.3, 0.2, 0.9), np.float64)


def floor(*several, smooth=None, seen_as=None, start=None):
    """A plane of closures, each with `space` and `normal` of its own if it has them."""
    of = closures(*({k: v for k, v in one.items() if k not in ("space", "normal")} for one in several))
    normals = np.float32([np.broadcast_to(one.get("normal", 1), 3) for one in several])
    space = np.int32([one.get("space", -1) for one in several])
    of = replace(of, normal=Channel.constant(normals), normal_space=space)
    if start is not None:
        of = replace(of, start=np.int32(start))
    m, scene = len(of.start) - 1, scene_of(*plane())
    more = {} if seen_as is None else {"seen_as": np.int32(seen_as)}
    matrices = np.tile(np.float32([[0, -1, 0.2], [1, 0, 0.1], [0.3, 0, 1]]), (2, 1, 1))
    corner_normals = scene.corner_normals if smooth is None else np.tile(np.float32(smooth), (2, 3, 1))
    return replace(
        scene,
        materials=Materials.of(m, closures=of, **more),
        frames=ShadingFrames(np.tile(TANGENTS, (2, 3, 1, 1)), matrices),
        corner_normals=corner_normals,
    ).arrays


def leaning(one, normal=LEAN, space=NormalSpace.WORLD):
    return {**one, "space": space, "normal": normal}
