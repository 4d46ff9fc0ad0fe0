"""What light groups cost: all light in one bake, each group apart by one solve, and a bake after the other.

Lamps, emissive objects and the world of each scene are shared out over three groups, in turn by their names; the demo
room's sun, sky and a lamp are a group each.
"""

import os
import sys
import tempfile
from pathlib import Path
from time import process_time

import bpy
import numpy as np
from figures import table
from mixer_pictures import demo_room
from photon_bake.addon.blender.read.lamps.light_layers import group_names
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest

NAMES = ("Key", "Fill", "Rim")
_OF_NORMAL = np.sqrt(2 / np.pi)  # mean of what a normal distribution is off, over its standard deviation
HEAD = [
    "Scene",
    "Quality",
    "Groups",
    "Processor time over one bake's",
    "of bakes one by one",
    "Difference, %",
    "Noise, %",
]


def share_out():
    """Put all that gives light into groups."""
    layer = bpy.context.view_layer
    for name in NAMES:
        layer.lightgroups.add(name=name)
    lamps = sorted((obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"), key=lambda obj: obj.name)
    glowing = sorted((obj for obj in bpy.context.scene.objects if _glows(obj)), key=lambda obj: obj.name)
    for i, obj in enumerate([*lamps, *glowing]):
        obj.lightgroup = NAMES[i % len(NAMES)]
    if bpy.context.scene.world:
        bpy.context.scene.world.lightgroup = NAMES[-1]


def _glows(obj):
    trees = [slot.material.node_tree for slot in obj.material_slots if slot.material and slot.material.node_tree]
    return any(node.type == "EMISSION" for tree in trees for node in tree.nodes)


def baked(quality, light_group="", apart=False):
    """The light of a bake, its processor time and its groups."""
    groups = group_names(bpy.context.view_layer, "Indirect") if apart else ()
    wanted = [VertexRequest(groups=groups)]
    job = BakeJob.prepare(bpy.context, wanted, Progress(), light_group=light_group, apart=apart)
    start = process_time()
    light = job.solve(settings_for(quality), Progress()).irradiance
    return light, process_time() - start, list(job.groups)


def row(name, path, quality):
    """Figures of a scene; without a path of the demo room."""
    if path is None:
        with tempfile.TemporaryDirectory() as folder:
            demo_room(Path(folder) / "demo.blend")
    else:
        bpy.ops.wm.open_mainfile(filepath=str(path))
        share_out()
    whole, once, _ = baked(quality)
    together, apart, groups = baked(quality, apart=True)
    one_by_one = sum(baked(quality, group)[1] for group in groups)
    mean = float(whole.value.mean())
    off = float(np.abs((together.value - whole.value).mean(axis=1)).mean()) / mean
    noise = _OF_NORMAL * float(np.hypot(together.stderr, whole.stderr).mean()) / mean
    ratios = f"{apart / once:.2f}", f"{one_by_one / once:.2f}"
    return [name, quality, str(len(groups)), *ratios, f"{100 * off:.1f}", f"{100 * noise:.1f}"]


def tables(scenes, quality="medium"):
    """The table, of those of the scenes that have several lights."""
    rows = [
        row(name, path, quality) for name, path in {"demo": None, **scenes}.items() if name in {"demo", "classroom"}
    ]
    return [table("Light groups apart, and bakes of all light", HEAD, rows)]


if __name__ == "__main__":
    for argument in sys.argv[2:]:
        scene = {"demo": None}.get(argument, Path(argument))
        print(row(Path(argument).stem, scene, sys.argv[1]), flush=True)
    os._exit(0)
