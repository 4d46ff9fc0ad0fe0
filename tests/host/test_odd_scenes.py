"""Odd scenes bake, or are refused for a good reason and left as they were."""

import re
from collections import Counter

import bpy
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from photon_bake.addon.blender.write.baked_copies import remove_copies
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest
from photon_bake.tests.host.file_contents import contents, differences
from photon_bake.tests.host.odd_scenes import build, odd_scenes

N_SCENES, N_MANY = 60, 500
ATTRIBUTE = "Indirect"

GOOD_REASONS = (
    "^Nothing to bake: the scene has no mesh object that renders show",
    "^Nothing to bake: Object '.*' (has no faces|has zero scale|has vertices or a transform that are not finite)",
    "^Nothing to bake: Object '.*': its modifier '.*' makes a new mesh that shows no attribute",
)
"""Why a scene may be refused."""

REASONS_OF_NAMED = (
    "^There is no object '.*' in the view layer",
    "^Object '.*' (is hidden in renders|has no faces|has zero scale|has vertices or a transform that are not finite)",
    "^Object '.*': its modifier '.*' makes a new mesh that shows no attribute",
)
"""Why one may be refused in which objects were asked for by name."""


def bake(odd):
    """Bake an odd scene at the lowest quality; what it held before, and the light."""
    objects = build(odd)
    before = contents()
    names = [obj.name for obj in objects[: odd.targets]] or None
    chosen = BakeSettings(
        gather=odd.gather,
        n_photons=1000,
        n_gather_rays=4,
        n_cache_elements=100,
        n_cache_rays=odd.n_cache_rays,
        n_nearest=8,
        add_direct=odd.add_direct,
        n_threads=1,
    )
    try:
        job = BakeJob.prepare(bpy.context, [VertexRequest(ATTRIBUTE, odd.copies)], Progress(), names)
        solved = job.solve(chosen, Progress())
        job.write(solved, Progress())
    except BakeError as error:
        return before, str(error)
    return before, solved.irradiance


def check(odd, counts):
    """Bake an odd scene: the light is finite, and once copies are removed nothing but the attribute is new."""
    before, light = bake(odd)
    remove_copies()
    changed = [path for path in differences(before, contents()) if not in_edited_mesh(path)]
    if isinstance(light, str):
        counts["refused"] += 1
        reasons = [*GOOD_REASONS, *(REASONS_OF_NAMED if odd.targets else ())]
        assert light.endswith(".") and re.search("|".join(reasons), light), light
        counts[re.sub("'[^']*'", "'…'", light)[:120]] += 1
        assert not changed, changed
        return
    counts["baked"] += 1
    for values in (light.value, light.stderr, *light.passes.values()):
        assert np.isfinite(values).all()
        assert (values >= 0).all() or any(lamp.energy < 0 for lamp in odd.lamps)
    assert all(re.fullmatch(f"meshes/[^/]*/attributes/{ATTRIBUTE}", path) for path in changed), changed


def in_edited_mesh(path):
    """Whether what the edit mode of a mesh held is now the mesh's own, as on saving."""
    meshes = {obj.data.name_full for obj in bpy.data.objects if obj.mode != "OBJECT"}
    return path.startswith("meshes/") and path.split("/")[1] in meshes


@pytest.mark.parametrize("n_scenes", [N_SCENES, pytest.param(N_MANY, marks=pytest.mark.long)])
def test_odd_scenes_bake_or_say_why_not(n_scenes):
    counts = Counter()

    @settings(
        max_examples=n_scenes,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(odd_scenes)
    def all_of_them(odd):
        check(odd, counts)

    all_of_them()
    print("\n".join(f"{n} {what}" for what, n in counts.most_common()))
    assert counts["baked"] + counts["refused"] >= n_scenes
    assert counts["baked"] >= n_scenes / 2
