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


def test_a_platform_without_wheels_is_told_which_there_are(monkeypatch):
    monkeypatch.setattr(zips, "this_platform", lambda: "macos-x64")
    assert zips.remedy().endswith("for macos-x64; Photon Bake runs on linux-x64, windows-x64, macos-arm64.")
