"""The check of a scene before its bake, made anew while the panel is looked at, and never while it is drawn.

A panel that is drawn asks for the check. A timer makes it shortly after, at most for a twentieth of the time; a scene
whose check takes long is checked when the button is pressed, and not by itself.
"""

from dataclasses import dataclass
from time import perf_counter
from typing import Any

import bpy

from ..blender.preflight import Asked, Preflight, check
from ..pipeline.estimates import Estimate, estimate
from ..settings.bake import BakeSettings
from .pace import n_cores, pace_of
from .redraw import redraw_panels

SOON = 0.3
"""Seconds from a change to the check."""

_REST = 20.0
"""Times the time that a check took, until the next one begins."""

SLOW, MANY = 0.2, 3_000
"""Seconds that a check may take, and objects that a scene may have, to be checked without being asked."""


@dataclass(frozen=True)
class Checked:
    """A check that was made, of which settings."""

    preflight: Preflight
    key: tuple[Any, ...]
    settings: BakeSettings

    @property
    def estimate(self) -> Estimate:
        """Time and memory expected."""
        return estimate(self.preflight.work, self.settings, n_cores(), pace_of(self.settings.gather))


class Checks:
    """The last check of each scene of the open file."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self._of_scene: dict[int, Checked] = {}
        self._changed: set[int] = set()
        self._wanted: tuple[int, str] | None = None
        self._ended = 0.0

    def of(self, scene: Any) -> Checked | None:
        """The last check of a scene; None where there was none."""
        return self._of_scene.get(scene.session_uid)

    def is_current(self, scene: Any) -> bool:
        """Whether nothing was changed since the last check of a scene."""
        last = self.of(scene)
        return last is not None and scene.session_uid not in self._changed and last.key == key_of(scene)

    def changed(self, scene: Any) -> None:
        """Something in a scene was changed."""
        self._changed.add(scene.session_uid)

    def make(self, scene: Any, view_layer: Any) -> Checked:
        """Check now."""
        made = Checked(check(asked_of(scene, view_layer)), key_of(scene), scene.photon_bake.settings())
        self._of_scene[scene.session_uid] = made
        self._changed.discard(scene.session_uid)
        self._ended = perf_counter()
        return made

    def want(self, scene: Any, view_layer: Any) -> None:
        """Check soon, if that is quick and there is something new; a panel that is drawn calls this."""
        last = self.of(scene)
        if self._wanted or self.is_current(scene) or len(view_layer.objects) > MANY:
            return
        if last and last.preflight.seconds > SLOW:
            return
        rest = self._ended + _REST * last.preflight.seconds - perf_counter() if last else 0.0
        self._wanted = scene.session_uid, view_layer.name
        bpy.app.timers.register(self._make_wanted, first_interval=max(rest, SOON))

    def _make_wanted(self) -> None:
        uid, name = self._wanted or (0, "")
        self._wanted = None
        scene = next((one for one in bpy.data.scenes if one.session_uid == uid), None)
        if scene is not None and name in scene.view_layers:
            self.make(scene, scene.view_layers[name])
            redraw_panels(bpy.context)

    def forget(self) -> None:
        """Another file is opened, or the extension is turned off."""
        if bpy.app.timers.is_registered(self._make_wanted):
            bpy.app.timers.unregister(self._make_wanted)
        self._begin()


def asked_of(scene: Any, view_layer: Any) -> Asked:
    """What the panel asks for."""
    properties = scene.photon_bake
    return Asked(
        scene=scene,
        view_layer=view_layer,
        targets=frozenset(properties.targets),
        settings=properties.settings(),
        lightmap=properties.lightmap.settings(),
        attribute=properties.attribute,
        light_group=properties.light_group,
        copies=properties.bake_copies,
        selected_only=properties.selected_only,
    )


def key_of(scene: Any) -> tuple[Any, ...]:
    """Settings that a check depends on."""
    properties = scene.photon_bake
    own = (properties.attribute, properties.light_group, properties.bake_copies, properties.selected_only)
    return (*sorted(properties.targets), properties.settings(), properties.lightmap.settings(), *own)


checks = Checks()
"""One file is open at a time in a Blender, so there is one."""


@bpy.app.handlers.persistent
def _on_update(scene: Any, depsgraph: Any) -> None:
    checks.changed(scene)


@bpy.app.handlers.persistent
def _on_load(*_: Any) -> None:
    checks.forget()


def register() -> None:
    """Watch changes, and files that are opened."""
    bpy.app.handlers.depsgraph_update_post.append(_on_update)
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Watch no longer."""
    bpy.app.handlers.load_pre.remove(_on_load)
    bpy.app.handlers.depsgraph_update_post.remove(_on_update)
    checks.forget()
