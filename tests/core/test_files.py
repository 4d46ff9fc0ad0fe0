"""Files that take others' places: whole, through links, with the permissions that were there."""

import os
import stat
from pathlib import Path

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.output import atomic_path, check_writable
from photon_bake.addon.output.png import write_png

PICTURE = np.ones((2, 2, 3), np.float32)


@pytest.fixture(autouse=True)
def umask():
    before = os.umask(0o027)
    yield
    os.umask(before)


def mode_of(path):
    return stat.S_IMODE(path.stat().st_mode)


def write(path, text="new"):
    check_writable(path)
    with atomic_path(path) as temporary:
        temporary.write_text(text)


def test_a_new_file_has_the_permissions_that_new_files_have(tmp_path):
    write(tmp_path / "a.txt")
    write_png(tmp_path / "a.png", PICTURE)
    assert mode_of(tmp_path / "a.txt") == mode_of(tmp_path / "a.png") == 0o640


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_file_keeps_its_permissions(tmp_path, mode):
    for path in (tmp_path / "a.txt", tmp_path / "a.png"):
        path.write_text("old")
        path.chmod(mode)
    write(tmp_path / "a.txt")
    write_png(tmp_path / "a.png", PICTURE)
    assert mode_of(tmp_path / "a.txt") == mode_of(tmp_path / "a.png") == mode
    assert (tmp_path / "a.txt").read_text() == "new" and (tmp_path / "a.png").stat().st_size > 10


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may give files away")
def test_a_file_keeps_its_owner(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    os.chown(path, 1234, 2345)
    write(path)
    assert (path.stat().st_uid, path.stat().st_gid) == (1234, 2345)


@pytest.mark.parametrize("there", [True, False])
def test_a_link_stays_and_its_file_is_written(tmp_path, there):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "b.txt", tmp_path / "a.txt"
    if there:
        target.write_text("old")
        target.chmod(0o600)
    (tmp_path / "middle.txt").symlink_to(Path("far") / "b.txt")
    link.symlink_to("middle.txt")
    write(link)
    assert link.is_symlink() and (tmp_path / "middle.txt").is_symlink() and not target.is_symlink()
    assert target.read_text() == "new" and mode_of(target) == (0o600 if there else 0o640)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a.txt", "b.txt", "far", "middle.txt"]


def test_a_link_to_another_disk(tmp_path):
    other = Path("/dev/shm")
    if not os.access(other, os.W_OK) or other.stat().st_dev == tmp_path.stat().st_dev:
        pytest.skip("no other disk")
    target = other / f"photon_bake_{os.getpid()}.txt"
    try:
        target.write_text("old")
        target.chmod(0o604)
        (tmp_path / "a.txt").symlink_to(target)
        write(tmp_path / "a.txt")
        assert target.read_text() == "new" and mode_of(target) == 0o604 and (tmp_path / "a.txt").is_symlink()
        assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
        assert not list(other.glob(f".*{os.getpid()}*"))
    finally:
        target.unlink()


def test_what_fails_leaves_all_as_it_was(tmp_path):
    target, link = tmp_path / "b.txt", tmp_path / "a.txt"
    target.write_text("old")
    link.symlink_to(target)
    with pytest.raises(ZeroDivisionError), atomic_path(link) as temporary:
        temporary.write_text("half")
        raise ZeroDivisionError
    assert target.read_text() == "old" and link.is_symlink() and len(list(tmp_path.iterdir())) == 2


def test_a_link_to_nowhere_is_found_before_the_work(tmp_path):
    link = tmp_path / "a.txt"
    link.symlink_to(tmp_path / "missing" / "b.txt")
    with pytest.raises(BakeError, match="cannot be written"):
        check_writable(link)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX")
def test_a_pipe_stays_one_and_is_written_to(tmp_path):
    """As do devices, which no test should lay hands on."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write(pipe)
        assert os.read(reader, 100) == b"new" and pipe.is_fifo()
    finally:
        os.close(reader)
