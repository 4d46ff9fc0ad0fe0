"""A bake in three steps, for the button, for scripts and for the command line: one solve for all that is asked for."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import bpy

from ...addon.blender import READING, SceneReading, displace, in_render_graph, read_scene
from ...addon.blender.read.as_read import Placement, edit_mode_left, named
from ...addon.blender.write.baked_copies import complete_copies, originals_shown
from ...addon.core.errors import Advice, BakeError, Cancelled, refuse_differences
from ...addon.core.inspector import Inspector
from ...addon.core.parallel import Workers, aside
from ...addon.core.progress import Progress
from ...addon.core.zips import check_libraries
from ...addon.output import check_space
from ...addon.pipeline.warm_up import compiler
from ...addon.scene import LightGroups, Scene
from ...addon.settings.bake import BakeSettings
from ...addon.ui.properties.mixer import set_layers
from ...addon.ui.state import duration
from ..targets.camera import CameraTarget
from ..targets.probes import ProbeTarget
from ..targets.target import Request, Solved, Target
from ..targets.vertices import VertexLight
from .content import content_digest
from .describe import describe
from .light_store import LightStore
from .shutter import Moment, exposed_over, read_shutter
from .written import Written

if TYPE_CHECKING:
    from ...addon.pipeline.outputs import Lit

NO_LIGHT = (
    "Nothing in the scene gives light, so what was baked is black: add a lamp, an emissive material or a world color."
)
_LATE = 1.5
"""Times the time that was asked for, from which on a bake says that it took longer."""

WRITING = "Writing the light"


@dataclass
class BakeJob:
    """What a bake needs to know of Blender's data: after `prepare` it can be solved on any thread.

    Attributes
    ----------
    scene : Scene
    targets : list of Target
    warnings : list of str
        Grows as the bake goes.
    counts : dict of str to int
        Of the scene and the cube maps, for the report; grows too.
    placement : Placement
        Where objects stood.
    strict : bool
        Whether any other warning than advice stops the bake, before anything is written.
    groups : dict of str to Scene
        The scene as each light group lights it; empty where all light is baked together.
    of_scene : str
        Name of Blender's scene.
    shutter : list of Moment
        At which light is averaged; empty for the scene as it stands.
    light_groups : LightGroups or None
        Where they are baked each apart.
    """

    scene: Scene
    targets: list[Target]
    warnings: list[str]
    counts: dict[str, int]
    placement: Placement
    strict: bool = False
    groups: dict[str, Scene] = field(default_factory=dict)
    of_scene: str = ""
    shutter: list[Moment] = field(default_factory=list)
    light_groups: LightGroups | None = None

    @classmethod
    def prepare(
        cls,
        context: Any,
        requests: Sequence[Request],
        progress: Progress,
        names: list[str] | None = None,
        light_group: str = "",
        strict: bool = False,
        apart: bool = False,
        motion_blur: int = 0,
    ) -> "BakeJob":
        """Read what the bake needs out of Blender's data; for the main thread.

        Parameters
        ----------
        context : bpy.types.Context
        requests : sequence of Request
        progress : Progress
        names : list of str, optional
            Objects to bake; without names every renderable mesh object.
        light_group : str
            Whose light is baked alone; empty for all light.
        strict : bool
            Whether any other warning than advice stops the bake; `check_strict` does so already before it.
        apart : bool
            Whether light groups are baked each apart, by one solve; `group_names` says whether they can be.
        motion_blur : int
            In how many steps light is averaged over the shutter's time; 0 for the scene as it stands.

        Raises
        ------
        BakeError
            If the scene cannot be baked, or an object cannot take the light.
        """
        progress.update(READING, 0)
        warnings: list[str] = []
        asked = context.scene  # what is read has its names from a copy

        def read_now(depsgraph: Any, progress: Progress) -> tuple[list[Target], SceneReading]:
            targets = [one.read(depsgraph, asked, names, progress, warnings) for one in requests]
            for_camera = any(isinstance(target, CameraTarget) for target in targets)
            return targets, read_scene(depsgraph, warnings, light_group, for_camera, progress, motion_blur > 0)

        def read(depsgraph: Any) -> tuple[list[Target], SceneReading, list[Moment]]:
            if motion_blur:
                return read_shutter(depsgraph, asked, read_now, motion_blur, warnings, progress)
            displace(depsgraph, warnings)
            return *read_now(depsgraph, progress), []

        copies = any(getattr(one, "copies", False) for one in requests)
        with originals_shown() if copies else nullcontext():
            targets, reading, shutter = in_render_graph(context.scene, context.view_layer, read)
        scene = reading.scene(context.scene)
        progress.update(READING, 1)
        counts, placement = {"triangles": scene.n_triangles}, Placement(context.view_layer)
        groups = reading.light_groups.apart(scene) if apart else {}
        warnings += [_empty(name) for name in reading.light_groups.names if apart and name not in groups]
        if shutter:
            counts["shutter_steps"] = len(shutter)
        of_groups = reading.light_groups if apart else None
        warnings, name = list(dict.fromkeys(warnings)), asked.name
        return cls(scene, targets, warnings, counts, placement, strict, groups, name, shutter, of_groups)

    def check_space(self, n_frames: int = 1, saved: Path | None = None) -> None:
        """Find out whether disks have room for what is written, in so many frames, and for the saved file.

        Raises
        ------
        BakeError
            If one has not.
        """
        sizes = {path: n_frames * size for target in self.targets for path, size in target.sizes.items()}
        if saved is not None:
            loaded = Path(bpy.data.filepath)
            sizes[saved] = loaded.stat().st_size if loaded.is_file() else 0
        check_space(sizes)

    def check_strict(self, concerns: Sequence[str] = ()) -> None:
        """Stop a strict bake that has to warn of more than advice.

        Raises
        ------
        BakeError
        """
        if self.strict:
            refuse_differences([*self.warnings, *concerns])

    @property
    def object_names(self) -> list[str]:
        """Objects that get light, each once."""
        return list(dict.fromkeys(name for target in self.targets for name in target.object_names))

    def solve(
        self,
        settings: BakeSettings,
        progress: Progress,
        inspector: Inspector | None = None,
        before: Solved | None = None,
        store: LightStore | None = None,
    ) -> Solved:
        """Bake, while `inspector` looks on; touches none of Blender's data, so any thread may call it.

        It ends soon after it is cancelled, whatever is being done.

        Parameters
        ----------
        before : Solved, optional
            The light of another frame, which this one has as well where nothing has changed.
        store : LightStore, optional
            Where light is kept, and perhaps found.

        Raises
        ------
        BakeError
            If it cannot be baked, or a library is missing.
        Cancelled
        """
        compiler.wait(progress)
        check_libraries()
        return aside(lambda: self._solve(settings, progress, inspector, before, store), progress.check)

    def _solve(
        self,
        settings: BakeSettings,
        progress: Progress,
        inspector: Inspector | None,
        before: Solved | None,
        store: LightStore | None,
    ) -> Solved:
        from ...addon.gather import Irradiance
        from ...addon.pipeline.outputs import developed, expose  # here, as Blender's start should not wait for SciPy
        from ...addon.tracing.embree import EmbreeTracer

        started = perf_counter()
        workers = Workers(settings.seed, settings.n_threads, progress, settings.memory)
        tracer = EmbreeTracer(self.scene)
        samples = [target.samples(self.scene, tracer, workers, self.warnings) for target in self.targets]
        self.check_strict()
        content = self._content(samples, settings)
        if before is not None and content and content == before.content:
            return before.of_targets(self.targets)
        if self.shutter:
            exposures = exposed_over(
                self.shutter, self.scene, self.light_groups, samples, settings, tracer, workers, inspector
            )
        else:
            found = store.find(content, samples) if store else None
            groups = list(self.groups.values()) or [self.scene]
            if found is None:
                found = expose(self.scene, groups, samples, settings, tracer, workers, inspector, started)
                if store:
                    store.keep(content, found)
            exposures = [found]
        lit = developed(exposures, workers)
        self._say(lit)
        outputs = [
            type(of_one[0]).together(dict(zip(self.groups, of_one, strict=True))) if self.groups else of_one[0]
            for of_one in lit.outputs
        ]
        self._warn_if_late(perf_counter() - started, settings.time)
        shown = [
            one.irradiance if isinstance(one, VertexLight) else part
            for one, part in zip(outputs, lit.totals, strict=True)
        ]
        return Solved(Irradiance.join(shown, lit.counts), outputs, content)

    def _content(self, samples: Sequence[Any], settings: BakeSettings) -> bytes:
        """A digest of all that the light is made of; empty where it is averaged over the shutter."""
        if self.shutter:
            return b""
        where = [(one.receivers, getattr(one, "eyes", None)) for one in samples]
        cameras = [(one.camera, one.settings) for one in self.targets if isinstance(one, CameraTarget)]
        probes = [one.settings for one in self.targets if isinstance(one, ProbeTarget)]
        light = replace(settings, n_threads=0, memory=BakeSettings.memory)  # which it does not depend on
        return content_digest(self.scene, self.groups, where, cameras, probes, light)

    def _say(self, lit: "Lit") -> None:
        """Warn of what the solve found, and count it."""
        if lit.dark:
            self.warnings.append(NO_LIGHT)
        self.warnings += [_flush(*names) for names in lit.flush_emitters]
        self.warnings += [_turned_away(name) for name in lit.turned_away]
        self.warnings += [_inside_out(name) for name in lit.inside_out]
        if lit.cube_maps:
            self.counts.update(cube_maps=len(lit.cube_maps.maps), cube_map_bytes=lit.cube_maps.maps.n_bytes)

    def _warn_if_late(self, seconds: float, limit: float) -> None:
        """Say that more time was taken than was asked for: what every point needs at least depends on their number."""
        if limit and seconds > _LATE * limit:
            sentence = (
                f"The bake took {duration(seconds)} instead of the {limit:g} s asked for: "
                "each point and pixel needs rays, gloss and denoising in any case, so fewer of them take less time."
            )
            self.warnings.append(Advice(sentence))

    def write(self, solved: Solved, progress: Progress, writes: Sequence[Callable[[], Written]] = ()) -> Written:
        """Write what can be written of the light; for the main thread.

        Parameters
        ----------
        writes : sequence of callable, optional
            What writes each of the outputs, where that is not its own `write`.

        Raises
        ------
        BakeError
            If nothing can be written; nothing was changed then.
        """
        progress.update(WRITING, 0)
        bpy.context.view_layer.update()  # a script may have changed it since
        written = Written(warnings=self._moved())
        with edit_mode_left():
            self.check_strict([*written.warnings, *(one for output in solved.outputs for one in output.concerns())])
            refusals = []
            for write in writes or [output.write for output in solved.outputs]:
                try:
                    written.add(write())
                except BakeError as error:
                    refusals.append(str(error))
                except Exception as error:  # a fault of ours; what is written already can still be undone
                    written.failures.append(describe(error))
            if len(self.targets) > 1 and not refusals and not writes:
                complete_copies(self.object_names)
        if refusals and len(refusals) == len(solved.outputs):
            raise BakeError(" ".join(refusals))
        written.failures += refusals
        scene = bpy.data.scenes.get(self.of_scene)
        if scene is not None and scene.is_editable:
            set_layers(scene, list(self.groups))
        self.warnings = list(dict.fromkeys(self.warnings + written.warnings))
        with suppress(Cancelled):  # too late: it is written
            progress.update(WRITING, 1)
        return written

    def _moved(self) -> list[str]:
        """A warning if objects stand elsewhere than when they were read."""
        names = self.placement.moved(bpy.context.view_layer)
        if not names:
            return []
        return [f"Light is that of where {named(names)} stood when the bake began: bake again."]


def _empty(group: str) -> Advice:
    return Advice(f"Light group '{group}' has no light in it, so no layer was baked of it.")


def _turned_away(name: str) -> Advice:
    return Advice(
        f"Object '{name}' turns its back to the light, and its front to nothing or to a wall: flip its normals (Mesh > "
        "Normals > Flip), or bake with Open Side."
    )


def _inside_out(name: str) -> Advice:
    return Advice(
        f"Object '{name}' is inside out: its normals point inwards, and no light gets there: recalculate them (Mesh > "
        "Normals > Recalculate Outside), or bake with Open Side."
    )


def _flush(emitter: str, other: str) -> str:
    place = "others of its own" if emitter == other else f"faces of '{other}'"
    return (
        f"Emissive faces of object '{emitter}' lie in one plane with {place}, where Cycles' light depends on rounding; "
        "it was baked as if in front: move it 1 mm in front."
    )
