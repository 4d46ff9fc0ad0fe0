"""Lightmaps of several frames: sequences of images on the UV maps and places of the first frame."""

import os
import shutil
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ....addon.core.errors import BakeError
from ....addon.settings.frames import Frames, frame_label
from ...jobs.written import Written
from ..lightmap import LightmapRequest, Lightmaps, WrittenImages


class LightmapRecording:
    """Lightmaps of frames, whose layout is the first one's."""

    def __init__(self, asked: LightmapRequest, frames: Frames) -> None:
        self._asked, self._frames = asked, frames
        self._first: tuple[Lightmaps, WrittenImages] | None = None

    def request(self, time: float) -> LightmapRequest:
        """See `Recording.request`."""
        layout = self._first[0].target.layout if self._first else None
        preview = self._asked.preview if self._first is None else None
        return replace(self._asked, frame=frame_label(time), layout=layout, preview=preview)

    def add(self, time: float, output: Lightmaps) -> Written:
        """See `Recording.add`."""
        images = output.write_files()
        if self._first is None:
            self._first = replace(output, finished=[], apart=dict.fromkeys(output.apart, output)), images
        elif images.paths.keys() != self._first[1].paths.keys():
            names = output.target.layout.names
            missing = next(iter(self._first[1].paths.keys() ^ images.paths.keys()))
            raise BakeError(f"The lightmap of '{names[missing]}' has no light in all frames: see frame {time:g}.")
        for path in images.written.files if self._frames.gap > 1 else []:
            _hold(path, int(time), min(self._frames.gap, self._frames.last - int(time) + 1))
        return images.written

    def finish(self) -> Written:
        """See `Recording.finish`."""
        assert self._first is not None  # there is at least one frame
        output, images = self._first
        written = Written()
        output.enter(images, written, self._frames)
        return written


def _hold(path: Path, frame: int, n_frames: int) -> None:
    """Let the files of the frames until the next one that is baked be the same as a frame's."""
    stem = path.stem.removesuffix(frame_label(frame))
    for other in range(frame + 1, frame + n_frames):
        link = path.with_name(f"{stem}{frame_label(other)}{path.suffix}")
        link.unlink(missing_ok=True)
        with suppress(OSError):  # a disk without links gets copies
            os.link(path, link)
            continue
        shutil.copyfile(path, link)
