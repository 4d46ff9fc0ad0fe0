"""Embree's library, where wheels have it, and its trees: built, shared by threads and freed."""

import gc
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from time import sleep

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.parallel import once
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.tracing import embree_library
from photon_bake.addon.tracing.embree import EmbreeTracer, new_ray
from photon_bake.tests.core.scenes import merge, plane, scene_of
from photon_bake.tests.core.warp_loops import sample_uniform_sphere

pytestmark = pytest.mark.plain

# What the wheels of embreex 4.4.0.post1 hold for Python 3.11 to 3.14
WHEELS = {
    "manylinux_2_28_x86_64": ["embreex.libs/libembree4-4aef3270.so.4", "embreex.libs/libtbb-dcf63f8c.so.12"],
    "win_amd64": ["embreex.libs/embree4.dll", "embreex.libs/tbb12.dll"],
    "macosx_13_0_arm64": ["embreex/.dylibs/libembree4.4.dylib", "embreex/.dylibs/libtbb.12.11.dylib"],
}


@pytest.mark.parametrize("platform", WHEELS)
def test_the_library_is_found_in_each_systems_wheel(platform, tmp_path):
    for name in ["embreex/__init__.py", "embreex/rtcore.so", *WHEELS[platform]]:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert embree_library.find_library(tmp_path / "embreex") == tmp_path / WHEELS[platform][0]


def test_an_absent_library_is_said_in_one_sentence(tmp_path, monkeypatch):
    assert embree_library.find_library(tmp_path / "embreex") is None
    monkeypatch.setattr(embree_library, "find_library", lambda _: None)
    for cached in (embree_library._device, embree_library._library):
        monkeypatch.setattr(embree_library, cached.__name__, once(cached.__wrapped__))
    with pytest.raises(BakeError, match=r"embreex, which every bake needs, .* no Embree in it that can be loaded"):
        EmbreeTracer(scene_of(*plane()))


def test_threads_that_begin_at_once_share_a_device(monkeypatch):
    """Embree leaves geometry of another device out of a tree, and no ray would meet it."""
    devices, call, together = [], embree_library._call, Barrier(4)

    def slow(name, result, *arguments):
        if name == "rtcNewDevice":
            devices.append(name)
            sleep(0.05)
        return call(name, result, *arguments)

    def hits(_):
        together.wait()
        tracer = EmbreeTracer(scene_of(*plane(z=0)))
        return tracer.closest_hit(np.float32([[0.1, 0.2, 1]]), np.float32([[0, 0, -1]])).triangle[0] >= 0

    monkeypatch.setattr(embree_library, "_call", slow)
    monkeypatch.setattr(embree_library, "_device", once(embree_library._device.__wrapped__))
    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(hits, range(4)))
    assert len(devices) == 1


def test_a_ray_has_aligned_memory_of_its_own():
    rooms = [new_ray() for _ in range(20)]
    assert all(room.address % 16 == 0 and room.address == room.integers.ctypes.data for room in rooms)
    assert len({room.address for room in rooms}) == 20


def test_kinds_that_see_the_same_share_a_tree_and_trees_go_with_their_tracer(monkeypatch):
    freed, call = [], embree_library._call

    def spy(name, result, *arguments):
        freed.extend(arguments[0].value for _ in range(name == "rtcReleaseScene"))
        return call(name, result, *arguments)

    monkeypatch.setattr(embree_library, "_call", spy)
    scene = scene_of(*merge(plane(z=1), plane(z=0)))
    scene.objects.casts_shadow[0] = False
    tracer = EmbreeTracer(scene)
    handles = set(tracer.handles.tolist())
    assert len(handles) == (1 if len(scene.objects.names) == 0 else 2)
    del tracer
    gc.collect()
    assert set(freed) == handles


def test_many_threads_trace_as_one_does():
    random = stream(6)
    middle = random.uniform(-1, 1, (300, 1, 3))
    scene = scene_of((middle + random.uniform(-0.2, 0.2, (300, 3, 3))).reshape(-1, 3), np.arange(900))
    origins = random.uniform(-1, 1, (40_000, 3)).astype(np.float32)
    directions = sample_uniform_sphere(random.random((40_000, 2), np.float32))
    tracer = EmbreeTracer(scene)
    alone = tracer.closest_hit(origins, directions).triangle
    with ThreadPoolExecutor(8) as pool:
        parts = pool.map(lambda k: tracer.closest_hit(origins[k::8], directions[k::8]).triangle, range(8))
    for k, part in enumerate(parts):
        assert np.array_equal(part, alone[k::8])
