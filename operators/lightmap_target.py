"""Light at texels, as lightmaps."""

from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..addon.blender import bake_objects
from ..addon.blender.lightmap_checks import check_uv
from ..addon.blender.lightmap_layout import Layout, lay_out
from ..addon.blender.lightmap_meshes import check_lightmap_object, lightmap_meshes
from ..addon.blender.lightmap_writing import check_unchanged, write_lightmaps
from ..addon.errors import BakeError
from ..addon.lightmap_settings import LightmapSettings
from ..addon.output import atomic_path, check_writable
from ..addon.parallel import Workers
from ..addon.progress import Progress
from ..addon.receivers import AttributeTarget, LightmapMesh, Receivers
from ..addon.scene import Scene
from ..addon.tracers import Tracer

if TYPE_CHECKING:
    from ..addon.bake import Solution
    from ..addon.gather import Irradiance
    from ..addon.receivers import Texels

KIND = "indirect"
"""What the images hold, for the files' names."""


@dataclass(frozen=True)
class WantedLightmaps:
    """Light is wanted in images.

    Attributes
    ----------
    settings : LightmapSettings
    folder : Path
        For their files; made where it is missing.
    scene : str
        Name of the scene, for the files' names.
    preview : Path or None
        A PNG with all of them to look at.
    """

    settings: LightmapSettings
    folder: Path
    scene: str
    preview: Path | None = None

    def read(
        self, depsgraph: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "LightmapTarget":
        """See `Wanted.read`."""
        from ..addon.output.lightmap import image_path

        settings = self.settings
        check = partial(check_lightmap_object, uv_map=settings.uv_map)
        objects = bake_objects(depsgraph, names, warnings, check)
        layout = lay_out(objects, depsgraph, settings, warnings, progress)
        paths = [image_path(self.folder, self.scene, name, KIND, settings.file_format) for name in layout.names]
        _check_paths(paths, self.folder)
        if self.preview is not None:
            check_writable(self.preview)
        meshes = lightmap_meshes(objects, depsgraph, layout)
        check_uv(meshes, layout.sizes, layout.uv_map)
        return LightmapTarget(meshes, layout, settings, paths, self.preview)


def _check_paths(paths: list[Path], folder: Path) -> None:
    """Find out before the work whether the files can be written after it."""
    twice = {str(path).lower() for path in paths}
    if len(twice) < len(paths):
        raise BakeError("Objects have names that differ only in signs no file name may hold: rename one of them.")
    if not folder.exists():
        check_writable(next(parent for parent in folder.parents if parent.exists()) / folder.name)
        return
    if not folder.is_dir():
        raise BakeError(f"{folder} is a file; give a folder for the lightmaps.")
    for path in paths:
        check_writable(path)


@dataclass(frozen=True)
class LightmapTarget:
    """Objects that get lightmaps: their meshes in the images, the images' files, and a picture of all of them."""

    meshes: list[LightmapMesh]
    layout: Layout
    settings: LightmapSettings
    paths: list[Path]
    preview: Path | None

    @property
    def object_names(self) -> list[str]:
        return [place.object_name for place in self.layout.places]

    def points(self, scene: Scene, tracer: Tracer, workers: Workers, warnings: list[str]) -> "LightmapPoints":
        """See `Target.points`."""
        from ..addon.receivers import texel_receivers

        receivers, texels = texel_receivers(self.meshes, self.layout.sizes, tracer, workers)
        charts = texels.charts
        mesh_of_chart = np.zeros(max(charts.n_charts, 1), np.int32)
        mesh_of_chart[charts.chart] = charts.mesh
        mesh = mesh_of_chart[texels.chart % len(mesh_of_chart)]
        targets = tuple(  # which object a receiver is on decides which lamps light it
            AttributeTarget(place.object_name, place.mesh_name, "POINT", np.flatnonzero(mesh == i).astype(np.int32))
            for i, place in enumerate(self.layout.places)
        )
        return LightmapPoints(replace(receivers, targets=targets), texels, self)


@dataclass(frozen=True)
class LightmapPoints:
    """Receivers at texels."""

    receivers: Receivers
    texels: "Texels"
    target: LightmapTarget

    def finish(self, irradiance: "Irradiance", workers: Workers, solution: "Solution | None" = None) -> "Lightmaps":
        """See `Points.finish`."""
        from ..addon.output.lightmap import FinishOptions, finish_lightmaps

        if not np.isfinite(irradiance.value).all():
            raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
        pi = np.float32(np.pi)
        options = FinishOptions(denoiser=self.target.settings.denoiser)
        texels = self.texels
        values, stderr = irradiance.value / pi, irradiance.stderr / pi
        images = finish_lightmaps(values, stderr, self.receivers, texels, options, workers)
        covered = len(np.unique(np.stack([texels.image, texels.row, texels.column]), axis=1).T)
        return Lightmaps(images, self.target, covered)


@dataclass(frozen=True)
class Lightmaps:
    """Finished images (height, width, 3) float32 of E/π, row 0 at v = 0, and how many of their texels are covered."""

    images: list[np.ndarray]
    target: LightmapTarget
    n_covered: int

    def write(self) -> list[str]:
        """See `Product.write`."""
        from ..addon.output.lightmap import contact_sheet, write_lightmap
        from ..addon.output.png import write_png

        settings, paths = self.target.settings, self.target.paths
        check_unchanged(self.target.layout)
        try:
            for path in paths:
                path.parent.mkdir(parents=True, exist_ok=True)
                check_writable(path)
            with ExitStack() as stack:  # every file is written before the first takes its place
                for path, image in zip(paths, self.images, strict=True):
                    temporary = stack.enter_context(atomic_path(path))
                    write_lightmap(temporary, image, settings.file_format, settings.value_range)
                if self.target.preview is not None:
                    write_png(self.target.preview, contact_sheet(self.images))
        except OSError as error:
            raise BakeError(f"The lightmaps cannot be written ({error.strerror}): {error.filename}.") from error
        write_lightmaps(self.target.layout, paths, settings)
        return []

    @property
    def files(self) -> list[Path]:
        preview = self.target.preview
        return self.target.paths + ([] if preview is None else [preview])

    @property
    def counts(self) -> dict[str, int]:
        texels = sum(height * width for height, width in self.target.layout.sizes)
        return {"lightmaps": len(self.images), "lightmap_texels": texels, "covered_texels": self.n_covered}
