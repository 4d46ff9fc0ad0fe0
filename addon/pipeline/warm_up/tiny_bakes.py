"""Bakes as small as can be that go through all stages, so that every kernel is called once as bakes call it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.parallel import Workers
from ...emitters import region_of
from ...output.lightmap import FinishOptions, finish_lightmaps
from ...output.vertex_light import VertexSamples, finish_vertices
from ...receivers import (
    Camera,
    PixelFilter,
    Receivers,
    ShownFaces,
    camera_points,
    face_samples,
    texel_receivers,
    vertex_receivers,
)
from ...scene import Scene
from ...settings.bake import BakeSettings
from ...settings.live import LiveSettings
from ...tracing import TransparencyTracer
from ...tracing.cube_maps import MultiImageTracer, lit_region
from ...tracing.embree import EmbreeTracer
from ..bake import bake, solve, solve_apart
from ..camera_pass import camera_pass, light_beside
from ..live import Live, ObjectMoved, live_surfaces
from ..probe_bake import probe_light
from .tiny_scene import floor_chart, floor_mesh, tiny_scene

_WORKERS = Workers(n_threads=1)


def tiny_bakes() -> list[Callable[[], Any]]:
    """The bakes, each a part of the work."""
    scene = tiny_scene()
    tracer = EmbreeTracer(scene)
    return [
        lambda: _vertices(scene, tracer),
        lambda: _texels(scene, tracer),
        lambda: _camera(scene, tracer, _settings()),
        lambda: _camera(scene, tracer, _settings(gather="photon_volumes")),
        lambda: _density(scene, tracer),
        lambda: _light_volume(scene, tracer),
        lambda: _cube_maps(scene, tracer),
    ]


def _settings(**changes: Any) -> BakeSettings:
    small: dict[str, Any] = {"n_photons": 2000, "n_gather_rays": 8, "n_cache_elements": 200, "n_cache_rays": 4}
    small |= {"n_nearest": 8, "n_grid_cells": 4, "n_volume_rays": 4, "n_maps": 2, "map_size": 8, "n_threads": 1}
    return BakeSettings(**(small | changes))


def _vertices(scene: Scene, tracer: EmbreeTracer) -> None:
    """Vertices with direct light, fitted and denoised, and probes."""
    meshes = [floor_mesh()]
    vertices = vertex_receivers(meshes)
    faces, extent = ShownFaces.of(meshes, vertices.targets), 2 * region_of(vertices.position).radius
    samples, hidden = face_samples(faces, vertices, extent, tracer, _WORKERS)
    receivers = Receivers.join([vertices, samples.receivers(faces, vertices.targets)])
    solution = solve(scene, receivers, _settings(add_direct=True, noise=0.5, open_side=True), tracer)
    at = VertexSamples(faces, samples, hidden, [meshes[0].object_name], receivers, extent)
    finish_vertices(solution.irradiance(), at, _WORKERS, tracer)
    probe_light(solution, np.zeros((2, 3), np.float32), 8, _WORKERS)


def _texels(scene: Scene, tracer: EmbreeTracer) -> None:
    """A directional lightmap, filtered and with its seams closed."""
    receivers, texels = texel_receivers([floor_chart()], [(16, 16)], tracer, _WORKERS)
    receivers = replace(receivers, directional=True)
    light = bake(scene, receivers, _settings(), tracer)
    finish_lightmaps(light.value, light.stderr, receivers, texels, FinishOptions(denoiser="own"), _WORKERS)


def _camera(scene: Scene, tracer: EmbreeTracer, settings: BakeSettings) -> None:
    """The pass of a camera that looks down into the room."""
    axes = np.array([(1, 0, 0), (0, 1, 0), (0, 0, -1)], np.float32)
    camera = Camera.perspective(np.array([0, 0, 3], np.float32), axes, 0.8, 12, 8)
    points = camera_points(scene, TransparencyTracer(scene, tracer), camera, PixelFilter(), 2, _WORKERS)
    solution = solve(scene, points.receivers(scene), settings, tracer)
    beside = light_beside(scene, points, solution, 4, 2, _WORKERS)
    camera_pass(points, solution.irradiance(), beside)


def _density(scene: Scene, tracer: EmbreeTracer) -> None:
    bake(scene, vertex_receivers([floor_mesh(4)]), _settings(gather="density"), tracer)


def _light_volume(scene: Scene, tracer: EmbreeTracer) -> None:
    for n_rays in (0, 4):
        bake(scene, vertex_receivers([floor_mesh(4)]), _settings(gather="light_volume", n_volume_rays=n_rays), tracer)


def _cube_maps(scene: Scene, tracer: EmbreeTracer) -> None:
    """Photons through cube maps of the scene."""
    receivers, settings = vertex_receivers([floor_mesh(4)]), _settings(tracer="multi_image", gather="density")
    region = lit_region(receivers.position)
    maps = MultiImageTracer.build(scene, tracer, region, settings.n_maps, settings.map_size, workers=_WORKERS)
    solve_apart(scene, [scene], receivers, settings, tracer, photon_tracer=maps)[0].irradiance()


def tiny_live() -> None:
    """Live light of the room, and what moves in it; no bake waits for that."""
    scene = tiny_scene()
    few = {"n_vertices": 100, "n_elements": 100, "n_links": 8, "n_element_links": 8, "n_direct": 1, "n_photons": 1000}
    settings = LiveSettings(**few, n_threads=1)
    live = Live(scene, live_surfaces(scene, settings), settings)
    for _ in range(2):
        while live.step():
            pass
        live.edit(ObjectMoved(1, np.eye(4)))
