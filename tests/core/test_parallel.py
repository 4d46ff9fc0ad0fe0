"""Work on threads: how many of them the memory lets work at a time, and how they are cancelled."""

import numpy as np
import pytest
from photon_bake.addon import parallel
from photon_bake.addon.gather.lobe_rays import mean_over_rays
from photon_bake.addon.parallel import Workers
from photon_bake.addon.receivers import camera_points
from photon_bake.addon.receivers.coverage import texels_of
from photon_bake.addon.tracers import LightTracer
from photon_bake.addon.tracers.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, scene_of
from photon_bake.tests.core.test_camera_points import BOX, camera_with


@pytest.fixture
def used(monkeypatch):
    """How many threads each loop takes."""
    numbers, of_map = [], parallel.ordered_map

    def counted(function, items, n_threads=0):
        numbers.append(n_threads)
        return of_map(function, items, 1)

    monkeypatch.setattr(parallel, "ordered_map", counted)
    return numbers


def look_through_a_camera(workers):
    scene = scene_of(*box())
    tracer = LightTracer(scene, EmbreeTracer(scene))
    camera_points(scene, tracer, camera_with("perspective", size=(8, 6)), BOX, 16, workers)


def follow_gloss(workers):
    mean_over_rays(np.full(10, 4), lambda k, random: np.ones((len(k), 3)), "Following gloss", 1, workers)


def place_texels(workers):
    corners = np.array([[(0, 0), (9, 0), (0, 9)]], float)
    texels_of(corners, np.array([(9, 9)]), workers)


@pytest.mark.parametrize("work, megabytes", [(look_through_a_camera, 40), (follow_gloss, 250), (place_texels, 40)])
def test_large_work_is_done_by_fewer_threads(used, work, megabytes):
    """`megabytes`: what a thread takes at least."""
    for memory in (100, 1000):
        work(Workers(n_threads=64, memory=memory))
        assert 1 <= used.pop() <= max(memory / megabytes, 1)
