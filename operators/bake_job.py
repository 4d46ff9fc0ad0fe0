"""A bake in three steps, for the button, for scripts and for the command line: one solve for all that is asked for."""

from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Protocol

import bpy
import numpy as np

from ..addon.blender import READING, SceneReading, in_render_graph, read_scene
from ..addon.blender.as_read import Placement, edit_mode_left, named
from ..addon.blender.baked_copies import originals_shown
from ..addon.errors import Advice, BakeError, Cancelled, refuse_differences
from ..addon.inspector import Inspector
from ..addon.output import check_space
from ..addon.parallel import Workers, aside
from ..addon.progress import Progress
from ..addon.receivers import AttributeTarget, Receivers
from ..addon.scene import Scene
from ..addon.settings import BakeSettings
from ..addon.tracers import Tracer
from ..addon.ui.state import duration
from .camera_target import CameraTarget
from .describe import describe
from .written import Written

if TYPE_CHECKING:
    from ..addon.bake import Solution
    from ..addon.gather import Irradiance

N_LIGHT_RAYS = 1000
"""That are followed to see which surfaces cube maps are to show."""

NO_LIGHT = (
    "Nothing in the scene gives light, so what was baked is black: add a lamp, an emissive material or a world color."
)
_LATE = 1.5
"""Times the time that was asked for, from which on a bake says that it took longer."""

WRITING = "Writing the light"


class Product(Protocol):
    """What a target makes of light, ready to be written.

    Attributes
    ----------
    files : list of Path
        That writing it writes, if nothing stands in the way.
    counts : dict of str to int
        For the report.
    """

    @property
    def files(self) -> list[Path]: ...

    @property
    def counts(self) -> dict[str, int]: ...

    def concerns(self) -> list[str]:
        """What writing it now would have to warn of; for the main thread."""

    def write(self) -> Written:
        """Write to Blender's data and to files what can be written; for the main thread.

        Raises
        ------
        BakeError
            If nothing can be, and nothing was changed.
        """


class Points(Protocol):
    """Where a target wants light."""

    @property
    def receivers(self) -> Receivers: ...

    def lit_by(self, solution: "Solution", workers: Workers) -> "Points":
        """The same with what is wanted of a solution beside the receivers' light; touches none of Blender's data.

        That comes first, so that the light is gathered in the time that is left.
        """

    def finish(self, irradiance: "Irradiance", workers: Workers) -> Product:
        """Make the product of the receivers' light; touches none of Blender's data."""


class Target(Protocol):
    """Something that light is baked to, as it was read out of Blender's data.

    Attributes
    ----------
    object_names : list of str
        Objects that get light.
    """

    @property
    def object_names(self) -> list[str]: ...

    @property
    def sizes(self) -> dict[Path, int]:
        """How large the files that it goes to may become, bytes."""

    def points(self, scene: Scene, tracer: Tracer, workers: Workers, warnings: list[str]) -> Points:
        """Where light is wanted; touches none of Blender's data."""


class Wanted(Protocol):
    """A target that was asked for."""

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> Target:
        """Read it out of a graph of a Blender scene, for objects of some names or for all.

        Raises
        ------
        BakeError
            If nothing can be baked to, or an object asked for cannot take the light.
        """


