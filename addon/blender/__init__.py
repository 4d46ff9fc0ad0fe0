"""Blender's side of a bake: reads a scene out of Blender and writes light back into it.

The only engine room that knows `bpy`. It turns data-blocks into the plain arrays of `addon.scene` and
`addon.receivers`, and values into colour attributes; nothing here computes light. Reading changes no data-block:
`write_color_attribute`, `write_lightmaps` and baked copies do, after a bake, and what people ask for besides: refined
meshes, baked light in materials and in the compositor.
"""

from .read.bake_objects import bake_objects
from .read.camera import read_camera
from .read.materials.materials import READING
from .read.meshes.displacement import displace
from .read.meshes.vertex_meshes import receiver_meshes
from .read.motion.movement import Movement
from .read.motion.shutter import check_simulations, other_times, shutter_frames, shutter_middle
from .read.render_graph import in_render_graph, move_to_frame
from .read.scene import SceneReading, read_scene
from .write.color_attribute import check_color_attribute, write_color_attribute

__all__ = [
    "READING",
    "Movement",
    "SceneReading",
    "bake_objects",
    "check_color_attribute",
    "check_simulations",
    "displace",
    "in_render_graph",
    "move_to_frame",
    "other_times",
    "read_camera",
    "read_scene",
    "receiver_meshes",
    "shutter_frames",
    "shutter_middle",
    "write_color_attribute",
]
