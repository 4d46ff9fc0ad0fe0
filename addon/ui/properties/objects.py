"""Settings of single objects, ``object.photon_bake``: they win over the scene's, and the command heeds them."""

from typing import Any

import bpy

_OVERRIDE = {"override": {"LIBRARY_OVERRIDABLE"}}


class PhotonBakeObjectProperties(bpy.types.PropertyGroup):
    """What ``object.photon_bake`` holds."""

    __annotations__ = {
        "exclude": bpy.props.BoolProperty(
            name="Exclude",
            description="Bake no light to this object; it casts and reflects light as ever",
            default=False,
            **_OVERRIDE,
        ),
        "density": bpy.props.FloatProperty(
            name="Density",
            description="Factor of its lightmap's texels a meter",
            default=1.0,
            min=1 / 64,
            max=64.0,
            soft_min=0.25,
            soft_max=4.0,
            **_OVERRIDE,
        ),
        "refine": bpy.props.EnumProperty(
            name="Refine",
            description="Whether Refine may add vertices to its mesh",
            items=[
                ("as_asked", "As Asked", "Where its light needs them", 0),
                ("never", "Never", "The mesh stays as it is, for all objects that share it", 1),
            ],
            default="as_asked",
            **_OVERRIDE,
        ),
    }


def settings_of(obj: "bpy.types.Object") -> dict[str, Any]:
    """An object's settings by name."""
    return {name: getattr(obj.photon_bake, name) for name in PhotonBakeObjectProperties.__annotations__}


def register() -> None:
    """Give every object its settings."""
    bpy.utils.register_class(PhotonBakeObjectProperties)
    bpy.types.Object.photon_bake = bpy.props.PointerProperty(
        type=PhotonBakeObjectProperties, name="Photon Bake", **_OVERRIDE
    )


def unregister() -> None:
    """Take them away again."""
    del bpy.types.Object.photon_bake
    bpy.utils.unregister_class(PhotonBakeObjectProperties)
