"""The host tests run in Blender or in the bpy module; each starts from an empty file with the checkout registered."""

import bpy
import photon_bake
import pytest


@pytest.fixture(scope="session", autouse=True)
def registered():
    """The checkout as an enabled add-on, for the whole run."""
    photon_bake.register()
    yield
    photon_bake.unregister()


@pytest.fixture(autouse=True)
def empty_scene(registered):
    """A new file with one scene and nothing in it."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene
