"""Light averaged over the time that the shutter is open: each moment is read, and solved with its share of the work."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ...addon.blender import (
    Movement,
    SceneReading,
    check_simulations,
    displace,
    move_to_frame,
    other_times,
    shutter_frames,
    shutter_middle,
)
from ...addon.core.errors import Advice, BakeError
from ...addon.core.inspector import Inspector
from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.receivers import Riding
from ...addon.scene import LightGroups, Scene
from ...addon.settings.bake import BakeSettings, part_of_shutter
from ...addon.tracing import EmbreeTracer
from ..targets.camera import CameraSamples, CameraTarget
from ..targets.probes import ProbeSamples
from ..targets.target import Target

if TYPE_CHECKING:
    from ...addon.pipeline.outputs import Exposure

_OF_MIDDLE = 0.4
"""Of the stage in which the scene is read: what is read in the middle of the shutter."""

ReadNow = Callable[[Any, Progress], tuple[list[Target], SceneReading]]


@dataclass(frozen=True)
class Moment:
    """What is elsewhere at one time than in the middle, and the camera that looks at it, if one does."""

    movement: Movement
    camera: CameraTarget | None


def read_shutter(
    depsgraph: Any, scene: Any, read: ReadNow, n_steps: int, warnings: list[str], progress: Progress
) -> tuple[list[Target], SceneReading, list[Moment]]:
    """What `read` reads in the middle of the shutter, and where things are at so many times.

    Raises
    ------
    BakeError
        If an object that gets light has other faces at one of them, or a simulation is not baked.
    """
    check_simulations(scene)
    displaced: dict[int, Any] = {}

    def go_to(frame: float) -> None:
        move_to_frame(frame)
        displace(depsgraph, warnings, displaced)

    with other_times(scene):
        go_to(shutter_middle(scene))
        targets, reading = read(depsgraph, progress.part(0, _OF_MIDDLE))
        camera = next((target for target in targets if isinstance(target, CameraTarget)), None)
        moments = []
        for i, frame in enumerate(shutter_frames(scene, n_steps)):
            go_to(frame)
            part = [_OF_MIDDLE + (1 - _OF_MIDDLE) * done / n_steps for done in (i, i + 1)]
            movement = reading.moved(depsgraph, progress.part(*part))
            moments.append(Moment(movement, camera and camera.at_time(depsgraph, scene, n_steps)))
    _check({name for target in targets for name in target.object_names}, moments, warnings)
    return targets, reading, moments


def _check(receiving: set[str], moments: Sequence[Moment], warnings: list[str]) -> None:
    """See that what gets light has the same faces at all times; tell of others that have not."""
    for name in dict.fromkeys(name for one in moments for name in one.movement.changed):
        if name in receiving:
            raise BakeError(
                f"Object '{name}' has other faces at some time within the shutter, so its light cannot be averaged: "
                "turn Motion Blur off, shorten the Shutter, or keep its modifiers from changing its topology."
            )
        sentence = f"Object '{name}' has other faces at some time within the shutter, and stands still in its light."
        warnings.append(Advice(sentence))


def exposed_over(
    moments: Sequence[Moment],
    middle: Scene,
    light_groups: LightGroups | None,
    samples: Sequence[Any],
    settings: BakeSettings,
    tracer: EmbreeTracer,
    workers: Workers,
    inspector: Inspector | None,
) -> "list[Exposure]":
    """The light of samples of the scene in the middle at each moment; what lies on surfaces rides on them.

    Parameters
    ----------
    light_groups : LightGroups or None
        Where they are lit each apart.
    settings : BakeSettings
        Of all moments together.
    tracer : EmbreeTracer
        Of the scene in the middle.
    """
    from ...addon.pipeline.outputs import expose

    ridings = [Riding.of(one.receivers, middle, tracer) if hasattr(one, "riding") else None for one in samples]
    exposures = []
    for i, (moment, part) in enumerate(zip(moments, workers.parts(len(moments)), strict=True)):
        movement, of_step = moment.movement, part_of_shutter(settings, i)
        part = replace(part, seed=of_step.seed)
        scene = movement.of(middle)
        there = EmbreeTracer(scene)
        own = list(samples)
        for k, riding in enumerate(ridings):
            if riding is not None:
                own[k] = own[k].riding(riding.on(movement.vertices, movement.corner_normals))
            elif moment.camera is not None and isinstance(own[k], CameraSamples):
                own[k] = moment.camera.samples(scene, there, part, [])
            elif isinstance(own[k], ProbeSamples):
                own[k] = own[k].share(len(moments))
        lit = list(light_groups.apart(scene).values()) if light_groups else []
        exposures.append(expose(scene, lit or [scene], own, of_step, there, part, inspector if i == 0 else None))
    return exposures