@dataclass(frozen=True)
class Solved:
    """Light that is ready to be written.

    Attributes
    ----------
    irradiance : Irradiance
        Of all targets' receivers, one after the other.
    products : list of Product
        One a target.
    """

    irradiance: "Irradiance"
    products: list[Product]

    @property
    def files(self) -> list[Path]:
        """That writing the products writes."""
        return [path for product in self.products for path in product.files]

    @property
    def counts(self) -> dict[str, int]:
        """What the bake counted, for its report."""
        counts = dict(self.irradiance.counts)
        for product in self.products:
            counts |= product.counts
        return counts


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
    """

    scene: Scene
    targets: list[Target]
    warnings: list[str]
    counts: dict[str, int]
    placement: Placement
    strict: bool = False

    @classmethod
    def prepare(
        cls,
        context: Any,
        wanted: Sequence[Wanted],
        progress: Progress,
        names: list[str] | None = None,
        light_group: str = "",
        strict: bool = False,
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

        Raises
        ------
        BakeError
            If the scene cannot be baked, or an object cannot take the light.
        """
        progress.update(READING, 0)
        warnings: list[str] = []

        def read(depsgraph: Any) -> tuple[list[Target], SceneReading]:
            targets = [one.read(depsgraph, context.scene, names, progress, warnings) for one in wanted]
            for_camera = any(isinstance(target, CameraTarget) for target in targets)
            return targets, read_scene(depsgraph, warnings, light_group, for_camera, progress)

        copies = any(getattr(one, "copies", False) for one in wanted)
        with originals_shown() if copies else nullcontext():
            targets, reading = in_render_graph(context.scene, context.view_layer, read)
        scene = reading.scene(context.scene)
        progress.update(READING, 1)
        counts, placement = {"triangles": scene.n_triangles}, Placement(context.view_layer)
        return cls(scene, targets, list(dict.fromkeys(warnings)), counts, placement, strict)

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
        """
        return aside(lambda: self._solve(settings, progress, inspector), progress.check)

    def _solve(self, settings: BakeSettings, progress: Progress, inspector: Inspector | None) -> Solved:
        from ..addon.bake import no_light, solve  # here, as Blender's start should not wait for SciPy
        from ..addon.gather import OpenBacks

        inspector, started = inspector or Inspector(), perf_counter()
        workers = Workers(settings.seed, settings.n_threads, progress, settings.memory)
        tracer = make_tracer(self.scene, self.warnings)
        points = [target.points(self.scene, tracer, workers, self.warnings) for target in self.targets]
        self.check_strict()
        receivers = _joined([one.receivers for one in points])
        backs = OpenBacks.of(receivers, tracer, workers, settings.open_side)
        if settings.open_side:
            receivers = backs.added_to(receivers)
        maps = None
        if settings.tracer == "multi_image" and len(receivers):
            maps = self._take_cube_maps(tracer, receivers, settings, workers, inspector)
        solution = None
        if len(receivers):
            solution = solve(self.scene, receivers, settings, tracer, progress, inspector, maps, started)
            if solution.dark:
                self.warnings.append(NO_LIGHT)
            self.warnings += [_flush(*names) for names in solution.tracer.flush_emitters]
            points = [one.lit_by(solution, workers) for one in points]
        light = solution.irradiance() if solution else no_light()
        if settings.open_side:
            light = backs.taken(light)
        elif solution:
            self.warnings += [_turned_away(name) for name in backs.lit_behind(self.scene, solution.photons)]
        ends = np.cumsum([len(one.receivers) for one in points])
        parts = [light.where(slice(end - len(one.receivers), end)) for one, end in zip(points, ends, strict=True)]
        products = [one.finish(part, workers) for one, part in zip(points, parts, strict=True)]
        self._warn_if_late(perf_counter() - started, settings.time)
        return Solved(light, products)

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
        if refusals and len(refusals) == len(solved.products):
            raise BakeError(" ".join(refusals))
        written.failures += refusals
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
        from ..addon.photons import emitted_rays, light_sources, region_of
        from ..addon.tracers.multi_image import LightRays, MultiImageTracer, lit_region

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


def _joined(parts: list[Receivers]) -> Receivers:
    """All receivers, in order."""
    if len(parts) == 1:
        return parts[0]
    targets: list[AttributeTarget] = []
    first = 0
    for part in parts:
        for target in part.targets:
            of_element = target.receiver_of_element
            moved = np.where(of_element >= 0, of_element + np.int32(first), np.int32(-1))
            targets.append(replace(target, receiver_of_element=moved))
        first += len(part)
    position, normal, footprint = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("position", "normal", "footprint")
    )
    takes = None
    if any(part.takes_caustics is not None for part in parts):
        ones = [np.ones(len(part), bool) if part.takes_caustics is None else part.takes_caustics for part in parts]
        takes = np.concatenate(ones)
    return Receivers(position, normal, footprint, tuple(targets), takes, any(part.directional for part in parts))


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


def make_tracer(scene: Scene, warnings: list[str]) -> Tracer:
    """Embree's tracer, or where Embree is not installed Blender's own with a notice."""
    try:
        from ..addon.tracers.embree import EmbreeTracer
    except ImportError:
        from ..addon.blender import BVHTracer

        slow = "embreex is not installed, so Blender's slower BVH traces rays: install the extension's zip."
        warnings.append(Advice(slow))
        return BVHTracer(scene)
    return EmbreeTracer(scene)
