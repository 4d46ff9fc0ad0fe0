"""Live light: the state that keeps direct and indirect light up to date while the scene is edited.

    surfaces = live_surfaces(scene, settings)        # what is drawn: the scene's meshes, cut finely
    live = Live(scene, surfaces, settings)
    live.start()                                     # its own thread; returns at once, as all of these do
    live.edit(LampsChanged(lights))                  # from any thread; several edits are coalesced
    light = live.light                               # the newest snapshot, or None; a new one has a higher version
    live.stop()

What others may use is listed here; all else in this folder is the engine's own.
"""

from .edits import (
    Edit,
    LampsChanged,
    MaterialsChanged,
    ObjectMoved,
    ObjectReshaped,
    ObjectShown,
    SceneReplaced,
    WorldChanged,
)
from .light import LiveLight
from .live import Live
from .surfaces import LiveMesh, LiveSurfaces, live_surfaces

__all__ = [
    "Edit",
    "LampsChanged",
    "Live",
    "LiveLight",
    "LiveMesh",
    "LiveSurfaces",
    "MaterialsChanged",
    "ObjectMoved",
    "ObjectReshaped",
    "ObjectShown",
    "SceneReplaced",
    "WorldChanged",
    "live_surfaces",
]
