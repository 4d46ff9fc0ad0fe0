"""Which zip a Blender needs is said where it has got another one."""

import sys

import pytest
from photon_bake.addon.core import zips
from photon_bake.addon.core.errors import BakeError


@pytest.mark.parametrize(
    ("python", "says"),
    [
        ((3, 11), "install photon_bake-<version>-blender4.5-windows-x64.zip."),
        ((3, 14), "install photon_bake-<version>-blender5.2-debian-windows-x64.zip."),
        ((3, 12), "there is no Photon Bake for a Blender with Python 3.12."),
    ],
)
def test_without_its_wheels_the_right_zip_is_named(python, says, monkeypatch):
    zips.check_zip()
    monkeypatch.setattr(sys, "version_info", python)
    monkeypatch.setattr(zips, "this_platform", lambda: "windows-x64")
    monkeypatch.setattr(zips.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(BakeError) as error:
        zips.check_zip()
    assert str(error.value).endswith(says)


def test_a_library_that_is_missing_or_broken_is_named_with_the_remedy(monkeypatch):
    assert not zips.missing_library()
    zips.check_libraries()
    monkeypatch.setitem(zips.LIBRARIES, "no_such_library", "no_such_library")
    expected = "no_such_library, which every bake needs, cannot be imported ({}): remove Photon Bake, restart Blender"
    assert zips.missing_library().startswith(expected.format("it is not installed"))
    with pytest.raises(BakeError) as error:
        zips.check_libraries()
    assert str(error.value).startswith(expected.format("No module named 'no_such_library'"))


def test_a_platform_without_wheels_is_told_which_there_are(monkeypatch):
    monkeypatch.setattr(zips, "this_platform", lambda: "macos-x64")
    assert zips.remedy().endswith("for macos-x64; Photon Bake runs on linux-x64, windows-x64, macos-arm64.")
