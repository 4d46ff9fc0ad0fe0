"""The light mixer's levels, ``scene.photon_bake.mixer``: one entry a light group that the last bake has apart."""

from collections.abc import Sequence
from typing import Any

import bpy

from ...blender.compositing.nodes import Color, set_mix
from .show import strength_property, update_levels

LIGHT_GROUPS = [
    ("together", "All Together", "One layer that has all light", 0),
    ("one", "One", "The light of one light group of the view layer alone", 1),
    (
        "apart",
        "Each Apart",
        "Beside all light a layer for each light group, by one solve, whose strength and color the light mixer sets",
        2,
    ),
]
"""What `light_groups` may be. Files keep the numbers."""


class PhotonBakeLightLayer(bpy.types.PropertyGroup):
    """How a light group's light is mixed with that of the others; changes are seen at once."""

    def _changed(self, context: Any) -> None:
        update_mix(self.id_data)

    __annotations__ = {
        "name": bpy.props.StringProperty(name="Light Group", description="Whose light this layer is"),
        "use": bpy.props.BoolProperty(
            name="Use", description="Whether this light is in the mix", default=True, update=_changed
        ),
        "strength": strength_property("this light", "as it was baked", _changed),
        "color": bpy.props.FloatVectorProperty(
            name="Color",
            description="What this light is multiplied by besides; white is as it was baked",
            subtype="COLOR",
            size=3,
            default=(1.0, 1.0, 1.0),
            min=0.0,
            max=1.0,
            update=_changed,
        ),
    }


def set_layers(scene: Any, names: Sequence[str]) -> None:
    """Have a layer for each of these light groups; those that there were keep their levels."""
    mixer = scene.photon_bake.mixer
    if [layer.name for layer in mixer] == list(names):
        return
    before = {layer.name: (layer.use, layer.strength, tuple(layer.color)) for layer in mixer}
    mixer.clear()
    for name in names:
        layer = mixer.add()
        layer.name = name
        if name in before:
            layer.use, layer.strength, layer.color = before[name]


def reset_layers(scene: Any) -> None:
    """Mix all layers as they were baked."""
    for layer in scene.photon_bake.mixer:
        layer.use, layer.strength, layer.color = True, 1.0, (1.0, 1.0, 1.0)


def mix_of(scene: Any) -> dict[str, Color]:
    """What each light group's light is multiplied by."""
    return {
        layer.name: tuple(layer.strength * layer.use * channel for channel in layer.color)
        for layer in scene.photon_bake.mixer
    }


def update_mix(scene: Any) -> None:
    """Show the levels in materials and in the compositor, where light is shown there."""
    update_levels(scene)
    set_mix(scene, mix_of(scene))


def get_light_groups(properties: Any) -> int:
    """How light groups are baked: one alone where it is named, as by scripts and files of earlier versions."""
    return 1 if properties.light_group else int(properties.light_groups_chosen)


def set_light_groups(properties: Any, number: int) -> None:
    """Choose how light groups are baked."""
    properties.light_groups_chosen = number
    if number != 1:
        properties.light_group = ""


def register() -> None:
    """Make the levels known."""
    bpy.utils.register_class(PhotonBakeLightLayer)


def unregister() -> None:
    """Take them away again."""
    bpy.utils.unregister_class(PhotonBakeLightLayer)
