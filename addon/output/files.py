"""Files that are either there whole or not there."""

import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO

from ..errors import BakeError


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to; its file takes `path`'s place if the block ends well, and goes if it does not.

    Where `path` is a link, the file that it leads to is written and the link stays. A file that was there keeps its
    permissions and, where the system lets it, its owner. What is no file, as /dev/stdout or a pipe, is written itself.

    Yields
    ------
    Path
        In the same folder and with the same suffix, so that the move is one step and relative paths stay right.
    """
    if is_device(path):
        yield path
        return
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        _replace(temporary, Path(os.path.realpath(path)))
    finally:
        temporary.unlink(missing_ok=True)


def is_device(path: Path) -> bool:
    """Whether there is something that is neither a file nor a folder."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _replace(temporary: Path, path: Path) -> None:
    """Move a file to a path in one step, with the permissions and the owner of the file that was there."""
    if path.parent.stat().st_dev != temporary.stat().st_dev:  # a link to another disk
        beside = path.with_name(temporary.name)
        try:
            shutil.copyfile(temporary, beside)
            _replace(beside, path)
        finally:
            beside.unlink(missing_ok=True)
        return
    if path.exists():
        before = path.stat()
        if hasattr(os, "chown"):
            with suppress(OSError):  # only root may give files away
                os.chown(temporary, before.st_uid, before.st_gid)
        os.chmod(temporary, stat.S_IMODE(before.st_mode))
    os.replace(temporary, path)


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
    if is_device(path):
        return
    try:
        if path.exists():
            path.open("r+b").close()  # Windows says here that another program has it open
        for folder in {path.parent, Path(os.path.realpath(path)).parent}:  # of a link, and where it leads
            with TemporaryFile(dir=folder):
                pass
    except OSError as error:
        raise BakeError(f"{path} cannot be written ({error.strerror}); choose another place.") from error
