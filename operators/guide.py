"""Open Guide: the manual, which the extension brings along."""

from pathlib import Path
from typing import Any

import bpy

GUIDE = Path(__file__).parents[1] / "docs" / "guide.md"


class PHOTON_BAKE_OT_guide(bpy.types.Operator):
    """Read how to bake, what each setting does, and what to do about each message"""

    bl_idname = "photon_bake.guide"
    bl_label = "Photon Bake Guide"

    def execute(self, context: Any) -> set[str]:
        bpy.ops.wm.url_open(url=GUIDE.as_uri())
        return {"FINISHED"}
