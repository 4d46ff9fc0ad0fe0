"""Several runs of the host tests beside each other: each file is run by the one that comes to it first.

The folder that PHOTON_BAKE_CLAIMS names is where they say which files they have begun with.
"""

import os
from pathlib import Path

import pytest


class Claims:
    """A plugin of pytest that leaves out the files which another run has begun with."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._ours: dict[Path, bool] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item):
        """Done with a test that is another run's."""
        return None if self._is_ours(item.path) else True

    def _is_ours(self, path):
        """Whether a file is this run's; one that nobody has claimed is from now on."""
        if path not in self._ours:
            try:
                os.close(os.open(self._folder / path.name, os.O_CREAT | os.O_EXCL))
                self._ours[path] = True
            except FileExistsError:
                self._ours[path] = False
        return self._ours[path]
