"""The light mixer, and how light groups are baked, as the panel draws them."""

from typing import Any


def draw_mixer(layout: Any, context: Any) -> None:
    """A row for each light group that the last bake has apart; nothing where it has none."""
    mixer = context.scene.photon_bake.mixer
    if not mixer:
        return
    column = layout.column(align=True)
    row = column.row()
    row.label(text="Light Mixer", icon="LIGHT")
    row.operator("photon_bake.reset_mixer", text="", icon="LOOP_BACK", emboss=False)
    for layer in mixer:
        row = column.row(align=True)
        row.prop(layer, "use", text="", icon="OUTLINER_OB_LIGHT" if layer.use else "LIGHT")
        levels = row.split(factor=0.8, align=True)
        levels.active = layer.use
        levels.prop(layer, "strength", text=layer.name, slider=True)
        levels.prop(layer, "color", text="")


def draw_light_groups(layout: Any, context: Any) -> None:
    """How light groups are baked, and which, if one is."""
    properties = context.scene.photon_bake
    layout.prop(properties, "light_groups")
    if properties.light_groups == "one":
        layout.prop_search(properties, "light_group", context.view_layer, "lightgroups")
