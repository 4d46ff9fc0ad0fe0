"""Light at texels, as lightmaps."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...addon.blender.lightmap.layout import Layout
from ...addon.blender.lightmap.reading import LightmapReading
from ...addon.blender.lightmap.subjects import Subject
from ...addon.blender.lightmap.writing import write_lightmaps
from ...addon.blender.overrides import density_factors
from ...addon.blender.read.as_read import AsRead, still_there
from ...addon.blender.read.lamps.light_layers import write_lightmap_layers
from ...addon.blender.write.baked_copies import MadeMesh, drop_meshes, make_meshes, place_copies
from ...addon.core.errors import BakeError
from ...addon.core.findings import counted
from ...addon.core.parallel import Workers
from ...addon.core.progress import Progress
from ...addon.output import atomic_path, check_place, check_writable
from ...addon.receivers import AttributeTarget, LightmapMesh, Receivers, Ride
from ...addon.scene import Scene
from ...addon.settings.frames import Frames
from ...addon.settings.lightmap import LightmapSettings
from ...addon.tracing import EmbreeTracer
from ..jobs.folders import check_folder
from ..jobs.written import Written

if TYPE_CHECKING:
    from ...addon.gather import Irradiance
    from ...addon.output.lightmap import Finished
    from ...addon.pipeline.solution import Solution
    from ...addon.receivers import Texels

KIND = "indirect"
"""What the images hold, for the files' names; those of directional light have kinds of their own."""

_BYTES_OF_TEXEL = {"exr_half": 6, "exr_float": 12, "hdr": 4, "rgbm": 4, "rgbd": 4}
"""At most, before files are compressed."""


@dataclass(frozen=True)
class LightmapRequest:
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
    groups : tuple of str
        Light groups that may get images of their own; empty where all light is baked together.
    copies : bool
        Whether objects whose mesh cannot hold their light get copies with meshes of their own.
    density_of : mapping
        Factors of texels a metre, by objects' names; others have those of their own settings.
    frame : str
        Of several frames, what the files' names end in.
    layout : Layout or None
        Of an earlier frame, which this one has too.
    """

    settings: LightmapSettings
    folder: Path
    scene: str
    preview: Path | None = None
    groups: tuple[str, ...] = ()
    copies: bool = False
    density_of: Mapping[str, float] = field(default_factory=dict)
    frame: str = ""
    layout: Layout | None = None

    def read(
        self, depsgraph: Any, scene: Any, names: list[str] | None, progress: Progress, warnings: list[str]
    ) -> "LightmapTarget":
        """See `Request.read`."""
        density_of = {**density_factors(bpy.data.objects), **self.density_of}
        reading = LightmapReading(depsgraph, self.settings, self.copies, density_of, warnings, progress)
        found = reading.again(self.layout) if self.layout else reading.objects(names)
        paths = self._paths(found.layout)
        _check_paths(found.layout.names, paths, self.folder)
        if self.preview is not None:
            check_writable(self.preview)
        return LightmapTarget(
            found.meshes, found.layout, self.settings, paths, self.preview, found.meanwhile, found.subjects
        )

    def _paths(self, layout: Layout) -> list[dict[str, Path]]:
        """The files of each lightmap, by what is in them."""
        from ...addon.output.lightmap import KINDS, image_path

        of_light = (KIND, *KINDS) if self.settings.directional else (KIND,)
        kinds = [*of_light, *(_of_group(kind, group) for group in self.groups for kind in of_light)]
        place, file_format = (self.folder, self.scene), self.settings.file_format
        return [
            {kind: image_path(*place, name, kind, file_format, self.frame) for kind in kinds} for name in layout.names
        ]


def _of_group(kind: str, group: str) -> str:
    """What a light group's images hold."""
    return f"{kind}.{group}"


