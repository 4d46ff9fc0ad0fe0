"""Files that are either there whole or not there."""

import os
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO

from ..core.errors import BakeError

_FORBIDDEN = str.maketrans(dict.fromkeys('<>:"/\\|?*', "_"))


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
    ending = f".{os.getpid()}{path.suffix}"
    room = longest_name(path.parent) - len(os.fsencode(f".{ending}")) - 1  # Blender itself saves to one byte more
    temporary = path.with_name(f".{os.fsencode(path.stem)[:room].decode(errors='ignore')}{ending}")
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
        If `path` is a folder, may not be written or is in use, its name is too long, or its folder is missing or takes
        no files.
    """
    longest = longest_name(path.parent)
    if len(os.fsencode(path.name)) > longest:
        raise BakeError(
            f"The file name {path.name} is too long for its folder, which takes {longest} bytes: shorten it."
        )
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


def check_place(path: Path) -> None:
    """The same for a file whose folder may not be there yet."""
    there = existing_folder(path.parent)
    if there == path.parent:
        check_writable(path)
        return
    longest = longest_name(there)
    for name in path.relative_to(there).parts:
        if len(os.fsencode(name)) > longest:
            raise BakeError(
                f"The file name {name} is too long for its folder, which takes {longest} bytes: shorten it."
            )
    check_writable(there / path.relative_to(there).parts[0])


def file_name(name: str) -> str:
    """A name for a file: what no file name may hold, on any system, becomes an underscore."""
    return name.translate(_FORBIDDEN)


def existing_folder(folder: Path) -> Path:
    """A folder, or the nearest one above it that is there."""
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    return folder


def longest_name(folder: Path) -> int:
    """Bytes that a file's name may have in a folder."""
    try:
        return os.pathconf(existing_folder(folder), "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):  # not on Windows, whose names have 255 characters
        return 255


def check_space(sizes: Mapping[Path, int]) -> None:
    """Find out before the work whether disks have room for files of some sizes, bytes, beside what is there now.

    Raises
    ------
    BakeError
        If one has not.
    """
    of_disk: dict[int, tuple[Path, int]] = {}
    for path, size in sizes.items():
        folder = existing_folder(path.parent)
        disk = folder.stat().st_dev
        first, total = of_disk.get(disk, (folder, 0))
        of_disk[disk] = first, total + size
    for folder, needed in of_disk.values():
        free = shutil.disk_usage(folder).free
        if free < needed:
            raise BakeError(
                f"The disk of {folder} has {free / 1e6:,.0f} MB free, and up to {needed / 1e6:,.0f} MB would be "
                "written: make room, or choose another place."
            )
