"""What a bake is asked for, and the objects that it is asked for."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import bpy

from ...settings.bake import BakeSettings
from ...settings.lightmap import LightmapSettings
from ..read.visibility import rendered_objects


@dataclass(frozen=True)
class Asked:
    """What a bake is asked for.

    Attributes
    ----------
    scene : bpy.types.Scene
    view_layer : bpy.types.ViewLayer
    targets : frozenset of str
    settings : BakeSettings
    lightmap : LightmapSettings
    attribute, light_group : str
    copies, selected_only : bool
    """

    scene: Any
    view_layer: Any
    targets: frozenset[str]
    settings: BakeSettings
    lightmap: LightmapSettings
    attribute: str
    light_group: str
    copies: bool
    selected_only: bool

    @cached_property
    def shown(self) -> "list[bpy.types.Object]":
        """The objects that renders show."""
        return rendered_objects(self.view_layer)

    @cached_property
    def chosen(self) -> "list[bpy.types.Object]":
        """Those of them that are asked for."""
        if not self.selected_only:
            return self.shown
        return [obj for obj in self.shown if obj.select_get(view_layer=self.view_layer)]

    @cached_property
    def meshes(self) -> "list[bpy.types.Object]":
        """The mesh objects that are asked for."""
        return [obj for obj in self.chosen if obj.type == "MESH"]