def _check_paths(names: Sequence[str], paths_of: Sequence[Mapping[str, Path]], folder: Path) -> None:
    """Find out before the work whether the files of lightmaps of some names can be written after it."""
    owners: dict[str, str] = {}
    for name, paths in zip(names, paths_of, strict=True):
        other = owners.setdefault(str(next(iter(paths.values()))).lower(), name)
        if other is not name:
            raise BakeError(
                f"The names of objects '{other}' and '{name}' differ only in signs no file name may hold: rename one "
                "of them, or have their lightmaps in one image (Atlas: Shared)."
            )
    check_folder(folder, "the lightmaps")
    for paths in paths_of:
        for path in paths.values():
            check_place(path)


@dataclass(frozen=True)
class LightmapTarget:
    """Objects that get lightmaps: their meshes in the images, each image's files by kind, and a picture of all.

    `meanwhile` is of those `subjects` that get no copy.
    """

    meshes: list[LightmapMesh]
    layout: Layout
    settings: LightmapSettings
    paths: list[dict[str, Path]]
    preview: Path | None
    meanwhile: list[AsRead]
    subjects: list[Subject]

    @property
    def object_names(self) -> list[str]:
        return list(dict.fromkeys(place.object_name for place in self.layout.places))

    @property
    def sizes(self) -> dict[Path, int]:
        """See `Target.sizes`."""
        n_bytes = _BYTES_OF_TEXEL[self.settings.file_format]
        images = zip(self.paths, self.layout.sizes, strict=True)
        return {path: height * width * n_bytes for paths, (height, width) in images for path in paths.values()}

    def samples(self, scene: Scene, tracer: EmbreeTracer, workers: Workers, warnings: list[str]) -> "TexelSamples":
        """See `Target.samples`."""
        from ...addon.receivers import texel_receivers

        receivers, texels = texel_receivers(self.meshes, self.layout.sizes, tracer, workers)
        charts = texels.charts
        mesh_of_chart = np.zeros(max(charts.n_charts, 1), np.int32)
        mesh_of_chart[charts.chart] = charts.mesh
        mesh = mesh_of_chart[texels.chart % len(mesh_of_chart)]
        targets = tuple(  # which object a receiver is on decides which lamps light it
            AttributeTarget(place.object_name, place.mesh_name, "POINT", np.flatnonzero(mesh == i).astype(np.int32))
            for i, place in enumerate(self.layout.places)
        )
        wanted = replace(receivers, targets=targets, directional=self.settings.directional)
        return TexelSamples(wanted, texels, self)


@dataclass(frozen=True)
class TexelSamples:
    """Receivers at texels."""

    receivers: Receivers
    texels: "Texels"
    target: LightmapTarget
    ride: Ride | None = None

    def riding(self, ride: Ride) -> "TexelSamples":
        """The same at another time."""
        return replace(self, receivers=ride.receivers, ride=ride)

    def lit_by(self, solution: "Solution", workers: Workers) -> "TexelSamples":
        """See `Samples.lit_by`: nothing is."""
        return self

    def at_rest(self, light: "Irradiance") -> "Irradiance":
        """Light whose slope is over the normals that texels have at rest."""
        slope = None if self.ride is None or light.slope is None else self.ride.at_rest(light.slope)
        return light if slope is None else replace(light, slope=slope)

    @staticmethod
    def over_time(shots: "Sequence[tuple[TexelSamples, Irradiance]]") -> "tuple[TexelSamples, Irradiance]":
        """See `Samples.over_time`: the mean light of each texel."""
        from ...addon.gather import Irradiance

        return shots[0][0], Irradiance.mean([one.at_rest(light) for one, light in shots])

    def finish(self, irradiance: "Irradiance", workers: Workers) -> "Lightmaps":
        """See `Samples.finish`."""
        from ...addon.output.lightmap import FinishOptions, finish_lightmaps

        if not np.isfinite(irradiance.value).all():
            raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
        pi, settings, texels = np.float32(np.pi), self.target.settings, self.texels
        smooth = settings.denoiser == "auto" and irradiance.interpolated
        options = FinishOptions(denoiser="none" if smooth else settings.denoiser)
        values, stderr = irradiance.value / pi, irradiance.stderr / pi
        if settings.directional and irradiance.slope is not None:
            values = np.concatenate([values, irradiance.slope.reshape(-1, 9) / pi], axis=1)
        finished = finish_lightmaps(values, stderr, self.receivers, texels, options, workers)
        return Lightmaps(finished, self.target, texels.n_covered)


