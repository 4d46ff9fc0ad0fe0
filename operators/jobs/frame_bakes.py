"""Bakes of several frames: a job for each, whose light recordings take, and the .blend file at the end."""

from collections.abc import Sequence
from functools import partial

import bpy

from ...addon.blender.read.as_read import edit_mode_left
from ...addon.core.errors import BakeError
from ...addon.core.progress import Progress
from ...addon.settings.frames import Frames
from ..targets.recordings import Recording
from ..targets.target import Request, Solved
from .bake_job import BakeJob
from .written import Written


class FrameBakes:
    """The bakes of some frames of the current scene.

    Parameters
    ----------
    frames : Frames
    recordings : sequence of Recording
        One a target.

    Attributes
    ----------
    scene : bpy.types.Scene
    before : Solved or None
        The light of the frame that was taken last.
    n_repeated : int
        Frames in which nothing had changed, so that the light is that of the frame before.
    """

    def __init__(self, frames: Frames, recordings: Sequence[Recording]) -> None:
        self.frames, self._recordings = frames, recordings
        self.scene = bpy.context.scene
        self._at_first = self.scene.frame_current, self.scene.frame_subframe
        self.before: Solved | None = None
        self.n_repeated = 0

    def go_to(self, time: float) -> None:
        """Show a frame, also where it is shown already: what has keys may have been changed since."""
        self.scene.frame_set(int(time // 1), subframe=time % 1)

    def go_back(self) -> None:
        """Show the frame that was shown before."""
        frame, subframe = self._at_first
        if (self.scene.frame_current, self.scene.frame_subframe) != self._at_first:
            self.scene.frame_set(frame, subframe=subframe)

    def requests(self, time: float) -> list[Request]:
        """What is asked for in a frame."""
        return [one.request(time) for one in self._recordings]

    def take(self, time: float, job: BakeJob, solved: Solved, progress: Progress) -> Written:
        """Write the files of a frame, and keep the rest of its light; for the main thread.

        Raises
        ------
        BakeError
            If nothing of it can be written, or what takes light is not what it was in the frames before.
        """
        self.n_repeated += self.before is not None and solved.content == self.before.content != b""
        self.before = solved
        outputs = zip(self._recordings, solved.outputs, strict=True)
        return job.write(solved, progress, [partial(one.add, time, output) for one, output in outputs])

    def finish(self) -> Written:
        """Put what plays the light back into the .blend file; for the main thread."""
        written = Written()
        with edit_mode_left():
            for one in self._recordings:
                try:
                    written.add(one.finish())
                except BakeError as error:
                    written.failures.append(str(error))
        return written


def check_frames(frames: Frames, targets: Sequence[str], copies: bool) -> None:
    """See that targets can have several frames, and these ones.

    Raises
    ------
    BakeError
        If not, in a sentence.
    """
    if copies and {"vertex", "lightmap"} & set(targets):
        raise BakeError("Copies have the light of one frame: bake frames without Bake Copies (--copies).")
    others = [target for target in targets if target != "vertex"]
    if not frames.whole and others:
        raise BakeError("Subframes are for vertices alone: images are numbered by whole frames, so give a whole step.")
