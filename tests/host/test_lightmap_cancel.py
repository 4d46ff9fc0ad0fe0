"""Esc works in every stage of a bake of lightmaps, within half a second: a watchdog."""

from threading import Timer
from time import perf_counter, process_time

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest

from .scenes import add_lamp

LIMIT = 0.5  # s, from the cancel to the end
SOLVE = ("Placing texels", "Looking for seams", "Tracing photons", "Lighting surfaces", "Gathering light")
FINISH = ("Denoising", "Finishing lightmaps")
READ = ("Reading the scene", "Unwrapping", "Packing")


class CancelsIn(Progress):
    """Is cancelled some time after a stage began, from another thread, as by Esc.

    Attributes
    ----------
    since : (float, float) or None
        When it was, by the clock and by the processor's time: what other processes take of a busy machine is not ours.
    """

    def __init__(self, stage, after):
        super().__init__()
        self.stage, self.after, self.since, self._timer = stage, after, None, None

    def cancel(self):
        self.since = perf_counter(), process_time()
        super().cancel()

    def update(self, stage, fraction):
        super().update(stage, fraction)
        if stage == self.stage and self._timer is None:
            self._timer = Timer(self.after, self.cancel)
            self._timer.start()

    def seconds(self):
        return min(perf_counter() - self.since[0], process_time() - self.since[1])


def mesh_of(name, vertices, faces):
    """A mesh object of arrays, as from_pydata is slow for many faces alike."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).reshape(-1))
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).reshape(-1))
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(len(faces), dtype=np.int32) * faces.shape[1])
    mesh.update(calc_edges=True)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_landscape(n, n_leaves):
    """n × n squares of hills, and loose triangles above them, which are a chart each."""
    y, x = np.mgrid[: n + 1, : n + 1] / n
    height = 0.15 * np.sin(9 * x) * np.cos(8 * y) + 0.01 * np.sin(300 * x)
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    squares = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=2).reshape(-1, 4)
    mesh_of("Land", 10 * np.stack([x, y, height], axis=2).reshape(-1, 3), squares)
    random = np.random.default_rng(0)
    places = random.random((n_leaves, 1, 3)) * (10, 10, 1) + (0, 0, 2)
    leaves = places + random.normal(size=(n_leaves, 3, 3)) * random.uniform(0.02, 0.6, (n_leaves, 1, 1))
    mesh_of("Leaves", leaves.reshape(-1, 3), np.arange(3 * n_leaves).reshape(-1, 3))
    add_lamp("POINT", location=(5, 5, 6), energy=2000)


def bake(folder, progress, density, n_photons, rays):
    settings = LightmapSettings(density=density, atlas="shared", denoiser="own", max_size=4096)
    job = BakeJob.prepare(bpy.context, [LightmapRequest(settings, folder, "scene")], progress)
    quick = settings_for("draft", gather="final", n_photons=n_photons, n_gather_rays=rays, n_cache_elements=20_000)
    job.solve(quick, progress)


def assert_ends_at_once(stage, after, folder, *options):
    before = state()
    progress = CancelsIn(stage, after)
    with pytest.raises(Cancelled):
        bake(folder, progress, *options)
    assert progress.seconds() < LIMIT, f"{stage}: {progress.seconds():.2f} s"
    assert state() == before and not list(folder.iterdir())


def state():
    """What of Blender's data a bake could leave behind."""
    kinds = (bpy.data.meshes, bpy.data.objects, bpy.data.scenes, bpy.data.images, bpy.data.materials)
    return [len(kind) for kind in kinds], [len(mesh.uv_layers) for mesh in bpy.data.meshes]


@pytest.mark.parametrize("stage", [*READ, *SOLVE, *FINISH])
def test_a_small_bake_is_cancelled_at_each_stage(tmp_path, empty_scene, stage):
    add_landscape(20, 20)
    assert_ends_at_once(stage, 0.0, tmp_path, 4.0, 5000, 16)


@pytest.mark.long
@pytest.mark.parametrize(
    ("stage", "size"),
    [
        ("Reading the scene", (900, 1000, 4.0)),
        ("Unwrapping", (700, 1000, 4.0)),
        ("Packing", (100, 12_000, 90.0)),
        ("Placing texels", (100, 2000, 90.0)),
        ("Looking for seams", (100, 6000, 40.0)),
        ("Tracing photons", (100, 500, 20.0)),
        ("Lighting surfaces", (100, 500, 20.0)),
        ("Gathering light", (100, 500, 60.0)),
        ("Denoising", (60, 200, 80.0)),
        ("Finishing lightmaps", (60, 200, 80.0)),
    ],
)
def test_a_large_bake_is_cancelled_in_each_stage(tmp_path, empty_scene, stage, size):
    """Each takes over a second there, in the midst of which the bake is cancelled."""
    *scene, density = size
    add_landscape(*scene)
    after = 0.2 if stage == "Reading the scene" else 0.7
    assert_ends_at_once(stage, after, tmp_path, density, 1_500_000, 8)
