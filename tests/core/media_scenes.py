"""Scenes of media, and what is asked of rays through them."""

from dataclasses import replace

import numpy as np
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.scene import Channel, Materials, Media, Medium
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.addon.tracing.media.flight import fly, media_left, passed
from photon_bake.tests.core.scenes import merge, of_objects, scene_of

RHO = 0.5


def medium(absorption, scattering=0.0, g=0.0):
    return Medium(*(np.broadcast_to(np.float32(c), 3) for c in (absorption, scattering)), g)


def with_media(mesh, filled, media, **scene):
    """A scene of a matte mesh, material 0, with meshes that let all light through and are filled with media."""
    n = [len(triangles) for _, triangles in (mesh, *filled)]
    of = np.repeat(np.arange(len(n)), n)
    made = scene_of(*merge(mesh, *filled), albedo=[RHO] + [0.0] * len(filled), material=of, **scene)
    coverage = Channel.constant(np.float32([1] + [0] * len(filled)))
    diffuse = Channel.constant(np.float32([[scene.get("albedo", RHO)] * 3] + [[0] * 3] * len(filled)))
    materials = Materials.of(len(n), diffuse=diffuse, coverage=coverage, emission=made.materials.emission)
    return replace(of_objects(made, of), materials=materials, media=Media((None, *media)))


@kernel
def lengths(tracing, room, k, origins, directions, far, most, length, distance):
    for i in range(len(origins)):
        at = tracing, room, k, row(origins, i), row(directions, i), far, most
        length[i], distance[i], _ = passed(*at)


@kernel
def left_of(tracing, room, origins, directions, far, left):
    for i in range(len(origins)):
        put(left, i, media_left(tracing, room, row(origins, i), row(directions, i), far[i]))


@kernel
def flights(tracing, room, origins, directions, far, volume, distance, weight):
    for i in range(len(origins)):
        flight = fly(tracing, room, row(origins, i), row(directions, i), far)
        volume[i], distance[i] = flight.volume, flight.distance
        put(weight, i, flight.weight)


def tracing_of(scene):
    return TransparencyTracer(scene, EmbreeTracer(scene))
