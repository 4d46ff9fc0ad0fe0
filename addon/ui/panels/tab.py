"""What the tab's panels have in common."""

from dataclasses import Field, fields
from textwrap import wrap
from typing import Any

from ...settings.bake import BakeSettings
from ...settings.camera import CameraSettings
from ...settings.lightmap import LightmapSettings
from ..properties.scene import label
from ..properties.zero_values import draw_zero
from ..state import bake_state

_ZEROS: "dict[str, Field[Any]]" = {
    knob.name: knob
    for settings in (BakeSettings, LightmapSettings, CameraSettings)
    for knob in fields(settings)
    if knob.metadata.get("zero")
}
"""Numbers whose 0 means Off or Auto."""


class Tab:
    """Where the panels are: mixed into each."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Photon Bake"


class Section(Tab):
    """A part of the main panel, with a header of its own."""

    bl_parent_id = "PHOTON_BAKE_PT_bake"


class TargetSection(Section):
    """A part that is there for one target alone.

    Attributes
    ----------
    target : str
    """

    target = ""

    @classmethod
    def poll(cls, context: Any) -> bool:
        return cls.target in context.scene.photon_bake.targets


def settings_column(layout: Any) -> Any:
    """A column in the look of Blender's own settings, greyed while a bake runs: it has its settings already."""
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    column.enabled = not bake_state.running
    return column


def draw_knobs(column: Any, group: Any, *names: str) -> None:
    """Draw knobs of a property group, one a line."""
    for name in names:
        if name in _ZEROS:
            draw_zero(column, group, _ZEROS[name], label(name))
        else:
            column.prop(group, name)


def draw_sentence(column: Any, sentence: str, icon: str, width: int) -> None:
    """A label holds one line, so a long sentence takes several of `width` characters."""
    for i, line in enumerate(wrap(sentence, width)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


def characters_in(context: Any) -> int:
    """How many characters about fit into a label with an icon, in the sidebar as wide as it is."""
    return max(16, int(context.region.width / context.preferences.system.ui_scale / 6.5) - 8)
