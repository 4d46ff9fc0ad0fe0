"""The tracer on Blender's own BVH passes every tracer's tests."""

import pytest
from photon_bake.addon.blender import BVHTracer
from photon_bake.tests.core.test_tracers import *  # noqa: F403


@pytest.fixture
def tracer_class():
    return BVHTracer