@dataclass(frozen=True)
class WrittenImages:
    """What came of writing lightmaps: the files of light by image, and what is at the places that take it."""

    written: Written
    paths: dict[int, Path]
    there: list[Any]


@dataclass(frozen=True)
class Lightmaps:
    """Finished images, and how many of their texels are covered.

    Attributes
    ----------
    finished : list of Finished
        E/π, with its slope if that is asked for.
    apart : dict of str to Lightmaps
        Those of light groups.
    """

    finished: "list[Finished]"
    target: LightmapTarget
    n_covered: int
    apart: "Mapping[str, Lightmaps]" = field(default_factory=dict)

    def of_target(self, target: LightmapTarget) -> "Lightmaps":
        """See `Output.of_target`."""
        return replace(self, target=target)

    @staticmethod
    def together(apart: "Mapping[str, Lightmaps]") -> "Lightmaps":
        """See `Output.together`."""
        from ...addon.output.lightmap import Finished

        parts = list(apart.values())
        of_images = zip(*(one.finished for one in parts), strict=True)
        return replace(parts[0], finished=[Finished.together(of) for of in of_images], apart=apart)

    @property
    def images(self) -> list[np.ndarray]:
        """E/π, (height, width, 3) float32 each."""
        return [one.light for one in self.finished]

    def concerns(self) -> list[str]:
        """See `Output.concerns`."""
        return still_there(self.target.meanwhile)[1]

    def write(self) -> Written:
        """See `Output.write`."""
        images = self.write_files()
        self.enter(images, images.written)
        return images.written

    def write_files(self) -> "WrittenImages":
        """Write the images of the objects that are still there; nothing in the .blend file refers to them yet.

        Raises
        ------
        BakeError
            If no image can be written.
        """
        own, warnings = still_there(self.target.meanwhile)
        subjects, remaining = self.target.subjects, iter(own)
        wanted = {one.copy: one.corner_vertex for one in subjects if one.copy and one.corner_vertex is not None}
        made, changed = make_meshes(wanted)
        try:
            there = [made.get(one.copy) if one.copy else next(remaining) for one in subjects]
            return WrittenImages(*self._write_images(there, [*warnings, *changed]), there)
        except BaseException:
            drop_meshes(made.values())
            raise

    def enter(self, images: "WrittenImages", written: Written, frames: Frames | None = None) -> None:
        """Let objects have what was written, of several frames all images; tell of it in `written`."""
        layout, settings, paths = self.target.layout, self.target.settings, images.paths
        objects = self._with_copies(images.there, paths)
        n_objects = sum(place.image in paths for place in layout.places)
        of_frames = f"{len(frames)} frames of " if frames else ""
        written.places.append(f"{of_frames}{counted(len(paths), 'lightmap')} on {counted(n_objects, 'object')}")
        written.warnings += write_lightmaps(layout, objects, paths, settings, frames)
        of_images = [(image, self.target.paths[image]) for image in paths]
        groups = {name: {image: of[_of_group(KIND, name)] for image, of in of_images} for name in self.apart}
        write_lightmap_layers(layout, objects, groups, settings, frames)

    def _with_copies(self, there: list[Any], paths: Mapping[int, Path]) -> list[Any]:
        """The objects of all places, None for those without; where a mesh for a copy was made, it gets its place."""
        images = [place.image for place in self.target.layout.places]
        new = [isinstance(one, MadeMesh) for one in there]
        taken = [one for one, image, is_new in zip(there, images, new, strict=True) if is_new and image in paths]
        drop_meshes([one for one, is_new in zip(there, new, strict=True) if is_new and one not in taken])
        copies = dict(zip(map(id, taken), place_copies(taken), strict=True))
        return [copies.get(id(one)) if is_new else one for one, is_new in zip(there, new, strict=True)]

    def _write_images(self, there: list[Any], warnings: list[str]) -> tuple[Written, dict[int, Path]]:
        """Write the images of the places where something is, and their paths."""
        images = sorted({place.image for place, one in zip(self.target.layout.places, there, strict=True) if one})
        if not images:
            raise BakeError(warnings[0])
        written, paths = Written(warnings=warnings), {}
        for image in images:
            of_image = self.target.paths[image]
            try:
                files = self._write_image(of_image, image)
            except (OSError, BakeError) as error:
                what = f"the lightmap of '{self.target.layout.names[image]}'"
                written.failures.append(_not_written(what, of_image[KIND], error))
            else:
                paths[image] = of_image[KIND]
                written.files += files
        if not paths:
            raise BakeError(written.failures[0])
        self._write_preview(written)
        return written, paths

    def _write_preview(self, written: Written) -> None:
        from ...addon.output.lightmap import contact_sheet
        from ...addon.output.png import write_png

        if self.target.preview is None:
            return
        try:
            write_png(self.target.preview, contact_sheet(self.images))
        except (OSError, BakeError) as error:
            written.failures.append(_not_written("the picture of all lightmaps", self.target.preview, error))
        else:
            written.files.append(self.target.preview)

    def _write_image(self, paths: dict[str, Path], image: int) -> list[Path]:
        """Write the files of one lightmap, by what is in them, all or none; returns them."""
        from ...addon.output.lightmap import write_lightmap

        settings, images = self.target.settings, _by_kind(self.finished[image])
        for group, lightmaps in self.apart.items():
            images |= {_of_group(kind, group): of for kind, of in _by_kind(lightmaps.finished[image]).items()}
        with ExitStack() as stack:  # every file is written before the first takes its place
            for kind in images:
                path = paths[kind]
                path.parent.mkdir(parents=True, exist_ok=True)
                check_writable(path)
                temporary, unit = stack.enter_context(atomic_path(path)), kind.startswith("L1")
                write_lightmap(temporary, images[kind], settings.file_format, settings.value_range, unit=unit)
        return [paths[kind] for kind in images]

    @property
    def files(self) -> list[Path]:
        preview, groups = self.target.preview, ("", *self.apart)
        of_images = [of_image.items() for of_image in self.target.paths]
        images = [path for of_image in of_images for kind, path in of_image if kind.partition(".")[2] in groups]
        return images + ([] if preview is None else [preview])

    @property
    def counts(self) -> dict[str, int]:
        texels = sum(height * width for height, width in self.target.layout.sizes)
        counts = {"lightmaps": len(self.finished), "lightmap_texels": texels, "covered_texels": self.n_covered}
        n_copies = sum(one.copy is not None for one in self.target.subjects)
        return counts | ({"baked_copies": n_copies} if n_copies else {})


def _by_kind(finished: "Finished") -> "dict[str, np.ndarray]":
    """The images of one lightmap, by what is in them."""
    from ...addon.output.lightmap import directional_light, encode_directional

    images = {KIND: finished.light}
    if finished.slope is not None:
        images |= encode_directional(*directional_light(finished.light, finished.slope, finished.normal))
    return images


def _not_written(what: str, path: Path, error: Exception) -> str:
    """A sentence about a file that could not be written."""
    cause = error if isinstance(error, OSError) else error.__cause__
    reason = cause.strerror if isinstance(cause, OSError) else str(error)
    return f"{path} cannot be written ({reason}), so {what} is not there or as it was."
