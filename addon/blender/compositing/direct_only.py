"""Renders of direct light alone, to which a pass is added, and a switch that is off where renders have more."""

from typing import Any

import bpy

from ..read.visibility import rendered_objects
from ..show.eevee_world import dim_world, restore_worlds
from ..show.scene_settings import owner_of

MARK = "photon_bake"
"""Custom property of the nodes, trees and scenes that are ours."""

_HELD = f"{MARK}_direct_only"
_OLD_BOUNCES = f"{MARK}_max_bounces"  # of files that earlier versions saved
_SETTINGS: dict[str, Any] = {"cycles.max_bounces": 0, "eevee.use_raytracing": False}
"""What keeps Cycles and EEVEE to direct light. Both are set, whichever renders now, as another may be chosen later."""

_PASS = "pass"
"""Whose nodes dim a world."""

_EEVEE = 0
"""Blender's number of its own engine, which is registered first in any case."""

_WATCHED = {
    "engine": "render.engine",
    "bounces": "cycles.max_bounces",
    "rays": "eevee.use_raytracing",
}
"""What a switch looks at, by the names that it has for it."""


def leave_out_indirect(scene: Any) -> None:
    """Have either engine render direct light alone; `bring_back_indirect` sets all back."""
    if _HELD in scene:
        return
    before = {path: _value(scene, path) for path in _SETTINGS}
    held = {path: value for path, value in before.items() if value is not None}
    if _OLD_BOUNCES in scene:
        held["cycles.max_bounces"] = scene.pop(_OLD_BOUNCES)
    scene[_HELD] = held
    for path in held:
        _set(scene, path, _SETTINGS[path])
    shown = dict.fromkeys(obj for layer in scene.view_layers for obj in rendered_objects(layer) if obj.type == "MESH")
    dim_world(scene, list(shown), _PASS)


def bring_back_indirect(scene: Any) -> None:
    """Set back what `leave_out_indirect` set, but for what somebody has set to something else since."""
    if _OLD_BOUNCES in scene:
        scene.cycles.max_bounces = scene.pop(_OLD_BOUNCES)
    if _HELD not in scene:
        return
    for path, before in scene[_HELD].items():
        if _value(scene, path) == _SETTINGS[path]:
            _set(scene, path, type(_SETTINGS[path])(before))
    del scene[_HELD]
    restore_worlds(_PASS, [one.world for one in bpy.data.scenes if _HELD in one and one.world])


def light_probes(scene: Any) -> list[str]:
    """Names of light probe volumes that EEVEE's renders take indirect light from, whatever the settings are."""
    objects = (obj for obj in scene.objects if obj.type == "LIGHT_PROBE" and not obj.hide_render)
    return [obj.name for obj in objects if obj.data.type == "VOLUME"]


def switch_with_indirect(socket: Any, scene: Any) -> None:
    """Have a driver set a factor to 0 where the scene's engine renders indirect light itself, and to 1 elsewhere.

    A driver is evaluated wherever a compositor is, in renders on another machine too, and this one needs no script.
    """
    driver = socket.driver_add("default_value").driver
    for name, path in _WATCHED.items():
        if path != "render.engine" and _value(scene, path) is None:
            continue
        variable = driver.variables.new()
        variable.name, target = name, variable.targets[0]
        target.id_type, target.id, target.data_path = "SCENE", scene, path
    names = driver.variables.keys()
    of_eevee, of_others = (f"{name} == 0" if name in names else "1" for name in ("rays", "bounces"))
    driver.type, driver.expression = "SCRIPTED", f"({of_eevee}) if engine == {_EEVEE} else ({of_others})"


def remove_switch(socket: Any) -> None:
    """Take the driver of a factor away, before its node goes."""
    tree = socket.id_data
    socket.driver_remove("default_value")
    data = tree.animation_data
    if data is not None and data.action is None and not data.drivers and not data.nla_tracks:
        tree.animation_data_clear()


def _value(scene: Any, path: str) -> Any:
    """A setting of the scene; None where this Blender does not have it, as without its engine."""
    owner, name = owner_of(scene, path)
    return getattr(owner, name, None)


def _set(scene: Any, path: str, value: Any) -> None:
    owner, name = owner_of(scene, path)
    setattr(owner, name, value)
