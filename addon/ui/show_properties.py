"""What the showing of baked light is set to: ``scene.photon_bake.shown``."""

from typing import Any

import bpy

from ..blender.light_layers import attribute_of, property_of
from ..blender.show import Layer, LightSource, has_layers, set_levels, use_baked_light
from .staleness import own_changes


class PhotonBakeShownProperties(bpy.types.PropertyGroup):
    """How strong baked light is shown, and whether it is; changes are seen at once."""

    def _changed(self, context: Any) -> None:
        update_levels(self.id_data)

    __annotations__ = {
        "use": bpy.props.BoolProperty(
            name="Show Baked Light",
            description="Off, to compare: the scene without baked light, with its own bounces",
            default=True,
            update=_changed,
        ),
        "strength": bpy.props.FloatProperty(
            name="Strength",
            description="What baked light is multiplied by; 1 is what bounces add to direct light",
            default=1.0,
            min=0.0,
            soft_max=4.0,
            update=_changed,
        ),
        "after_bake": bpy.props.BoolProperty(
            name="Show After Bake",
            description="Use baked light in materials as soon as a bake has ended",
            default=False,
        ),
    }


def shown_layers(scene: Any) -> list[Layer]:
    """The kinds of light that a scene's settings ask for: those of light groups where its meshes have them apart."""
    attribute = scene.photon_bake.attribute
    layers = [
        Layer(
            name=level.name,
            attribute=attribute_of(attribute, level.name),
            image_property=property_of(level.name),
            strength=level.strength if level.use else 0.0,
            color=tuple(level.color),
        )
        for level in scene.photon_bake.mixer
    ]
    return layers if has_layers(scene, layers) else [Layer(attribute=attribute)]


def show_baked_light(scene: Any) -> list[str]:
    """Show a scene's baked light as its settings say; returns warnings. Objects with both kinds show what Bake To has.

    Raises
    ------
    BakeError
        If no object has baked light.
    """
    properties, shown = scene.photon_bake, scene.photon_bake.shown
    preferred: LightSource = "lightmap" if "lightmap" in properties.targets else "vertex"
    with own_changes():
        return use_baked_light(scene, shown_layers(scene), shown.strength, shown.use, preferred)


def update_levels(scene: Any) -> None:
    """Let what is shown have the strengths of a scene's settings."""
    shown = scene.photon_bake.shown
    with own_changes():
        set_levels(scene, shown_layers(scene), shown.strength, shown.use)


def register() -> None:
    """Make the settings known."""
    bpy.utils.register_class(PhotonBakeShownProperties)


def unregister() -> None:
    """Take them away again."""
    bpy.utils.unregister_class(PhotonBakeShownProperties)
