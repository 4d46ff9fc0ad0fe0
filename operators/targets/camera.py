"""Light in the pixels of a camera, as an EXR file that a compositor adds to a render of direct light."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...addon.blender.compositing.files import blend_name, own_name, remember_pass
from ...addon.blender.compositing.nodes import reload_pass
from ...addon.blender.read.camera import read_camera, read_frame, read_pixel_filter, render_camera
from ...addon.core.errors import Advice, BakeError
from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.output import check_place
from ...addon.output.camera import FILE, SCENE, CameraPass, PictureFrame, denoised, frame_path, write_camera_pass
from ...addon.output.oidn import has_oidn
from ...addon.receivers import Camera, PixelFilter, Receivers
from ...addon.scene import Scene
from ...addon.settings.bake import BakeSettings
from ...addon.settings.camera import CameraSettings
from ...addon.tracing import EmbreeTracer
from ..jobs.folders import check_folder, make_folder
from ..jobs.versions import own_version
from ..jobs.written import Written

if TYPE_CHECKING:
    from ...addon.gather import Irradiance
    from ...addon.pipeline.camera_pass import LightBeside
    from ...addon.pipeline.solution import Solution
    from ...addon.receivers import CameraPoints
    from ...addon.tracing import TransparencyTracer

FILTERING = "Denoising the pass"

_N_CHANNELS, _BYTES_OF_DEPTH = 19, 4  # of a pixel, before the file is compressed; depth is one more
_LEAST_RAYS = 2  # of a pixel that is all gloss
_BYTES_OF_CHANNEL = {"half": 2, "float": 4}


@dataclass(frozen=True)
class CameraRequest:
    """The pass of the scene's camera is wanted.

    Attributes
    ----------
    settings : CameraSettings
    folder : Path
        For its file; made where it is missing.
    groups : tuple of str
        Light groups that may get layers of their own; empty where all light is baked together.
    """

    settings: CameraSettings
    folder: Path
    groups: tuple[str, ...] = ()

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "CameraTarget":
        """See `Request.read`."""
        if names is not None:
            warnings.append(Advice("The camera's pass shows all objects, and not only those that are to get light."))
        camera = read_camera(scene, depsgraph, warnings)
        frame = scene.frame_current
        name = own_name(self.settings.file_name, scene)
        path = frame_path(self.folder, name, frame)
        check_folder(self.folder, "the camera's pass")
        check_place(path)
        if self.settings.pass_denoiser == "oidn" and not has_oidn():
            raise BakeError("OpenImageDenoise (pyoidn) is not installed: install the extension's zip, or choose auto.")
        software = f"Photon Bake {own_version()}, Blender {bpy.app.version_string}"
        origin = {"Software": software, FILE: blend_name(), SCENE: scene.name}
        origin |= {"Camera": render_camera(scene).name, "Frame": str(frame)}
        return CameraTarget(
            camera, read_pixel_filter(scene), read_frame(scene), self.settings, path, name, origin, len(self.groups)
        )


@dataclass(frozen=True)
class CameraTarget:
    """A camera whose pass is wanted, the file that it goes to and its name with #, and what it says of its origin."""

    camera: Camera
    pixel_filter: PixelFilter
    frame: PictureFrame
    settings: CameraSettings
    path: Path
    name: str
    origin: dict[str, str]
    n_groups: int = 0

    @property
    def object_names(self) -> list[str]:
        """None: the light goes to a file."""
        return []

    @property
    def sizes(self) -> dict[Path, int]:
        """See `Target.sizes`."""
        n_channels = _N_CHANNELS + 3 * self.n_groups
        of_pixel = n_channels * _BYTES_OF_CHANNEL[self.settings.precision] + _BYTES_OF_DEPTH
        return {self.path: self.frame.width * self.frame.height * of_pixel}

    def at_time(self, depsgraph: Any, scene: Any, n_times: int) -> "CameraTarget":
        """The same as the camera stands in a graph that was moved to one of several times, for a share of the rays."""
        of = self.settings
        gloss, volume = (max(_LEAST_RAYS, -(-n // n_times)) for n in (of.n_gloss_rays, of.n_media_rays))
        n_samples = -(-of.n_pixel_samples // n_times)
        settings = replace(of, n_pixel_samples=n_samples, n_gloss_rays=gloss, n_media_rays=volume)
        return replace(self, camera=read_camera(scene, depsgraph), settings=settings)

    def samples(self, scene: Scene, tracer: EmbreeTracer, workers: Workers, warnings: list[str]) -> "CameraSamples":
        """See `Target.samples`."""
        from ...addon.tracing import TransparencyTracer

        points = self.seen(scene, TransparencyTracer(scene, tracer, workers.progress), workers)
        if len(points) == 0:
            warnings.append(Advice("The camera sees no surface, so its pass is empty."))
        return CameraSamples(points, points.receivers(scene), scene, self, warnings)

    def seen(self, scene: Scene, tracer: "TransparencyTracer", workers: Workers) -> "CameraPoints":
        """What the camera sees: the same points whatever the scene's lights are, and the light beyond mirrors."""
        from ...addon.receivers import camera_points

        return camera_points(scene, tracer, self.camera, self.pixel_filter, self.settings.n_pixel_samples, workers)


@dataclass(frozen=True)
class CameraSamples:
    """What the camera sees, and the receivers there; of several times their passes' mean."""

    points: "CameraPoints"
    receivers: Receivers
    scene: Scene
    target: CameraTarget
    warnings: list[str]
    beside: "LightBeside | None" = None
    solved_by: BakeSettings | None = None
    passes: CameraPass | None = None

    def lit_by(self, solution: "Solution", workers: Workers) -> "CameraSamples":
        """See `Samples.lit_by`: by what gloss shows, and by caustics."""
        from ...addon.pipeline.camera_pass import light_beside

        settings, points = self.target.settings, self.points
        if solution.scene is not self.scene and points.beyond.any():  # that is the light of all lights
            points = self.target.seen(solution.scene, solution.tracer, workers)
        beside = light_beside(solution.scene, points, solution, settings.n_gloss_rays, settings.n_media_rays, workers)
        return replace(self, points=points, beside=beside, solved_by=solution.settings)

    def kept(self) -> Any:
        """See `Samples.kept`."""
        return {"beside": self.beside, "beyond": self.points.beyond, "solved_by": self.solved_by}

    def with_kept(self, kept: Any) -> "CameraSamples":
        """See `Samples.with_kept`."""
        points = replace(self.points, beyond=kept["beyond"])
        return replace(self, points=points, beside=kept["beside"], solved_by=kept["solved_by"])

    def _exposed(self, irradiance: "Irradiance") -> CameraPass:
        from ...addon.pipeline.camera_pass import camera_pass

        return camera_pass(self.points, irradiance, self.beside)

    @staticmethod
    def over_time(
        shots: "Sequence[tuple[CameraSamples, Irradiance]]",
    ) -> "tuple[CameraSamples, Irradiance]":
        """See `Samples.over_time`: surfaces are seen where they are at each time."""
        from ...addon.gather import Irradiance

        passes = CameraPass.mean([one._exposed(irradiance) for one, irradiance in shots])
        (first, light), n = shots[0], np.float32(len(shots))
        of_all = [replace(one, stderr=one.stderr / np.sqrt(n)) for _, one in shots]  # as in the pixels
        return replace(first, passes=passes), Irradiance.join(of_all, light.counts)

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "CameraPicture":
        """See `Samples.finish`."""
        settings, solved_by = self.target.settings, self.solved_by
        passes = self.passes or self._exposed(irradiance)
        if not np.isfinite(passes.indirect).all():
            raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
        if settings.pass_denoiser == "oidn" or (settings.pass_denoiser == "auto" and has_oidn()):
            workers.progress.update(FILTERING, 0)
            smooth = solved_by is not None and solved_by.smooth
            passes = denoised(passes, settings.pass_denoiser == "oidn" or not smooth, workers.memory)
            workers.progress.update(FILTERING, 1)
        made_with = asdict(solved_by) if solved_by else {}
        return CameraPicture(passes, self.target, len(self.points), made_with)


@dataclass(frozen=True)
class CameraPicture:
    """A finished pass."""

    passes: CameraPass
    target: CameraTarget
    n_points: int
    made_with: dict[str, Any]

    def of_target(self, target: CameraTarget) -> "CameraPicture":
        """See `Output.of_target`."""
        return replace(self, target=target)

    @staticmethod
    def together(apart: "Mapping[str, CameraPicture]") -> "CameraPicture":
        """See `Output.together`."""
        passes = CameraPass.together({name: one.passes for name, one in apart.items()})
        return replace(next(iter(apart.values())), passes=passes)

    def concerns(self) -> list[str]:
        """See `Output.concerns`: none."""
        return []

    def write(self) -> Written:
        """See `Output.write`."""
        target = self.target
        make_folder(target.path.parent)
        settings = json.dumps({**self.made_with, **asdict(target.settings)})
        metadata = {
            **target.origin,
            "PhotonBakeSettings": settings,
            "PhotonBakeSeed": self.made_with.get("seed", 0),
        }
        half = target.settings.precision == "half"
        write_camera_pass(target.path, self.passes, target.frame, metadata, half, target.settings.compression)
        scene = bpy.data.scenes.get(target.origin[SCENE])
        if scene is not None and scene.is_editable:
            remember_pass(scene, target.path.parent, target.name)
        reload_pass(target.path)
        return Written(files=[target.path])

    @property
    def files(self) -> list[Path]:
        return [self.target.path]

    @property
    def counts(self) -> dict[str, int]:
        return {"camera_passes": 1, "camera_pixels": self.target.camera.n_pixels, "camera_points": self.n_points}
