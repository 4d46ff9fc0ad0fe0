"""A bake in three steps, for the button, for scripts and for the command line: one solve for all that is asked for."""

from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...addon.blender import READING, SceneReading, in_render_graph, read_scene
from ...addon.blender.read.as_read import Placement, edit_mode_left, named
from ...addon.blender.write.baked_copies import complete_copies, originals_shown
from ...addon.core.errors import Advice, BakeError, Cancelled, refuse_differences
from ...addon.core.inspector import Inspector
from ...addon.core.parallel import Workers, aside
from ...addon.core.progress import Progress
from ...addon.core.zips import check_libraries
from ...addon.output import check_space
from ...addon.receivers import Receivers
from ...addon.scene import Scene
from ...addon.settings.bake import BakeSettings
from ...addon.tracing import Tracer
from ...addon.ui.properties.mixer import set_layers
from ...addon.ui.state import duration
from ..targets.camera import CameraTarget
from ..targets.probes import ProbePoints
from ..targets.target import Points, Product, Solved, Target, Wanted
from ..targets.vertices import VertexLight
from .describe import describe
from .written import Written

if TYPE_CHECKING:
    from ...addon.gather import Irradiance

N_LIGHT_RAYS = 1000
"""That are followed to see which surfaces cube maps are to show."""

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
    """

    scene: Scene
    targets: list[Target]
    warnings: list[str]
    counts: dict[str, int]
    placement: Placement
    strict: bool = False
    groups: dict[str, Scene] = field(default_factory=dict)
    of_scene: str = ""

    @classmethod
    def prepare(
        cls,
        context: Any,
        wanted: Sequence[Wanted],
        progress: Progress,
        names: list[str] | None = None,
        light_group: str = "",
        strict: bool = False,
        apart: bool = False,
    ) -> "BakeJob":
        """Read what the bake needs out of Blender's data; for the main thread.

        Parameters
        ----------
        context : bpy.types.Context
        wanted : sequence of Wanted
        progress : Progress
        names : list of str, optional
            Objects to bake; without names every renderable mesh object.
        light_group : str
            Whose light is baked alone; empty for all light.
        strict : bool
            Whether any other warning than advice stops the bake; `check_strict` does so already before it.
        apart : bool
            Whether light groups are baked each apart, by one solve; `group_names` says whether they can be.

        Raises
        ------
        BakeError
            If the scene cannot be baked, or an object cannot take the light.
        """
        progress.update(READING, 0)
        warnings: list[str] = []
        asked = context.scene  # what is read has its names from a copy

        def read(depsgraph: Any) -> tuple[list[Target], SceneReading]:
            targets = [one.read(depsgraph, asked, names, progress, warnings) for one in wanted]
            for_camera = any(isinstance(target, CameraTarget) for target in targets)
            return targets, read_scene(depsgraph, warnings, light_group, for_camera, progress)

        copies = any(getattr(one, "copies", False) for one in wanted)
        with originals_shown() if copies else nullcontext():
            targets, reading = in_render_graph(context.scene, context.view_layer, read)
        scene = reading.scene(context.scene)
        progress.update(READING, 1)
        counts, placement = {"triangles": scene.n_triangles}, Placement(context.view_layer)
        groups = reading.light_groups.apart(scene) if apart else {}
        warnings += [_empty(name) for name in reading.light_groups.names if apart and name not in groups]
        return cls(scene, targets, list(dict.fromkeys(warnings)), counts, placement, strict, groups, asked.name)

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

    def solve(self, settings: BakeSettings, progress: Progress, inspector: Inspector | None = None) -> Solved:
        """Bake, while `inspector` looks on; touches none of Blender's data, so any thread may call it.

        It ends soon after it is cancelled, whatever is being done.

        Raises
        ------
        BakeError
            If it cannot be baked, or a library is missing.
        Cancelled
        """
        check_libraries()
        return aside(lambda: self._solve(settings, progress, inspector), progress.check)

    def _solve(self, settings: BakeSettings, progress: Progress, inspector: Inspector | None) -> Solved:
        from ...addon.gather import Irradiance, OpenBacks
        from ...addon.photons import Photons
        from ...addon.pipeline.bake import no_light, solve_apart  # here, as Blender's start should not wait for SciPy
        from ...addon.pipeline.solution import irradiances
        from ...addon.tracing.embree import EmbreeTracer

        inspector, started = inspector or Inspector(), perf_counter()
        workers = Workers(settings.seed, settings.n_threads, progress, settings.memory)
        tracer = EmbreeTracer(self.scene)
        points = [target.points(self.scene, tracer, workers, self.warnings) for target in self.targets]
        self.check_strict()
        receivers = Receivers.join([one.receivers for one in points])
        backs = OpenBacks.of(receivers, tracer, workers, settings.open_side)
        if settings.open_side:
            receivers = backs.added_to(receivers)
        everywhere = _with_eyes(receivers, points, settings)
        maps = None
        if settings.tracer == "multi_image" and len(everywhere):
            maps = self._take_cube_maps(tracer, everywhere, settings, workers, inspector)
        lit, names = list(self.groups.values()) or [self.scene], list(self.groups)
        lights, of_lights = [no_light()] * len(lit), [points] * len(lit)
        if len(everywhere):
            solutions = solve_apart(self.scene, lit, everywhere, settings, tracer, progress, inspector, maps, started)
            if len(everywhere) > len(receivers):
                solutions = [solution.at(receivers) for solution in solutions]
            if all(solution.dark for solution in solutions):
                self.warnings.append(NO_LIGHT)
            self.warnings += [_flush(*names) for names in solutions[0].tracer.flush_emitters]
            of_lights = [
                [one.lit_by(solution, part) for one in points]
                for solution, part in zip(solutions, workers.parts(len(lit)), strict=True)
            ]
            if len(receivers):
                lights = irradiances(solutions, workers)
            if len(receivers) and not settings.open_side:
                photons = Photons.join([solution.photons for solution in solutions])
                self.warnings += [_turned_away(name) for name in backs.lit_behind(self.scene, photons)]
        total = Irradiance.together(lights)
        if settings.open_side:
            lights = [backs.taken(light, total) for light in lights]
            total = backs.taken(total)
        parts = zip(of_lights, lights, workers.parts(len(lit)), strict=True)
        of_targets = zip(*[_products(of, light, part) for of, light, part in parts], strict=True)
        products = [
            type(of_groups[0]).together(dict(zip(names, of_groups, strict=True))) if names else of_groups[0]
            for of_groups in of_targets
        ]
        self._warn_if_late(perf_counter() - started, settings.time)
        shown = [
            one.irradiance if isinstance(one, VertexLight) else part
            for one, part in zip(products, _parts(points, total), strict=True)
        ]
        return Solved(Irradiance.join(shown, total.counts), products)

    def _warn_if_late(self, seconds: float, limit: float) -> None:
        """Say that more time was taken than was asked for: what every point needs at least depends on their number."""
        if limit and seconds > _LATE * limit:
            sentence = (
                f"The bake took {duration(seconds)} instead of the {limit:g} s asked for: "
                "each point and pixel needs rays, gloss and denoising in any case, so fewer of them take less time."
            )
            self.warnings.append(Advice(sentence))

    def write(self, solved: Solved, progress: Progress) -> Written:
        """Write what can be written of the light; for the main thread.

        Raises
        ------
        BakeError
            If nothing can be written; nothing was changed then.
        """
        progress.update(WRITING, 0)
        bpy.context.view_layer.update()  # a script may have changed it since
        written = Written(warnings=self._moved())
        with edit_mode_left():
            self.check_strict([*written.warnings, *(one for product in solved.products for one in product.concerns())])
            refusals = []
            for product in solved.products:
                try:
                    written.add(product.write())
                except BakeError as error:
                    refusals.append(str(error))
                except Exception as error:  # a fault of ours; what is written already can still be undone
                    written.failures.append(describe(error))
            if len(self.targets) > 1 and not refusals:
                complete_copies(self.object_names)
        if refusals and len(refusals) == len(solved.products):
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

    def _take_cube_maps(
        self, tracer: Tracer, receivers: Receivers, settings: BakeSettings, workers: Workers, inspector: Inspector
    ) -> Tracer | None:
        """A tracer through cube maps around the receivers, which `tracer` takes; None where nothing gives light."""
        from ...addon.emitters import light_sources, region_of
        from ...addon.photons import emitted_rays
        from ...addon.tracing.cube_maps import LightRays, MultiImageTracer, lit_region

        region = lit_region(receivers.position)
        sources = light_sources(self.scene, region_of(receivers.position))
        if not sources:
            return None
        rays = emitted_rays(sources, N_LIGHT_RAYS, settings.seed)
        light = LightRays(np.concatenate([r.origins for r in rays]), np.concatenate([r.directions for r in rays]))
        images = MultiImageTracer.build(
            self.scene, tracer, region, settings.n_maps, settings.map_size, workers=workers, light=light
        )
        self.counts.update(cube_maps=len(images.maps), cube_map_bytes=images.maps.n_bytes)
        inspector.see("maps", lambda: (images.maps.centres, None))
        return images


def _products(points: list[Points], light: "Irradiance", workers: Workers) -> list[Product]:
    """What targets make of the light of all their receivers."""
    return [one.finish(part, workers) for one, part in zip(points, _parts(points, light), strict=True)]


def _parts(points: list[Points], light: "Irradiance") -> "list[Irradiance]":
    """The light of the receivers of each target."""
    ends = np.cumsum([len(one.receivers) for one in points])
    return [light.where(slice(end - len(one.receivers), end)) for one, end in zip(points, ends, strict=True)]


def _empty(group: str) -> Advice:
    return Advice(f"Light group '{group}' has no light in it, so no layer was baked of it.")


def _with_eyes(receivers: Receivers, points: "Sequence[Points]", settings: BakeSettings) -> Receivers:
    """The receivers, and after them those by which probes look around."""
    eyes = [one.eyes for one in points if isinstance(one, ProbePoints)]
    if not eyes:
        return receivers
    if not settings.needs_cache:
        raise BakeError("Probes look around with rays: choose Final Gather, or a Light Volume with Volume Rays.")
    return Receivers.join([receivers, *eyes] if len(receivers) else eyes)


def _turned_away(name: str) -> Advice:
    return Advice(
        f"Object '{name}' turns its back to the light, and its front to nothing or to a wall: flip its normals (Mesh > "
        "Normals > Flip), or bake with Open Side."
    )


def _flush(emitter: str, other: str) -> str:
    place = "others of its own" if emitter == other else f"faces of '{other}'"
    return (
        f"Emissive faces of object '{emitter}' lie in one plane with {place}, where Cycles' light depends on rounding; "
        "it was baked as if in front: move it 1 mm in front."
    )
