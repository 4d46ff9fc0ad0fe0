"""Files that are either there whole or not there."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO

from ..errors import BakeError


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to; its file takes `path`'s place if the block ends well, and goes if it does not.

    Yields
    ------
    Path
        In the same folder and with the same suffix, so that the move is one step and relative paths stay right.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A binary file to write to, which becomes `path` if the block ends well; if not, `path` stays as it was.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    try:
        with atomic_path(path) as temporary, temporary.open("wb") as file:
            yield file
    except OSError as error:
        raise BakeError(f"{path} cannot be written ({error.strerror}); choose another place.") from error


def check_writable(path: Path) -> None:
    """Find out before the work whether `path` can be written after it.

    Raises
    ------
    BakeError
        If `path` is a folder, may not be written or is in use, or its folder is missing or takes no files.
    """
    if path.is_dir():
        raise BakeError(f"{path} is a folder; give the path of a file.")
    if path.exists() and not os.access(path, os.W_OK):
        raise BakeError(f"{path} is write-protected; choose another file.")
    try:
        if path.exists():
            path.open("r+b").close()  # Windows says here that another program has it open
        with TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise BakeError(f"{path} cannot be written ({error.strerror}); choose another place.") from error
