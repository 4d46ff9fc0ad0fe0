"""Live light of one scene, from when it is turned on until it is turned off."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...core.errors import BakeError
from ...settings.live import LiveSettings
from .drawing import Drawing, Scenery
from .looks import Looks
from .reading import LiveReading, equal, same_surfaces
from .stage import Stage
from .updates import SURFACELESS, Changes, contents_of
from .view_transform import ViewTransform, exposure_of, key_of, table_of

if TYPE_CHECKING:
    from ...pipeline.live import Edit, Live, LiveLight

NO_LIGHT = (
    "Nothing in the scene gives light, so live light stays off: add a lamp, an emissive material or a world color."
)

_REST = 2.0
"""How many times as long as it took to read all of the scene it is not read again, so that Blender stays awake."""


class LiveSession:
    """Reads a scene, has its light found, follows its changes, and draws it.

    Only for the main thread. No reference to Blender's data is kept, as undo replaces all of it.

    Parameters
    ----------
    scene, view_layer : bpy.types.Scene, bpy.types.ViewLayer
    settings : LiveSettings
    mode : callable
        What is shown, one of `MODES`.
    fails : callable
        Told of what ends it.

    Raises
    ------
    BakeError
        If there is no light in the scene, or too little memory.
    """

    def __init__(
        self,
        scene: Any,
        view_layer: Any,
        settings: LiveSettings,
        mode: Callable[[], str],
        fails: Callable[[Exception], None],
    ) -> None:
        self._scene_uid, self._layer = scene.session_uid, view_layer.name
        self._settings, self._mode, self._fails = settings, mode, fails
        self.changes = Changes()
        self._ready = 0.0
        self._transform_key: Any = None
        self._version = 0
        self._noted: float | None = None
        self._edited: tuple[float, float] | None = None
        self._stages: list[Stage] = []
        self._ever: set[int] = set()  # what was shown since it was turned on
        reading = self._read(scene, view_layer)
        if not reading.gives_light:
            raise BakeError(NO_LIGHT)
        self._take(reading)
        self._live: Live = self._started()
        self._follow_view(scene)
        self._drawing = Drawing(self.scenery, fails)

    def _started(self) -> "Live":
        from ...pipeline.live import Live  # here, as Blender's start should not wait for SciPy

        live = Live(self._reading.scene, self._stages[-1].surfaces, self._settings)
        live.start()
        return live

    def end(self) -> None:
        """Stop all of it."""
        self._drawing.end()
        self._live.stop()

    # What is known

    @property
    def light(self) -> "LiveLight | None":
        """The newest light."""
        return self._live.light

    @property
    def behind(self) -> float | None:
        """Seconds since the first change that the newest light does not have in it; None where it has all."""
        # `_edited`: when the first change came that the engine was told of, and when it was told of the last one;
        # `_noted`: when the first came that is not read yet
        light = self._live.light
        if self._edited is not None and light is not None and light.since >= self._edited[1]:
            self._edited = None
        since = self._edited[0] if self._edited is not None else self._noted
        return None if since is None else perf_counter() - since

    @property
    def live(self) -> "Live":
        """What finds it."""
        return self._live

    def _found(self) -> tuple[Any, Any]:
        """The scene and view layer."""
        for scene in bpy.data.scenes:
            if scene.session_uid == self._scene_uid and self._layer in scene.view_layers:
                return scene, scene.view_layers[self._layer]
        raise BakeError("The scene or view layer that live light was of is gone: turn it on again.")

    def _read(self, scene: Any, layer: Any) -> LiveReading:
        begun = perf_counter()
        self._contents = contents_of(scene, layer)
        self._ever |= self._contents[0]
        reading = LiveReading.of(_graph(scene, layer), scene)
        self._ready = perf_counter() + _REST * (perf_counter() - begun)
        return reading

    def _take(self, reading: LiveReading) -> None:
        """Go on with all that was read; until there is light on its surfaces, the last ones are drawn."""
        from ...pipeline.live import LiveSurfaces, live_surfaces

        empty = reading.scene.n_triangles == 0
        self._gone: set[int] = set()
        surfaces = LiveSurfaces(()) if empty else live_surfaces(reading.scene, self._settings)
        looks = Looks.of(reading.scene.materials, self._stages[-1].looks if self._stages else None)
        transforms = np.tile(np.eye(4, dtype=np.float32), (len(reading.owners), 1, 1))
        self._reading = reading
        self._stages.append(Stage(surfaces, looks, transforms, reading.owners))

    # What changes

    def note(self, scene: Any, depsgraph: Any) -> None:
        """Take updates of a dependency graph in; they are read by the next `tick`."""
        if scene.session_uid == self._scene_uid and depsgraph.mode == "VIEWPORT":
            self.changes.note(depsgraph.updates)
            for stage in self._stages:
                stage.note(self.changes.edited)
            self._noted = (self._noted or perf_counter()) if self.changes else None

    def forget(self) -> None:
        """After an undo: images may be others than before."""
        self._reading.table.forget_pictures()

    def tick(self) -> bool:
        """Follow what has changed; returns whether views have to be drawn again.

        Raises
        ------
        BakeError
            If it cannot go on.
        """
        if self._live.failure is not None:
            raise self._live.failure
        scene, layer = self._found()
        changed = self._follow_view(scene)
        self.changes.release(layer)
        if self.changes:
            self._noted = self._noted or perf_counter()
            changed |= self._follow(scene, layer)
        version = self._live.light.version if self._live.light else 0
        changed |= version != self._version
        self._version = version
        return changed

    def pause(self, paused: bool) -> None:
        """Find no light for a while, or go on."""
        if paused:
            self._live.stop()
        else:
            self._live.start()

    def _follow_view(self, scene: Any) -> bool:
        """Take over exposure and view transform; whether they are others."""
        key = key_of(scene)
        if key != self._transform_key:
            self._transform_key, self._table = key, table_of(scene)
        before = getattr(self, "_shown_as", None)
        self._shown_as = ViewTransform(exposure_of(scene), self._table)
        return before is None or before.exposure != self._shown_as.exposure or before.table is not self._table

    def _follow(self, scene: Any, layer: Any) -> bool:
        """Read what has changed, and say so to the engine; whether surfaces look otherwise at once."""
        changes = self.changes
        if changes.contents:
            self._look_what_is_there(contents_of(scene, layer))
            changes.contents = False
        edits = None if changes.everything else self._edits(scene, layer)
        if edits is None:
            changes.everything = True
            if perf_counter() < self._ready:
                return True
            edits = self._replaced(scene, layer)
        self.changes, noted, self._noted = Changes(held=changes.held, edited=changes.edited), self._noted, None
        if edits:
            now = perf_counter()
            self._edited = (self._edited[0] if self._edited else noted or now), now
            self._live.edit(*edits)
        return True

    def _look_what_is_there(self, contents: tuple[Any, ...]) -> None:
        """Note what objects have come or gone, whose light and surfaces are to be read."""
        changes, before, now = self.changes, self._contents[0], contents[0]
        known = set(self._reading.owners.tolist())
        self._ever |= now
        for stage in self._stages:
            stage.gone = (set(stage.owners.tolist()) & self._ever) - now
        changes.everything |= contents[1:] != self._contents[1:] or not self._are_known(now - before - known)
        changes.lamps |= now != before
        changes.reshaped |= (now - before) & known
        self._contents = contents

    def _are_known(self, uids: set[int]) -> bool:
        """Whether objects have no surfaces and instance nothing, so that they are no reason to read all."""
        return all(obj.type in SURFACELESS for obj in bpy.data.objects if obj.session_uid in uids)

    def _shown(self) -> "list[Edit]":
        """Which objects are not there any more, or again; of those that are, their shape is known."""
        from ...pipeline.live import ObjectShown

        gone = set(np.flatnonzero(np.isin(self._reading.owners, list(self._ever - self._contents[0]))).tolist())
        edits: list[Edit] = [ObjectShown(number, number not in gone) for number in sorted(gone ^ self._gone)]
        self._gone = gone
        return edits

    def _reshaped(self, graph: Any) -> "list[Edit] | None":
        """Objects of another shape; None where some are of other faces."""
        from ...pipeline.live import ObjectReshaped

        there = self.changes.reshaped & self._contents[0]
        shapes = self._reading.reshaped(graph, there) if there else {}
        if shapes is None:
            return None
        stage, surfaces = self._stages[-1], self._stages[-1].surfaces
        still = (stage.transforms == np.eye(4)).all(axis=(1, 2))
        shapes = {k: shape for k, shape in shapes.items() if not (still[k] and self._reading.has(k, shape))}
        edited = stage.edited - there
        if not shapes:
            stage.edited = edited
            return []
        transforms = stage.transforms.copy()
        for number, shape in shapes.items():
            transforms[number] = np.eye(4)
            surfaces = surfaces.reshaped(number, shape.corners, shape.corner_normals)
        self._reading.reshape(shapes)
        self._stages.append(replace(stage, surfaces=surfaces, transforms=transforms, edited=edited))
        return [
            ObjectReshaped(number, of.corners, of.corner_normals, of.corner_tangents, surfaces)
            for number, of in shapes.items()
        ]

    def _edits(self, scene: Any, layer: Any) -> "list[Edit] | None":
        """What of the changes can be read by itself; None where everything has to be."""
        from ...pipeline.live import LampsChanged, MaterialsChanged, ObjectMoved, WorldChanged

        changes, reading, graph = self.changes, self._reading, _graph(scene, layer)
        reshaped = self._reshaped(graph)
        if reshaped is None:
            return None
        edits = [*reshaped, *self._shown()]
        if changes.moved:
            moved = reading.moved(graph, changes.moved)
            if moved is None:
                return None
            for number, transform in moved.items():
                self._stages[-1].transforms[number] = transform
                edits.append(ObjectMoved(number, transform))
        if changes.materials:
            materials = reading.materials(graph, changes.materials)
            if materials is None:
                return None
            if not equal(materials, reading.scene.materials):
                self._change(materials=materials)
                edits.append(MaterialsChanged(materials))
        if changes.world:
            world, lights = reading.world(graph, scene)
            edits += [] if equal(world, reading.scene.world) else [WorldChanged(world)]
            edits += [] if equal(lights, reading.scene.lights) else [LampsChanged(lights)]
            self._change(world=world, lights=lights)
        if changes.lamps:
            lamps = reading.lamps(_graph(scene, layer), scene)
            if lamps is None:
                return None
            if not equal(lamps, reading.scene.lights):
                self._change(lights=lamps)
                edits.append(LampsChanged(lamps))
        return edits

    def _change(self, **parts: Any) -> None:
        """Take over parts of the scene that were read by themselves."""
        self._reading.scene = replace(self._reading.scene, **parts)
        if "materials" in parts:
            self._stages[-1].looks = Looks.of(parts["materials"], self._stages[-1].looks)

    def _replaced(self, scene: Any, layer: Any) -> "list[Edit]":
        """Read everything anew; where surfaces turn out to be the same as before, light goes on from there."""
        from ...pipeline.live import LampsChanged, ObjectMoved, ObjectShown, SceneReplaced, WorldChanged

        before, moved, gone = self._reading, self._stages[-1].transforms, self._gone
        reading = self._read(scene, layer)
        if not same_surfaces(before.scene, reading.scene) or before.objects != reading.objects:
            self._take(reading)
            return [SceneReplaced(reading.scene, self._stages[-1].surfaces)]
        self._reading, self._gone, self._stages[-1].edited = reading, set(), set()
        edits: list[Edit] = [ObjectShown(number, True) for number in sorted(gone)]
        if not equal(before.scene.lights, reading.scene.lights):
            edits.append(LampsChanged(reading.scene.lights))
        if not equal(before.scene.world, reading.scene.world):
            edits.append(WorldChanged(reading.scene.world))
        back = np.flatnonzero((moved != np.eye(4)).any(axis=(1, 2)))
        moved[back] = np.eye(4)
        return [*edits, *(ObjectMoved(int(number), np.eye(4)) for number in back)]

    # What is drawn

    def scenery(self) -> Scenery | None:
        """What there is to draw now."""
        light = self._live.light
        if light is None or not len(light.surfaces):
            return None
        while self._stages[0].surfaces is not light.surfaces:  # light never goes back to those of before
            del self._stages[0]
        stage = self._stages[0]
        return Scenery(
            scene=self._scene_uid,
            layer=self._layer,
            light=light,
            looks=stage.looks,
            transforms=stage.transforms,
            world=self._reading.scene.world,
            shown_as=self._shown_as,
            mode=self._mode(),
            shown_in=stage.shown_in,
            complete=not self.changes.everything and stage is self._stages[-1] and not stage.edited,
        )


def _graph(scene: Any, layer: Any) -> Any:
    """The evaluated graph that viewports of a view layer have."""
    with bpy.context.temp_override(scene=scene, view_layer=layer):
        return bpy.context.evaluated_depsgraph_get()
