"""Light on vertices in several frames: images that a modifier plays back, or an attribute a frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ....addon.blender.paths import from_blend_file
from ....addon.blender.playback import Track, add_playback
from ....addon.blender.read.as_read import still_there
from ....addon.blender.read.lamps.light_layers import attribute_of
from ....addon.blender.write.color_attribute import MAX_NAME_BYTES, write_color_attribute
from ....addon.core.errors import BakeError
from ....addon.core.findings import counted
from ....addon.output import file_name
from ....addon.output.vertex_animation import AnimationLayout, write_vertex_animation
from ....addon.receivers import AttributeTarget, Receivers
from ....addon.receivers.receivers import Domain
from ....addon.settings.frames import Frames, Keeping, frame_label
from ...jobs.folders import check_folder, make_folder
from ...jobs.written import Written
from ..vertices import VertexLight, VertexRequest


@dataclass(frozen=True)
class _Frame:
    """E/π of each target's elements, (e, 3) float32 each, by attribute; and their domains."""

    light: dict[str, list[np.ndarray]]
    domains: list[Domain]


class VertexRecording:
    """Light of the vertices of objects in frames.

    Parameters
    ----------
    asked : VertexRequest
    frames : Frames
    keeping : 'texture' or 'attributes'
    folder : Path
        For the images; made where it is missing.
    scene : str
        Name of the scene, for the files' names.
    """

    def __init__(self, asked: VertexRequest, frames: Frames, keeping: Keeping, folder: Path, scene: str) -> None:
        self._asked, self._frames, self._keeping = asked, frames, keeping
        self._folder, self._scene = folder, scene
        self._first: VertexLight | None = None
        self._recorded: list[_Frame] = []
        if keeping == "texture":
            check_folder(folder, "the light of vertices")

    def request(self, time: float) -> VertexRequest:
        """See `Recording.request`."""
        return self._asked

    def add(self, time: float, output: VertexLight) -> Written:
        """See `Recording.add`."""
        if self._first is None:
            self._first = output
            self._check(output)
        targets = output.receivers.targets
        names, first = [one.object_name for one in targets], [one.object_name for one in self._first.receivers.targets]
        if names != first:
            name = next(iter(dict.fromkeys([*first, *names]).keys() - (set(first) & set(names))), first[0])
            raise BakeError(
                f"Object '{name}' does not take light in all frames, as frame {time:g} shows: keep what its modifiers "
                "make alike, or leave it out (Selected Only, --objects)."
            )
        light = {name: [one.values(colors) for one in targets] for name, colors in _colors_of(output).items()}
        self._recorded.append(_Frame(light, [one.domain for one in targets]))
        return Written()

    def finish(self) -> Written:
        """See `Recording.finish`."""
        assert self._first is not None  # there is at least one frame
        first, target = self._first, self._first.target
        written = Written()
        written.warnings += self._write_attributes()
        objects, gone = still_there(target.meanwhile)
        written.warnings += gone
        what = f"{len(self._frames)} frames of {target.attribute}"
        written.places.append(f"{what} on {counted(len(target.object_names), 'object')}")
        if self._keeping == "texture":
            make_folder(self._folder)
            for i, obj in enumerate(objects):
                if obj is not None:
                    self._play(obj, i, first.receivers.targets[i].object_name, written)
        return written

    def _check(self, output: VertexLight) -> None:
        """See before other frames are baked that there can be as many."""
        for target in output.receivers.targets:
            if self._keeping == "texture":
                AnimationLayout(target.n_elements, len(self._frames)).check(target.object_name)
        label = frame_label(self._frames.times[-1])
        if self._keeping == "attributes" and len(f"{self._asked.attribute}.{label}".encode()) > MAX_NAME_BYTES:
            raise BakeError(f"'{self._asked.attribute}.{label}' is too long for an attribute: choose a shorter name.")

    def _write_attributes(self) -> list[str]:
        """Write the attribute with the light of the scene's frame, and those of all frames if they are asked for."""
        first = self._first
        assert first is not None
        shown = self._frames.nearest(bpy.context.scene.frame_current_final)
        labels = [frame_label(time) for time in self._frames.times]
        order = [*range(len(self._recorded)), shown] if self._keeping == "attributes" else [shown]
        warnings: list[str] = []
        for place, i in enumerate(order):
            frame, ending = self._recorded[i], f".{labels[i]}" if place < len(order) - 1 else ""
            for name, of_targets in frame.light.items():
                elements = _as_receivers(first.receivers.targets, of_targets, frame.domains)
                light = np.pi * np.concatenate(of_targets)
                warnings += write_color_attribute(light, elements, f"{name}{ending}", first.target.meanwhile)
        return list(dict.fromkeys(warnings))

    def _play(self, obj: "bpy.types.Object", i: int, name: str, written: Written) -> None:
        """Write an object's images, and let it play them back."""
        corners = any(one.domains[i] == "CORNER" for one in self._recorded)
        tracks = []
        for attribute in self._recorded[0].light:
            light = np.stack([_on_corners(one, attribute, i, obj.data, corners) for one in self._recorded])
            path = self._folder / f"{file_name(f'{self._scene}_{name}_{attribute}')}.exr"
            domain = "CORNER" if corners else "POINT"
            write_vertex_animation(path, light, self._frames.first, self._frames.step, domain)
            written.files.append(path)
            tracks.append(Track(attribute, _image_of(path), AnimationLayout(light.shape[1], light.shape[0])))
        if not obj.is_editable:
            written.warnings.append(
                f"Object '{obj.name}' is linked from another file and takes no modifier: make it local, or play "
                f"{path.name} back by hand."
            )
            return
        add_playback(obj, tracks, self._frames, domain)


