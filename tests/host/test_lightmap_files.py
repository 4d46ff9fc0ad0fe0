"""Files of lightmaps where disks are full, folders may not be written, or names cannot be."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress

import bpy
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import VertexRequest

from .lightmap_scenes import QUICK, add_room, bake, prepare, state
from .scenes import add_cube, add_plane

COMMAND = ["--quality", "draft", "--photons", "5000", "--target", "lightmap", "--density", "4"]


@pytest.fixture(autouse=True)
def room(empty_scene):
    add_room()


def full_disk(monkeypatch, of):
    """A disk that has no room for files whose name has some word in it."""

    def replace(source, target, real=os.replace):
        if of in str(target):
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr("photon_bake.addon.output.files.os.replace", replace)


def test_a_full_disk_leaves_the_old_images(tmp_path, monkeypatch):
    bake(tmp_path)
    old = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    job = prepare(tmp_path, density=8.0)
    solved, before = job.solve(QUICK, Progress()), state()
    full_disk(monkeypatch, "indirect")
    with pytest.raises(BakeError, match="No space left") as error:
        job.write(solved, Progress())
    assert "\n" not in str(error.value) and state() == before
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 1 MB, where the system lets us make one."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("mounting is root's")
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", disk], capture_output=True).returncode:
        pytest.skip("this system mounts nothing")
    yield disk
    subprocess.run(["umount", disk], check=True)


def fill(disk):
    """Leave no room."""
    with suppress(OSError), (disk / "rest").open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def test_a_disk_that_fills_up_during_the_bake_loses_no_more_than_it_must(small_disk):
    bake(small_disk)
    old = (small_disk / "scene_Floor_indirect.exr").read_bytes()
    wanted = [LightmapRequest(LightmapSettings(density=8.0), small_disk, "scene"), VertexRequest()]
    job = BakeJob.prepare(bpy.context, wanted, Progress())
    job.check_space()
    solved = job.solve(QUICK, Progress())
    fill(small_disk)
    (failure,) = job.write(solved, Progress()).failures
    assert "cannot be written (No space left on device)" in failure
    assert "Indirect" in bpy.data.objects["Floor"].data.attributes
    assert (small_disk / "scene_Floor_indirect.exr").read_bytes() == old
    assert sorted(path.name for path in small_disk.iterdir()) == [
        "rest",
        "scene_Box_indirect.exr",
        "scene_Floor_indirect.exr",
    ]
    with pytest.raises(BakeError, match="make room"):
        job.check_space()


def test_a_file_is_saved_elsewhere_where_its_disk_is_full(small_disk, capfd):
    fill(small_disk)
    (small_disk / "rest").rename(small_disk / "x.blend")  # there is room for a name
    assert run(["--quality", "draft", "--photons", "5000", "--save", str(small_disk / "x.blend")]) == 1
    said = capfd.readouterr().err
    (kept,) = re.findall(r"could not be saved .*; the baked file is (.*): move it\.", said)
    bpy.ops.wm.open_mainfile(filepath=kept)
    assert "Indirect" in bpy.data.objects["Floor"].data.attributes
    shutil.rmtree(os.path.dirname(kept))


def test_what_a_full_disk_has_room_for_is_written(tmp_path, monkeypatch):
    job = prepare(tmp_path, density=4.0)
    solved = job.solve(QUICK, Progress())
    full_disk(monkeypatch, "Floor")
    written = job.write(solved, Progress())
    assert [path.name for path in written.files] == ["scene_Box_indirect.exr"]
    (failure,) = written.failures
    assert f"{tmp_path / 'scene_Floor_indirect.exr'} cannot be written (No space left on device)" in failure
    assert "lightmap_image" in bpy.data.objects["Box"] and "lightmap_image" not in bpy.data.objects["Floor"]
    assert [path.name for path in tmp_path.iterdir()] == ["scene_Box_indirect.exr"]


def test_an_image_open_elsewhere_stays_as_it_was(tmp_path, monkeypatch):
    """Windows refuses to open such a file for writing."""
    bake(tmp_path)
    old = (tmp_path / "scene_Floor_indirect.exr").read_bytes()
    job = prepare(tmp_path, density=8.0)
    solved = job.solve(QUICK, Progress())

    real = type(tmp_path).open

    def in_use(path, mode="r", *rest):
        if mode == "r+b" and "Floor" in path.name:
            raise PermissionError(13, "The file is being used by another process")
        return real(path, mode, *rest)

    monkeypatch.setattr(type(tmp_path), "open", in_use)
    (failure,) = job.write(solved, Progress()).failures
    monkeypatch.undo()
    assert "scene_Floor_indirect.exr cannot be written (The file is being used" in failure
    assert (tmp_path / "scene_Floor_indirect.exr").read_bytes() == old


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_found_before_the_bake(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(BakeError, match="cannot be written"):
        prepare(tmp_path)


def test_a_read_only_disk_leaves_the_old_images(tmp_path, monkeypatch):
    """Whether it is so before the bake or becomes so while it runs, as a server's folder may; root meets it too."""

    def read_only(**_):
        raise OSError(30, "Read-only file system")

    bake(tmp_path)
    old = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    job = prepare(tmp_path, density=8.0)
    solved, before = job.solve(QUICK, Progress()), state()
    monkeypatch.setattr("photon_bake.addon.output.files.TemporaryFile", read_only)
    for attempt in (lambda: prepare(tmp_path), lambda: job.write(solved, Progress())):
        with pytest.raises(BakeError, match=r"scene_\w+_indirect.exr cannot be written \(Read-only file system\)"):
            attempt()
    assert state() == before and {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old


def test_places_that_take_no_files_are_found_before_the_bake(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is a file; give a folder"):
        prepare(tmp_path / "file")
    with pytest.raises(BakeError, match="cannot be written"):
        prepare(tmp_path / "file" / "below")
    (tmp_path / "scene_Box_indirect.exr").mkdir()
    with pytest.raises(BakeError, match="is a folder"):
        prepare(tmp_path)


def test_names_that_would_be_one_file_are_found(tmp_path):
    add_cube("A/B").location.x = 5
    add_cube("A:B").location.x = -5
    with pytest.raises(BakeError, match="rename one"):
        prepare(tmp_path)


def test_a_name_that_is_too_long_is_found_before_the_bake(tmp_path):
    bpy.data.objects["Box"].name = "B" * 63
    job = prepare(tmp_path / ("d" * 200), density=4.0)
    job.write(job.solve(QUICK, Progress()), Progress())
    wanted = LightmapRequest(LightmapSettings(density=4.0), tmp_path, "s" * 180)
    with pytest.raises(BakeError, match=r"too long for its folder, which takes 255 bytes: shorten it\."):
        BakeJob.prepare(bpy.context, [wanted], Progress())


def test_too_little_room_is_found_before_the_bake(tmp_path, monkeypatch):
    job = prepare(tmp_path, density=4.0)
    job.check_space()
    usage = shutil.disk_usage(tmp_path)._replace(free=1000)
    monkeypatch.setattr("photon_bake.addon.output.files.shutil.disk_usage", lambda _: usage)
    with pytest.raises(BakeError, match=r"has 0 MB free, and up to .* MB would be written: make room"):
        job.check_space()


def test_names_that_collide_are_both_named(tmp_path):
    add_plane("A/b")
    add_plane("A:b")
    with pytest.raises(BakeError, match=r"objects 'A.b' and 'A.b' differ only in signs"):
        prepare(tmp_path)
