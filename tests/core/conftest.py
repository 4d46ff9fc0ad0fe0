"""The core's tests run without Blender: in this process none of its modules can be imported."""

import os
import sys
from importlib.abc import MetaPathFinder

import pytest

BLENDER_MODULES = {"_bpy", "bl_math", "blf", "bmesh", "bpy", "bpy_extras", "gpu", "gpu_extras", "imbuf", "mathutils"}


class NoBlender(MetaPathFinder):
    """Refuses Blender's modules as an environment without bpy would."""

    def find_spec(self, fullname, path=None, target=None):
        if fullname.partition(".")[0] in BLENDER_MODULES:
            raise ModuleNotFoundError(f"No module named {fullname!r} (tests/core runs without Blender)", name=fullname)


def blender_modules():
    return sorted(BLENDER_MODULES & set(sys.modules))


if blender_modules():
    raise pytest.UsageError("tests/core must run in a process of its own, without bpy: pytest tests/core")
sys.meta_path.insert(0, NoBlender())


def pytest_collection_modifyitems(config, items):
    """With kernels as plain Python, or with their indices checked, only tests run that are marked `plain`."""
    if any(os.environ.get(name, "0") not in ("", "0") for name in ("NUMBA_DISABLE_JIT", "NUMBA_BOUNDSCHECK")):
        chosen = [item for item in items if item.get_closest_marker("plain")]
        config.hook.pytest_deselected(items=[item for item in items if item not in set(chosen)])
        for item in chosen:  # NumPy warns of scalars' infinities and NaN, which compiled kernels make in silence
            item.add_marker(pytest.mark.filterwarnings("ignore::RuntimeWarning"))
        items[:] = chosen


@pytest.fixture(scope="session", autouse=True)
def without_blender():
    yield
    assert not blender_modules(), f"a core test has imported {', '.join(blender_modules())}"
