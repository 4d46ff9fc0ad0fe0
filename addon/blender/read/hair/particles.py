"""Strands of particle systems: parents or children, as renders or the viewport show them."""

from collections.abc import Iterator

import bpy
import numpy as np

from ....scene.fibres.strands import MOST_STRANDS, Strands, thinned
from .curves import random_numbers, thicker


def hair_systems(obj: "bpy.types.Object", for_render: bool = True) -> "Iterator[bpy.types.ParticleSystemModifier]":
    """The modifiers of an object that show hair."""
    for modifier in obj.modifiers:
        shown = modifier.show_render if for_render else modifier.show_viewport
        if modifier.type == "PARTICLE_SYSTEM" and shown and modifier.particle_system is not None:
            settings = modifier.particle_system.settings
            if settings is not None and settings.type == "HAIR" and settings.render_type == "PATH":
                yield modifier


def read_particles(
    obj: "bpy.types.Object", modifier: "bpy.types.ParticleSystemModifier", for_render: bool
) -> tuple[Strands, int]:
    """Strands of an evaluated object's particle system in its own space, and how many of them there were."""
    system = modifier.particle_system
    settings, parents, children = system.settings, len(system.particles), len(system.child_particles)
    if not for_render:
        children = int(children * settings.display_percentage / 100)
    of_children = settings.child_type != "NONE" and children > 0
    n = children if of_children else parents
    chosen = thinned(n, MOST_STRANDS)
    numbers = (chosen + (parents if of_children else 0)).tolist()
    n_keys = _keys_a_strand(settings, for_render)
    places = [system.co_hair(obj, particle_no=number, step=step) for number in numbers for step in range(n_keys)]
    world = np.array(places, np.float64).reshape(-1, 3)
    inverse = np.array(obj.matrix_world.inverted_safe(), np.float64)
    positions = (world @ inverse[:3, :3].T + inverse[:3, 3]).astype(np.float32)
    strands = _strands(positions.reshape(-1, n_keys, 3), settings)
    uvs = _uvs(obj, modifier, numbers)
    whole = Strands(strands.positions, strands.radii, strands.start, uvs, random_numbers(len(strands)))
    return thicker(whole, n), n


def _keys_a_strand(settings: "bpy.types.ParticleSettings", for_render: bool) -> int:
    """Points of each strand, as Cycles asks for them."""
    steps = 2 ** (settings.render_step if for_render else settings.display_step)
    return steps + 1 + (settings.kink_extra_steps if settings.kink == "SPIRAL" else 0)


def _strands(positions: np.ndarray, settings: "bpy.types.ParticleSettings") -> Strands:
    """Strands (s, k, 3) with the radii of their settings, without points that repeat the one before."""
    n, n_keys = positions.shape[:2]
    step = np.zeros((n, n_keys))
    step[:, 1:] = np.linalg.norm(np.diff(positions, axis=1), axis=2)
    kept = step > 0
    kept[:, 0] = True
    length = step.sum(axis=1, keepdims=True)
    share = np.cumsum(step, axis=1) / np.where(length > 0, length, 1)
    radii = _radius_along(share, settings)
    sizes = kept.sum(axis=1)
    start = np.concatenate([[0], np.cumsum(sizes)])
    radii = radii[kept].astype(np.float32)
    if settings.use_close_tip and n:
        radii[start[1:] - 1] = 0
    return Strands(positions[kept], radii, start, {}, np.zeros(n, np.float32))


def _radius_along(share: np.ndarray, settings: "bpy.types.ParticleSettings") -> np.ndarray:
    """Cycles' radius at a share of a strand's length: from root to tip by a power of what is left of the length."""
    left, shape = 1 - np.clip(share, 0, 1), settings.shape
    left = left ** (1 + shape) if shape < 0 else left ** (1 / (1 - min(shape, 0.9999)))
    root, tip = (0.5 * settings.radius_scale * radius for radius in (settings.root_radius, settings.tip_radius))
    return left * (root - tip) + tip


def _uvs(
    obj: "bpy.types.Object", modifier: "bpy.types.ParticleSystemModifier", numbers: list[int]
) -> dict[str, np.ndarray]:
    """The UV maps of the surface at the strands' roots, (s, 2) each."""
    layers, system = getattr(obj.data, "uv_layers", ()), modifier.particle_system
    found = {}
    for i, layer in enumerate(layers if len(system.particles) else ()):
        particles = system.particles
        at = [
            system.uv_on_emitter(modifier, particle=particles[min(k, len(particles) - 1)], particle_no=k, uv_no=i)
            for k in numbers
        ]
        values = np.nan_to_num(np.array(at, np.float32).reshape(-1, 2))
        found[layer.name] = values
        if layer.active_render:
            found[""] = values
    return found
