"""What the showing of baked light is set to: ``scene.photon_bake.shown``."""

from typing import Any

import bpy

from ...blender.compositing.nodes import has_pass_nodes
from ...blender.read.lamps.light_layers import attribute_of, property_of
from ...blender.show import (
    Layer,
    LightSource,
    follow_changes,
    follow_undo,
    has_layers,
    set_levels,
    use_baked_light,
)
from ...core.errors import BakeError
from ..staleness import own_changes

_IN_COMPOSITOR = (
    "The scene's compositor adds the camera's pass, and materials would show that light a second time: take it out "
    "first (Remove from Compositor)."
)


def strength_property(what: str, one: str, update: Any) -> Any:
    """Blender's property for what some light is multiplied by; `one` says what 1 is."""
    return bpy.props.FloatProperty(
        name="Strength",
        description=f"What {what} is multiplied by; 1 is {one}",
        default=1.0,
        min=0.0,
        soft_max=4.0,
        update=update,
    )


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
        "strength": strength_property("baked light", "what bounces add to direct light", _changed),
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
        If no object has baked light, or the compositor adds it.
    """
    if has_pass_nodes(scene):
        raise BakeError(_IN_COMPOSITOR)
    properties, shown = scene.photon_bake, scene.photon_bake.shown
    preferred: LightSource = "lightmap" if "lightmap" in properties.targets else "vertex"
    with own_changes():
        return use_baked_light(scene, shown_layers(scene), shown.strength, shown.use, preferred)


def update_levels(scene: Any) -> None:
    """Let what is shown have the strengths of a scene's settings."""
    shown = scene.photon_bake.shown
    with own_changes():
        set_levels(scene, shown_layers(scene), shown.strength, shown.use)


@bpy.app.handlers.persistent
def _after_undo(*_: Any) -> None:
    follow_undo()


@bpy.app.handlers.persistent
def _after_update(_scene: Any, depsgraph: Any) -> None:
    if depsgraph.mode == "RENDER":  # where instances lose their object's color once Python has seen its data-block
        return
    if depsgraph.id_type_updated("MATERIAL") or depsgraph.id_type_updated("NODETREE"):
        follow_changes([update.id.original for update in depsgraph.updates])


def _handlers() -> list[tuple[list, Any]]:
    """Blender's lists of handlers, and what is in them while the extension is on."""
    of = bpy.app.handlers
    return [(of.undo_post, _after_undo), (of.redo_post, _after_undo), (of.depsgraph_update_post, _after_update)]


def register() -> None:
    """Make the settings known."""
    bpy.utils.register_class(PhotonBakeShownProperties)
    for handlers, handler in _handlers():
        handlers.append(handler)


def unregister() -> None:
    """Take them away again."""
    for handlers, handler in _handlers():
        handlers.remove(handler)
    bpy.utils.unregister_class(PhotonBakeShownProperties)
