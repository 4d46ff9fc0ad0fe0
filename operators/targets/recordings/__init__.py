"""Light of several frames, one after another: what is written of each, and what the .blend file gets at the end."""

from collections.abc import Callable
from typing import Any, Protocol

from ....addon.settings.frames import Frames
from ...jobs.written import Written
from ..lightmap import LightmapRequest
from ..target import Request
from ..vertices import VertexRequest
from .files import FileRecording
from .lightmaps import LightmapRecording
from .vertices import VertexRecording


class Recording(Protocol):
    """The light of several frames of one target."""

    def request(self, time: float) -> Request:
        """What is asked for in a frame."""

    def add(self, time: float, output: Any) -> Written:
        """Take a frame's light, and write its files; for the main thread.

        Raises
        ------
        BakeError
            If something takes light in this frame alone, or not in this one, or no file can be written.
        """

    def finish(self) -> Written:
        """Put what plays the light back into the .blend file; for the main thread."""


def recording_of(request: Request, frames: Frames, make_vertices: Callable[[VertexRequest], VertexRecording]) -> Any:
    """The recording of what was asked for, a `Recording`."""
    if isinstance(request, VertexRequest):
        return make_vertices(request)
    if isinstance(request, LightmapRequest):
        return LightmapRecording(request, frames)
    return FileRecording(request)


__all__ = ["FileRecording", "LightmapRecording", "Recording", "VertexRecording", "recording_of"]
