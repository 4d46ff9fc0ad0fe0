"""Work on threads: how many of them the memory lets work at a time, and how they are cancelled."""

import numpy as np
import pytest
from photon_bake.addon.core import parallel
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.gather.rays.lobe_rays import mean_over_rays
from photon_bake.addon.output.lightmap import FinishOptions, finish_lightmaps
from photon_bake.addon.receivers import camera_points, texel_receivers
from photon_bake.addon.receivers.lightmap.coverage import texels_of
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, plane, scene_of
from photon_bake.tests.core.test_camera_points import BOX, camera_with
from photon_bake.tests.core.unwrapped import unwrapped_box


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
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    camera_points(scene, tracer, camera_with("perspective", size=(8, 6)), BOX, 16, workers)


def follow_gloss(workers):
    mean_over_rays(np.full(10, 4), lambda k, key, first: np.ones((len(k), 3)), "Following gloss", 1, workers)


def place_texels(workers):
    corners = np.array([[(0, 0), (9, 0), (0, 9)]], float)
    texels_of(corners, np.array([(9, 9)]), workers)


@pytest.mark.parametrize("work, megabytes", [(look_through_a_camera, 40), (follow_gloss, 4), (place_texels, 6)])
def test_large_work_is_done_by_fewer_threads(used, work, megabytes):
    """`megabytes`: what a thread takes at least."""
    for memory in (100, 1000):
        work(Workers(n_threads=64, memory=memory))
        assert 1 <= used.pop() <= max(memory / megabytes, 1)


class CancelsAfter(Progress):
    """Is cancelled after it was asked some times; counts how often it was."""

    def __init__(self, times=1_000_000):
        super().__init__()
        self.times, self.asked = times, 0

    def check(self):
        self.asked += 1
        if self.asked > self.times:
            self.cancel()
        super().check()


def coincident_search(progress):
    TransparencyTracer(*of_plane(), progress)


def of_plane():
    scene = scene_of(*plane())
    return scene, EmbreeTracer(scene)


def texels_and_seams(progress):
    return texel_receivers([unwrapped_box(0.02, smooth=True)], [(40, 50)], of_plane()[1], Workers(progress=progress))


def borders(progress):
    receivers, texels = texel_receivers([unwrapped_box(0.02, smooth=True)], [(40, 50)])
    values = np.random.default_rng(0).random((len(receivers), 3), np.float32)
    stderr = np.zeros(len(receivers), np.float32)
    finish_lightmaps(values, stderr, receivers, texels, FinishOptions("none"), Workers(progress=progress, n_threads=2))


@pytest.mark.parametrize("work, least", [(coincident_search, 1), (texels_and_seams, 10), (borders, 20)])
def test_whenever_it_is_cancelled_it_ends_at_once(work, least):
    """Long work asks often whether it is to go on, and never once it was told not to."""
    whole = CancelsAfter()
    work(whole)
    assert whole.asked >= least
    for times in np.unique(np.linspace(0, whole.asked - 1, 12).astype(int)):
        progress = CancelsAfter(times)
        with pytest.raises(Cancelled):
            work(progress)
        assert progress.asked <= times + 3  # one a thread


def test_a_part_is_cancelled_with_the_whole():
    whole = Progress()
    part = whole.part(0, 0.5).part(0, 0.5)
    part.check()
    part.cancel()
    assert whole.cancelled and part.cancelled
    with pytest.raises(Cancelled):
        part.check()
