"""Files of each frame alone: a camera's pass, probes."""

from dataclasses import replace
from typing import Any

from ....addon.settings.frames import frame_label
from ...jobs.written import Written
from ..probes import ProbeRequest
from ..target import Request


class FileRecording:
    """Outputs that are files and nothing else; those of probes get the frame's number in their names."""

    def __init__(self, asked: Request) -> None:
        self._asked = asked

    def request(self, time: float) -> Request:
        """See `Recording.request`."""
        if isinstance(self._asked, ProbeRequest):
            return replace(self._asked, scene=f"{self._asked.scene}_{frame_label(time)}")
        return self._asked

    def add(self, time: float, output: Any) -> Written:
        """See `Recording.add`."""
        return output.write()

    def finish(self) -> Written:
        """See `Recording.finish`: nothing."""
        return Written()
