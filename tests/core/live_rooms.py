"""Scenes and settings for tests of live light."""

from dataclasses import replace

import numpy as np
from photon_bake.addon.pipeline.live import Live, live_surfaces
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.live import LiveSettings
from photon_bake.tests.core.scenes import box, lamp, merge, of_objects, scene_of

SMALL = {"n_vertices": 600, "n_elements": 500, "n_links": 64, "n_direct": 4, "n_threads": 1}
MOVED = lamp(LightKind.POINT, 2.0, position=(0.5, 0.2, 0.1))
COLORS = ((0.7, 0.7, 0.7), (0.6, 0.1, 0.1), (0.1, 0.5, 0.2))
PAINTED = ((0.2, 0.3, 0.6), (0.6, 0.1, 0.1), (0.3, 0.3, 0.3))


def live_of(scene, **settings):
    chosen = LiveSettings(**SMALL | settings)
    return Live(scene, live_surfaces(scene, chosen), chosen)


def converged(live):
    for _ in range(1000):
        if not live.step():
            return live.light
    raise AssertionError("it does not converge")


def room(lights=None, colors=COLORS, world=0.0):
    """A box with walls of several colours and a smaller box in it, each an object."""
    block = box(0.3, inwards=False)
    mesh = merge(box(), (block[0] + np.array([0.2, -0.1, -0.7], np.float32), block[1]))
    walls, lamps = [0, 1, 2, 0, 0, 0] * 2, lamp(LightKind.POINT, 3.0, position=(-0.4, 0.3, 0.5), radius=0.1)
    scene = scene_of(*mesh, albedo=colors, lights=lights or lamps, material=walls + [0] * 12, world=world)
    return of_objects(scene, [0] * 12 + [1] * 12)


def turned(degrees, move=(0, 0, 0), scale=1.0):
    """A rotation around z, a scaling and a translation."""
    a = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
    matrix[:3, :3] *= scale
    matrix[:3, 3] = move
    return matrix


def elsewhere(scene, number, transform):
    """The scene with an object moved."""
    k = scene.object_of_triangle == number
    used = np.unique(scene.triangles[k])
    vertices, normals = scene.vertices.copy(), scene.corner_normals.copy()
    vertices[used] = vertices[used] @ transform[:3, :3].T + transform[:3, 3]
    turned = normals[k] @ np.linalg.inv(transform[:3, :3])
    normals[k] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
    return replace(scene, vertices=vertices.astype(np.float32), corner_normals=normals.astype(np.float32))
