"""The Cornell box against converged Cycles. The scene is not part of the repository: without it these tests skip."""

import os
from functools import cache
from pathlib import Path

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import bake_objects, receiver_meshes
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.receivers import vertex_receivers
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.host.scenes import extracted, in_graph

SCENES = Path(os.environ.get("PHOTON_BAKE_SCENES", Path(__file__).resolve().parents[3] / "shared/scenes"))
CORNELL = SCENES / "cornell/cornell.blend"

pytestmark = pytest.mark.skipif(not CORNELL.exists(), reason=f"{CORNELL} is not there (set PHOTON_BAKE_SCENES)")


@pytest.fixture
def truth():
    return np.load(CORNELL.with_suffix(".npz"))


@cache
def at_probes(gather, quality, **changes):
    """E/π at each probe, (n, 3)."""
    bpy.ops.wm.open_mainfile(filepath=str(CORNELL))
    probes = vertex_receivers(in_graph(lambda graph: receiver_meshes(bake_objects(graph, ["Probes"]), graph)))
    scene = extracted()
    light = bake(scene, probes, settings_for(quality, gather=gather, **changes), EmbreeTracer(scene))
    return light.value[probes.targets[0].receiver_of_element].reshape(-1, 3, 3).mean(axis=1) / np.pi


@pytest.mark.parametrize(
    "gather, quality, bound",
    [
        ("light_volume", "draft", 0.12),
        ("final", "draft", 0.12),
        ("final", "medium", 0.06),
        pytest.param("final", "high", 0.03, marks=pytest.mark.long),
    ],
)
def test_cornell_box(truth, gather, quality, bound):
    keep = truth["keep"]
    got, mean = at_probes(gather, quality)[keep], truth["mean"][keep]
    noise2 = np.mean(truth["stderr"][keep] ** 2)
    assert np.sqrt(max(np.mean((got - mean) ** 2) - noise2, 0)) / mean.mean() <= bound
    assert got.mean(0) / mean.mean(0) == pytest.approx(np.ones(3), abs=0.02)


def test_photons_in_a_light_volume(truth):
    keep = truth["keep"]
    got, mean = at_probes("light_volume", "draft", n_volume_rays=0)[keep], truth["mean"][keep]
    assert np.sqrt(np.mean((got - mean) ** 2)) / mean.mean() <= 0.12
    assert got.mean(0) / mean.mean(0) == pytest.approx(np.ones(3), abs=0.03)


@pytest.mark.parametrize("gather", [pytest.param("density", marks=pytest.mark.long), "light_volume"])
def test_gathers_agree(truth, gather):
    keep = truth["keep"]
    final, other = (at_probes(name, "medium")[keep].mean(0) for name in ("final", gather))
    assert other / final == pytest.approx(np.ones(3), abs=0.03)
