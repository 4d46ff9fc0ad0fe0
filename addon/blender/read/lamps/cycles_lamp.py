"""What a lamp's nodes make of its light, as Cycles renders it.

A copy of the lamp stands in a scene of its own: a point or a spot, or an area lamp made small, in a white box, which
a camera at its place sees all around. A wall at distance d, seen at the angle θ from its normal, has the radiance
I cos θ / (π d²). What an area lamp shows from place to place a camera in front of it sees straight, and a sun lights
a plate that faces it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ....scene import LightKind, LightPattern, PatternDomain
from ...temporary import Temporary, frozen_copy
from ..content_key import scene_key, tree_key
from ..materials.nodes import all_nodes
from ..recent import Recent
from .cycles_stage import left_as_it_was, panorama, shot, stage

HEIGHT, WIDTH = 256, 512
SIDE = 256
N_SAMPLES = 8
N_KEPT = 64
_SMALL = 1e-3
"""Side of an area lamp seen from afar, in halves of the box's side."""

_PARTS = 4
"""Along each side of a pixel, whose means tell what is seen of it."""

_LEAST_SEEN = 1e-3
_BY_WORLD = {"NEW_GEOMETRY", "VECT_TRANSFORM", "OBJECT_INFO", "CAMERA", "LAYER_WEIGHT", "FRESNEL"}
_kept = Recent(N_KEPT)


@dataclass(frozen=True)
class LampShape:
    """What of a lamp its pattern depends on, besides its nodes.

    Attributes
    ----------
    kind : LightKind
    domain : PatternDomain
    angle : float, rad
        From the axis to where the light of points and spots ends.
    size : (2,) float, m
        Of area lamps, as it stands in the world.
    matrix : (4, 4) float64
    """

    kind: LightKind
    domain: PatternDomain
    angle: float
    size: tuple[float, float]
    matrix: np.ndarray


def pattern_of_lamp(light: "bpy.types.Light", shape: LampShape, scene: "bpy.types.Scene") -> LightPattern:
    """What a lamp's nodes multiply its own colour and power by; of a sun one pixel. Kept for the next time.

    Light Falloff nodes count as their Strength alone.

    Parameters
    ----------
    light : bpy.types.Light
        Original, not evaluated.
    scene : bpy.types.Scene
        Whose frame it is taken at.

    Raises
    ------
    CyclesError
    """
    turned = shape.matrix if any(_reads_world(node) for node in all_nodes(light.node_tree)) else shape.matrix[:0]
    of_spot = (light.spot_size, *np.linalg.norm(shape.matrix[:3, :3], axis=0)) if light.type == "SPOT" else ()
    own = shape.kind, shape.domain, shape.angle, shape.size, of_spot, turned.tobytes()
    key = (tree_key(light.node_tree), scene_key(light, scene), *own)
    return _kept.found(key, lambda: _pattern(light, shape, scene))


def _reads_world(node: "bpy.types.Node") -> bool:
    """Whether a node may see where the lamp stands."""
    if node.type == "TEX_COORD":
        return any(of.is_linked for of in node.outputs if of.identifier not in {"Normal", "UV"})
    return node.type in _BY_WORLD


def _pattern(light: "bpy.types.Light", shape: LampShape, scene: "bpy.types.Scene") -> LightPattern:
    with left_as_it_was() as temporary:
        own, copy = stage(scene, temporary), _copy(light, temporary)
        lamp = temporary.add(bpy.data.objects.new("Photon Bake", copy))
        lamp.matrix_world = Matrix(shape.matrix)
        own.collection.objects.link(lamp)
        return _SHOTS[shape.kind](own, lamp, shape, temporary)


def _copy(light: "bpy.types.Light", temporary: Temporary) -> "bpy.types.Light":
    """A copy of a lamp that gives what its nodes say, as diffuse rays see it."""
    copy = frozen_copy(light, {"LIGHT_PATH"}, temporary)
    trees = {copy.node_tree} | {node.id_data for node in all_nodes(copy.node_tree)}
    for tree in trees:
        for node in [one for one in tree.nodes if one.type == "LIGHT_FALLOFF"]:
            _bypass(tree, node)
    copy.color, copy.energy, copy.use_shadow = (1, 1, 1), 1, True
    for name, value in (("exposure", 0), ("use_temperature", False), ("normalize", True), ("spread", pi)):
        if hasattr(copy, name):
            setattr(copy, name, value)
    copy.cycles.use_multiple_importance_sampling, copy.cycles.max_bounces = True, 1024
    return copy


def _bypass(tree: "bpy.types.NodeTree", node: "bpy.types.Node") -> None:
    """Put a Light Falloff's strength in the place of what it gives."""
    strength = node.inputs["Strength"]
    start = strength.links[0].from_socket if strength.is_linked else None
    if start is None:
        start = tree.nodes.new("ShaderNodeValue").outputs[0]
        start.default_value = strength.default_value
    for output in node.outputs:
        for link in list(output.links):
            tree.links.new(start, link.to_socket)


def _around(own: "bpy.types.Scene", lamp: "bpy.types.Object", shape: LampShape, temporary: Temporary) -> LightPattern:
    """The intensity of a lamp in all directions, over that of one of its power without nodes."""
    light, pose = lamp.data, _rigid(shape.matrix)
    if light.type == "AREA":
        light.shape, light.size = "SQUARE", _SMALL
        lamp.matrix_world = Matrix(pose)
    else:
        light.shadow_soft_size, light.use_soft_falloff = 0, True  # a sphere of no size would have no normals
    if light.type == "SPOT":
        light.spot_blend = 0
    light.energy = pi if light.type == "AREA" else 4 * pi
    box = temporary.add(bpy.data.objects.new("Photon Bake", _box(temporary)))
    box.matrix_world = Matrix(pose)
    own.collection.objects.link(box)
    panorama(own, temporary, (WIDTH, HEIGHT), Matrix(pose), shape.angle)
    values = shot(own, N_SAMPLES) * np.float32(pi)
    seen = _seen_of_pixels(light, shape)[..., None]
    values = np.where(seen > _LEAST_SEEN, values / np.maximum(seen, _LEAST_SEEN), 0)
    return LightPattern(values.astype(np.float32), shape.domain, shape.angle)


def _seen_of_pixels(light: "bpy.types.Light", shape: LampShape) -> np.ndarray:
    """Mean of cos θ / d² over each pixel, where a spot shines, and times an area lamp's own cosine, (h, w) 1/m²."""
    seen = np.empty((HEIGHT, WIDTH))
    phi = pi - 2 * pi * (np.arange(_PARTS * WIDTH) + 0.5)[None] / (_PARTS * WIDTH)
    stretch = np.linalg.norm(shape.matrix[:3, :3], axis=0)
    for line in range(HEIGHT):
        theta = shape.angle * (line + (np.arange(_PARTS)[:, None] + 0.5) / _PARTS) / HEIGHT
        x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi
        value = np.maximum(np.maximum(abs(x), abs(y)), abs(z)) ** 3  # m, the largest, is cos θ and 1/d
        if light.type == "AREA":
            value *= z
        elif light.type == "SPOT":
            a, b = stretch[:2] / stretch[2]
            value *= z > np.cos(light.spot_size / 2) * np.sqrt((x / a) ** 2 + (y / b) ** 2 + z**2)
        seen[line] = value.reshape(_PARTS, WIDTH, _PARTS).mean(axis=(0, 2))
    return seen


