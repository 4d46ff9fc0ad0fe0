"""What the tests of lightmaps share: a small scene, its bake, and what came of it."""

import bpy
import numpy as np
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import MADE_UV_MAP, LightmapSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest

from .scenes import add_cube, add_lamp, add_plane

QUICK = settings_for(
    "draft", gather="final", n_photons=5000, n_gather_rays=16, n_cache_elements=200, n_cache_rays=4, n_threads=1
)


def add_room():
    """A red cube on a floor under a lamp."""
    add_plane("Floor", size=6.0)
    add_cube("Box").location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)


def prepare(folder, names=None, **settings):
    """A bake of lightmaps that is ready to be solved."""
    wanted = LightmapRequest(LightmapSettings(**settings), folder, "scene")
    return BakeJob.prepare(bpy.context, [wanted], Progress(), names)


def bake(folder, names=None, **settings):
    """Bake lightmaps with hardly any light; returns the job and what was solved."""
    job = prepare(folder, names, **{"density": 4.0, **settings})
    solved = job.solve(QUICK, Progress())
    job.write(solved, Progress())
    return job, solved


def uv_of(obj, name=MADE_UV_MAP):
    """Texture coordinates of a mesh object's corners, (c, 2)."""
    uv = np.empty((len(obj.data.loops), 2), np.float32)
    obj.data.uv_layers[name].uv.foreach_get("vector", uv.ravel())
    return uv


def pixels_of(image):
    """Pixels of one of Blender's images, (height, width, 4)."""
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(image.size[1], image.size[0], -1)


def state():
    """What a bake of lightmaps may change."""
    meshes = {mesh.name: [layer.name for layer in mesh.uv_layers] for mesh in bpy.data.meshes}
    objects = {obj.name: sorted(obj.keys()) for obj in bpy.data.objects}
    return meshes, objects, [image.name for image in bpy.data.images], [scene.name for scene in bpy.data.scenes]
