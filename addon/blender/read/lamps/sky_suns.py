"""Suns of Sky Textures as lamps of their own: a disc of half a degree is a pixel of a picture, and most of its light.

What a world shows with a disc and without it differs by the sun alone, whatever nodes are between. A picture around the
middle of that, in the polar angle θ from it, tells the sun's irradiance E = ∫ L cos θ dω.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ....scene import LightKind, Lights, RayKind, World
from ...temporary import Temporary
from ..materials.nodes import all_nodes
from .cycles_stage import panorama, shot

NAME = "Sun of the world"

_WITH_SUNS = {"NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING"}
_SIZE = (512, 256)  # pixels of the picture in which suns are looked for
_LEAST_SIZE = 0.04  # rad: few samples miss a smaller sun, which a larger one of the same power stands for
_SAMPLES, _SAMPLES_AROUND = 8, 256
_AROUND, _MARGIN = (64, 48), 0.005  # pixels of the picture around a sun, and how far it goes beyond the disc, rad
_SEEN = {
    "seen_by_diffuse": RayKind.DIFFUSE,
    "seen_in_gloss": RayKind.GLOSSY,
    "seen_through_glass": RayKind.TRANSMITTED,
}
_ALL = 0.3  # of the light that may be elsewhere, as far as few samples tell


@dataclass(frozen=True)
class SkySun:
    """A sun's disc.

    Attributes
    ----------
    towards : (3,) float64
        Unit vector to it.
    irradiance : (3,) float64, W/m²
        On a surface that faces it.
    angle : float, rad
        Of the disc, from side to side.
    """

    towards: np.ndarray
    irradiance: np.ndarray
    angle: float


def discs_of(world: "bpy.types.World") -> "list[bpy.types.Node]":
    """The Sky Textures of a world that show their suns."""
    nodes = all_nodes(world.node_tree) if world.node_tree else ()
    return [node for node in nodes if node.type == "TEX_SKY" and node.sun_disc and node.sky_type in _WITH_SUNS]


def suns_of(own: Any, discs: "list[bpy.types.Node]", temporary: Temporary) -> list[SkySun | None]:
    """The suns of a stage's world, whose discs are turned off but for those that are no disc in the sky, None each.

    Parameters
    ----------
    own : bpy.types.Scene
        With a panorama.
    discs : list of bpy.types.Node
        Of its world.
    """
    for node in discs:
        node.sun_disc = False
    found: list[SkySun | None] = []
    if discs:
        render, camera = own.render, own.camera
        size = render.resolution_x, render.resolution_y
        render.resolution_x, render.resolution_y = _SIZE
        without = shot(own, _SAMPLES)
        for node in discs:
            found.append(_sun(own, node, without, temporary))
            own.camera, (render.resolution_x, render.resolution_y) = camera, _SIZE
        render.resolution_x, render.resolution_y = size
    for node, sun in zip(discs, found, strict=True):
        node.sun_disc = sun is None
    return found


def _sun(own: Any, node: Any, without: np.ndarray, temporary: Temporary) -> SkySun | None:
    """One disc's; black where it is not to be seen."""
    angle = float(node.sun_size)
    with _shown(node, max(angle, _LEAST_SIZE)):
        picture = World(np.ones(3, np.float32), shot(own, _SAMPLES) - without)
    light = picture.image * picture.solid_angles[:, None, None]
    whole = light.sum(axis=(0, 1), dtype=np.float64)
    toward = np.einsum("hwc,hwk->k", np.maximum(light, 0), _directions(), dtype=np.float64)
    if whole.max() <= 0 or not toward.any():
        return SkySun(np.array([0.0, 0, 1]), np.zeros(3), angle)
    toward /= np.linalg.norm(toward)
    around = angle / 2 + _MARGIN
    pose = Vector(toward).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    panorama(own, temporary, _AROUND, pose, around)
    dark = shot(own, _SAMPLES)
    with _shown(node, angle):
        disc = shot(own, _SAMPLES_AROUND) - dark
    # Rows go from the middle outwards, in even steps of θ; columns around it
    edges = around * np.arange(_AROUND[1] + 1) / _AROUND[1]
    weight = -np.diff(np.cos(edges)) * 2 * pi / _AROUND[0]
    light = disc * weight[:, None, None]
    if np.abs(light.sum(axis=(0, 1)) - whole).max() > _ALL * whole.max():
        return None
    theta = (edges[1:] + edges[:-1]) / 2
    azimuth = pi - 2 * pi * (np.arange(_AROUND[0]) + 0.5) / _AROUND[0]
    aside = np.sin(theta)[:, None, None] * np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=1)
    middle = (light[..., None] * aside[:, :, None]).sum(axis=(0, 1, 2)) / light.sum() + np.array([0, 0, -1.0])
    toward = np.array(pose.to_3x3()) @ (middle / np.linalg.norm(middle))
    return SkySun(toward, np.einsum("hwc,h->c", light, np.cos(theta), dtype=np.float64), angle)


@contextmanager
def _shown(node: Any, angle: float) -> Iterator[None]:
    """A sun's disc of a size, for a while."""
    before = node.sun_size
    node.sun_disc, node.sun_size = True, angle
    try:
        yield
    finally:
        node.sun_disc, node.sun_size = False, before


def _directions() -> np.ndarray:
    """Unit vectors to the pixels of a panorama, (height, width, 3), as `World.image` has them."""
    width, height = _SIZE
    z = -np.cos(pi * (np.arange(height) + 0.5) / height)[:, None]
    azimuth, r = pi - 2 * pi * (np.arange(width) + 0.5) / width, np.sqrt(1 - z * z)
    return np.stack(np.broadcast_arrays(r * np.cos(azimuth), r * np.sin(azimuth), z), axis=-1)


def with_places(lights: Lights, n: int, hidden_from: frozenset[RayKind]) -> Lights:
    """Lamps, and after them n black ones for a world's suns, which light all objects."""
    if n == 0:
        return lights
    flags = {name: np.full(n, kind not in hidden_from) for name, kind in _SEEN.items()}
    places = Lights.of((NAME,) * n, np.full(n, LightKind.SUN), **flags)
    illuminates, blocked_by = _with_all(lights.illuminates, n), _with_all(lights.blocked_by, n)
    return replace(Lights.join([lights, places]), illuminates=illuminates, blocked_by=blocked_by)


def _with_all(links: np.ndarray | None, n: int) -> np.ndarray | None:
    """Links of lamps (l, o), and those of n lamps to all objects."""
    return None if links is None else np.concatenate([links, np.ones((n, links.shape[1]), bool)])


def shining(lights: Lights, suns: list[SkySun]) -> Lights:
    """Lamps of which the last ones are suns."""
    if not suns:
        return lights
    columns = {name: getattr(lights, name).copy() for name in ("emission", "axis_x", "axis_y", "direction", "angle")}
    for i, sun in enumerate(suns, len(lights) - len(suns)):
        away = -Vector(sun.towards)
        across = away.orthogonal().normalized()
        columns["emission"][i], columns["angle"][i] = sun.irradiance, sun.angle
        columns["direction"][i], columns["axis_x"][i], columns["axis_y"][i] = away, across, -away.cross(across)
    return replace(lights, **columns)
