"""The host tests run in Blender or in the bpy module; each starts from an empty file with the checkout registered."""

import os
import sys
from pathlib import Path

import bpy
import photon_bake
import pytest
from photon_bake.addon.blender.read.materials import cycles_bake
from photon_bake.addon.pipeline.warm_up import compiler

from .claims import Claims
from .scenes import add_cube, add_lamp, add_plane

STATUS = pytest.StashKey[int]()


@pytest.fixture(scope="session", autouse=True)
def registered():
    """The checkout as an enabled add-on, for the whole run."""
    photon_bake.register()
    compiler._tried = True  # kernels are compiled as tests need them
    yield
    photon_bake.unregister()


@pytest.fixture(autouse=True)
def empty_scene(registered):
    """A new file with one scene and nothing in it."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene


@pytest.fixture
def empty_cache():
    """None of Cycles' earlier bakes of sockets is known."""
    cycles_bake._baked.clear()


@pytest.fixture
def room(empty_scene):
    """A cube on a floor under a lamp, and the smallest bake there is."""
    add_plane("Floor", size=8.0, smooth=True)
    cube = add_cube("Box")
    cube.location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    properties = bpy.context.scene.photon_bake
    properties.n_photons, properties.n_gather_rays = 5000, 16
    properties.n_cache_elements, properties.n_cache_rays = 200, 4
    return properties


def pytest_configure(config):
    """Share the files with another run where one is beside it."""
    if folder := os.environ.get("PHOTON_BAKE_CLAIMS"):
        config.pluginmanager.register(Claims(Path(folder)))


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session, exitstatus):
    """Remember the status for the end."""
    session.config.stash[STATUS] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """Leave without the bpy module's own end, in which version 4.5 may hang for ever once tests have run."""
    if bpy.app.binary_path == "" and STATUS in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[STATUS])
