"""Which frames a bake has: ``scene.photon_bake.frames``."""

from typing import Any

import bpy

from ...settings.frames import PLAYBACK_FOLDER, Frames


class PhotonBakeFramesProperties(bpy.types.PropertyGroup):
    """Whether all frames of the scene are baked, and how vertices keep their light."""

    __annotations__ = {
        "use": bpy.props.BoolProperty(
            name="Animation",
            description="Bake the frames from the scene's Start to its End, a Step apart, instead of the current one",
            default=False,
        ),
        "keeping": bpy.props.EnumProperty(
            name="Frames As",
            description="How vertices keep the light of frames",
            items=[
                ("texture", "Texture", "An image of vertices by frames, which a modifier plays back", 0),
                ("attributes", "Attributes", "A color attribute a frame: for few frames", 1),
            ],
            default="texture",
        ),
        "folder": bpy.props.StringProperty(
            name="Folder",
            description="Where images of vertices by frames go; // is the folder of the .blend file",
            default=f"//{PLAYBACK_FOLDER}",
            subtype="DIR_PATH",
            options={"OUTPUT_PATH", "PATH_SUPPORTS_BLEND_RELATIVE"},
        ),
    }

    def of_scene(self, scene: Any) -> Frames | None:
        """The frames of a scene; None for the current one alone."""
        return Frames(scene.frame_start, scene.frame_end, scene.frame_step) if self.use else None
