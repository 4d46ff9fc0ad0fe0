"""Settings of a scene that would show bounces a second time, set while baked light is shown."""

from typing import Any

import bpy

_BEFORE = "photon_bake_settings"
"""Custom property of a scene: what the settings were before, by their paths; empty where nobody had set one."""

DIRECT_LIGHT = {
    "cycles.diffuse_bounces": 0,
    "cycles.use_fast_gi": False,
    "eevee.use_fast_gi": True,
    "eevee.fast_gi_method": "AMBIENT_OCCLUSION_ONLY",
    "eevee.ray_tracing_options.trace_max_roughness": 0.5,
}
"""What makes engines show direct light, gloss and glass alone; EEVEE's ray tracing then adds reflections, no bounce."""

TRANSLUCENT_LIGHT = {"cycles.transmission_bounces": 0}
"""The same for what goes through translucent surfaces, which Cycles counts as transmission like glass."""


def show_direct_light(scene: "bpy.types.Scene", translucent: bool) -> None:
    """Set what of the settings the scene has; `translucent` says whether to set those of translucency too."""
    if _BEFORE in scene:
        return
    before = {}
    for path, value in {**DIRECT_LIGHT, **(TRANSLUCENT_LIGHT if translucent else {})}.items():
        owner, name = owner_of(scene, path)
        if owner is not None:
            was_set = owner.is_property_set(name) or not path.startswith("cycles")
            before[path] = getattr(owner, name) if was_set else ""
            setattr(owner, name, value)
    scene[_BEFORE] = before


def restore_settings(scene: "bpy.types.Scene") -> None:
    """Set everything back to how it was."""
    if _BEFORE not in scene:
        return
    for path, value in scene[_BEFORE].to_dict().items():
        owner, name = owner_of(scene, path)
        if owner is None:
            continue
        if value == "":
            owner.property_unset(name)
        else:
            setattr(owner, name, value)
    del scene[_BEFORE]


def owner_of(scene: "bpy.types.Scene", path: str) -> tuple[Any, str]:
    """What has a setting, and the setting's name; None where this Blender has no such setting."""
    *parents, name = path.split(".")
    owner: Any = scene
    for parent in parents:
        owner = getattr(owner, parent, None)
    return (owner if hasattr(owner, name) else None), name