def _in_front(own: "bpy.types.Scene", lamp: "bpy.types.Object", shape: LampShape, temporary: Temporary) -> LightPattern:
    """The radiance of an area lamp from place to place, or in all directions, over that of one without nodes."""
    if shape.domain != PatternDomain.PLACES:
        return _around(own, lamp, shape, temporary)
    width, height = shape.size
    lamp.data.energy = pi * width * height * (1 if shape.kind == LightKind.RECTANGLE else pi / 4)
    camera = temporary.add(bpy.data.cameras.new("Photon Bake"))
    camera.type, camera.ortho_scale, camera.sensor_fit = "ORTHO", width, "HORIZONTAL"
    away = 1 + width + height
    camera.clip_end = 2 * away
    own.camera = temporary.add(bpy.data.objects.new("Photon Bake", camera))
    # The camera looks along its −z at the front, which is the lamp's −z: turned around y, so that columns are mirrored
    pose = Matrix(_rigid(shape.matrix))
    own.camera.matrix_world = pose @ Matrix.Translation((0, 0, -away)) @ Matrix.Rotation(pi, 4, "Y")
    own.collection.objects.link(own.camera)
    # Rays from the camera do not see lamps; those that come through a pane without refraction do
    pane = temporary.add(bpy.data.objects.new("Photon Bake", _box(temporary, "Refraction", ((2, -1),))))
    pane.matrix_world = pose @ Matrix.Diagonal((width, height, away / 2, 1))
    own.collection.objects.link(pane)
    own.cycles.max_bounces = own.cycles.transmission_bounces = 1
    render = own.render
    render.resolution_x = render.resolution_y = SIDE
    render.pixel_aspect_x, render.pixel_aspect_y = max(width / height, 1), max(height / width, 1)
    values = shot(own, N_SAMPLES)[:, ::-1]
    return LightPattern(np.ascontiguousarray(values), shape.domain, pi / 2)


def _facing(own: "bpy.types.Scene", lamp: "bpy.types.Object", shape: LampShape, temporary: Temporary) -> LightPattern:
    """The irradiance of a sun on a plate that faces it, over that of one without nodes, as one pixel."""
    box = temporary.add(bpy.data.objects.new("Photon Bake", _box(temporary, sides=((2, -1),))))
    box.matrix_world = Matrix(_rigid(shape.matrix))
    own.collection.objects.link(box)
    panorama(own, temporary, (16, 16), box.matrix_world, 0.5)
    value = shot(own, 16).mean(axis=(0, 1), keepdims=True) * np.float32(pi)
    return LightPattern(value, shape.domain, pi)


_SHOTS: dict[LightKind, Callable[..., LightPattern]] = {
    LightKind.POINT: _around,
    LightKind.SPOT: _around,
    LightKind.SUN: _facing,
    LightKind.RECTANGLE: _in_front,
    LightKind.ELLIPSE: _in_front,
}


def _rigid(matrix: np.ndarray) -> np.ndarray:
    """A matrix without its scale."""
    rigid = matrix.copy()
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    rigid[:3, :3] /= np.where(lengths > 0, lengths, 1)
    return rigid


_SIDES = tuple((axis, sign) for axis in range(3) for sign in (-1, 1))


def _box(temporary: Temporary, kind: str = "Diffuse", sides: Any = _SIDES) -> "bpy.types.Mesh":
    """White sides of a cube of side 2 around the origin, which face inward, of a kind of BSDF."""
    corners: list[tuple[float, ...]] = []
    faces: list[tuple[int, ...]] = []
    for axis, sign in sides:
        out = np.zeros(3)
        out[axis] = sign
        u = np.roll(out, 1) * sign
        v = np.cross(-out, u)
        faces.append(tuple(range(len(corners), len(corners) + 4)))
        corners += [tuple(out + a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh = temporary.add(bpy.data.meshes.new("Photon Bake"))
    mesh.from_pydata(corners, [], faces)
    white = temporary.add(bpy.data.materials.new("Photon Bake"))
    if bpy.app.version < (5, 0, 0):
        white.use_nodes = True
    tree = white.node_tree
    tree.nodes.clear()
    bsdf, output = tree.nodes.new(f"ShaderNodeBsdf{kind}"), tree.nodes.new("ShaderNodeOutputMaterial")
    bsdf.inputs["Color"].default_value = (1, 1, 1, 1)
    bsdf.inputs["Roughness"].default_value = 0
    if kind == "Refraction":
        bsdf.inputs["IOR"].default_value = 1
    tree.links.new(bsdf.outputs[0], output.inputs["Surface"])
    mesh.materials.append(white)
    return mesh
