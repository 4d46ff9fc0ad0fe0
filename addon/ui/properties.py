"""The settings of a bake as Blender shows and saves them, made from `BakeSettings`."""

from dataclasses import Field, fields
from typing import Any, get_args, get_type_hints

import bpy

from ..settings import CHOICES, BakeSettings, Quality, settings_for

QUALITIES: tuple[Quality, ...] = get_args(Quality)
KNOBS = fields(BakeSettings)
PRESET_KNOBS = [knob.name for knob in KNOBS if len({getattr(settings_for(q), knob.name) for q in QUALITIES}) > 1]
"""The knobs that the quality presets differ in."""

CHOICE_MEANINGS = {
    "gather": "How photons become light",
    "tracer": "What finds where photons meet the scene",
    "atlas": "Which objects share an image",
    "file_format": "What the light is stored in",
    "denoiser": "What takes the noise out",
}
"""What the knobs of `CHOICES` and `LIGHTMAP_CHOICES` mean."""

_CHOICE_WORDS = {
    "final": ("Final Gather", "Every vertex looks around with rays: smooth, and exact with enough of them"),
    "density": ("Density Estimate", "Every vertex counts the photons around it: fast, but blurred by its radius"),
    "light_volume": (
        "Light Volume",
        "A few rays, or photons, fill a coarse grid, which every vertex reads: a draft in seconds",
    ),
    "embree": ("Embree", "Meets the meshes themselves: exact, and the fastest"),
    "multi_image": ("Multi-Image", "Meets pictures of the scene in cube maps: inexact, and slow on a CPU"),
}
_QUALITY_ITEMS = [
    ("draft", "Draft", "Seconds: to see where the light goes"),
    ("medium", "Medium", "Good for most scenes"),
    ("high", "High", "Little noise left; takes several times as long as Medium"),
    ("custom", "Custom", "Your own values, from the Sampling panel"),
]


def label(knob: str) -> str:
    """The name that a knob has in the panel: ``n_gather_rays`` is Gather Rays."""
    return knob.removeprefix("n_").replace("_", " ").title()


def _property(knob: Field) -> Any:
    """Blender's property for a knob, from the knob's own default, range and meaning."""
    kind = get_type_hints(BakeSettings)[knob.name]
    meta: dict[str, Any] = {"name": label(knob.name), "default": knob.default}
    if knob.name in CHOICES:
        items = [(choice, *_CHOICE_WORDS[choice]) for choice in CHOICES[knob.name]]
        return bpy.props.EnumProperty(items=items, description=CHOICE_MEANINGS[knob.name], **meta)
    meta["description"] = knob.metadata["meaning"]
    if kind is bool:
        return bpy.props.BoolProperty(**meta)
    meta.update(min=knob.metadata["low"], max=knob.metadata["high"])
    if kind is int:
        return bpy.props.IntProperty(**meta)
    return bpy.props.FloatProperty(**meta, precision=3, step=1)


def _get_quality(properties: "PhotonBakeProperties") -> int:
    """The preset whose values the knobs have, or Custom: nothing of its own is stored, so the two cannot disagree."""
    for i, quality in enumerate(QUALITIES):
        preset = settings_for(quality)
        if all(getattr(properties, name) == getattr(preset, name) for name in PRESET_KNOBS):
            return i
    return len(QUALITIES)


def _set_quality(properties: "PhotonBakeProperties", index: int) -> None:
    if index < len(QUALITIES):
        preset = settings_for(QUALITIES[index])
        for name in PRESET_KNOBS:
            setattr(properties, name, getattr(preset, name))


class PhotonBakeProperties(bpy.types.PropertyGroup):
    """What ``scene.photon_bake`` holds: every knob of `BakeSettings` under its own name, and these."""

    __annotations__ = {
        "quality": bpy.props.EnumProperty(
            name="Quality",
            description="Sets the values under Sampling",
            items=_QUALITY_ITEMS,
            get=_get_quality,
            set=_set_quality,
        ),
        "attribute": bpy.props.StringProperty(
            name="Attribute",
            description="Colour attribute that the light is written to, made if it is not there",
            default="Indirect",
        ),
        "light_group": bpy.props.StringProperty(
            name="Light Group",
            description="Bake the light of this light group of the view layer alone; empty for all light",
            default="",
        ),
        "selected_only": bpy.props.BoolProperty(
            name="Selected Only",
            description="Write light to the selected objects only; all objects still scatter and block it",
            default=False,
        ),
        **{knob.name: _property(knob) for knob in KNOBS},
    }

    def settings(self) -> BakeSettings:
        """The knobs as the engine takes them."""
        return BakeSettings(**{knob.name: getattr(self, knob.name) for knob in KNOBS})


def register() -> None:
    """Give every scene its settings, ``scene.photon_bake``."""
    bpy.utils.register_class(PhotonBakeProperties)
    bpy.types.Scene.photon_bake = bpy.props.PointerProperty(type=PhotonBakeProperties, name="Photon Bake")


def unregister() -> None:
    """Take them away again."""
    del bpy.types.Scene.photon_bake
    bpy.utils.unregister_class(PhotonBakeProperties)