def _colors_of(output: VertexLight) -> dict[str, np.ndarray]:
    """E/π at receivers, (n, 3) float32, by the attribute that it is for."""
    name = output.target.attribute
    lights = {attribute_of(name, group): one.irradiance.value for group, one in output.apart.items()}
    lights[name] = output.irradiance.value
    if not all(np.isfinite(value).all() for value in lights.values()):
        raise BakeError("The bake made values that are not finite, so nothing was written: please report this.")
    return {name: np.asarray(value, np.float32) / np.float32(np.pi) for name, value in lights.items()}


def _as_receivers(
    targets: Sequence[AttributeTarget], light: Sequence[np.ndarray], domains: Sequence[Domain]
) -> Receivers:
    """Elements of meshes as receivers of their own light."""
    ends = np.cumsum([len(one) for one in light])
    places = [np.arange(end - len(one), end, dtype=np.int32) for one, end in zip(light, ends, strict=True)]
    own = tuple(
        AttributeTarget(target.object_name, target.mesh_name, domain, place)
        for target, place, domain in zip(targets, places, domains, strict=True)
    )
    nowhere = np.zeros((int(ends[-1]), 3), np.float32)
    return Receivers(nowhere, nowhere, nowhere[:, 0], own)


def _on_corners(frame: _Frame, attribute: str, i: int, mesh: "bpy.types.Mesh", corners: bool) -> np.ndarray:
    """Light (e, 3) of a mesh's vertices, or of its corners, also where it is of vertices."""
    light = frame.light[attribute][i]
    if not corners or frame.domains[i] == "CORNER":
        return light
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    return light[vertex]


def _image_of(path: Path) -> "bpy.types.Image":
    """The image of a file, loaded anew."""
    relative = from_blend_file(path)
    image = next((one for one in bpy.data.images if one.filepath == relative), None)
    if image is None:
        image = bpy.data.images.load(str(path), check_existing=False)
        image.filepath = relative
    image.colorspace_settings.name, image.alpha_mode = "Non-Color", "NONE"
    image.reload()
    return image
