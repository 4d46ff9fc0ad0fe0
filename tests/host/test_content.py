"""Digests of contents."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from photon_bake.operators.jobs.content import content_digest
from photon_bake.tests.core.scenes import box, scene_of


@dataclass(frozen=True)
class Thing:
    values: np.ndarray
    names: tuple[str, ...] = ()


def test_equal_contents_have_equal_digests():
    things = [Thing(np.arange(6.0).reshape(2, 3), ("a",)) for _ in range(2)]
    assert content_digest(things[0], {"b": 1}) == content_digest(things[1], {"b": 1})


@pytest.mark.parametrize(
    "other",
    [
        Thing(np.arange(6.0), ("a",)),
        Thing(np.arange(6.0).reshape(2, 3).astype(np.float32), ("a",)),
        Thing(np.arange(6.0).reshape(2, 3), ("b",)),
        Thing(np.arange(6.0).reshape(2, 3) + np.eye(2, 3) * 1e-15, ("a",)),
    ],
)
def test_other_contents_have_others(other):
    assert content_digest(Thing(np.arange(6.0).reshape(2, 3), ("a",))) != content_digest(other)


def test_a_scene_has_one():
    scene = scene_of(*box())
    moved = replace(scene, vertices=scene.vertices + np.float32(1e-3))
    assert content_digest(scene) == content_digest(scene_of(*box())) != content_digest(moved)


def test_what_has_none_is_said():
    with pytest.raises(TypeError, match="function"):
        content_digest(test_what_has_none_is_said)
