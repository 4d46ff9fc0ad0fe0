"""Files of earlier versions: their settings are what they were, in each version of Blender."""

import json

import bpy
import pytest

from .saved_settings import FOLDER, values


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.blend")), ids=lambda file: file.stem)
def test_settings_of_earlier_versions_are_kept(file):
    """Each choice of each list is in one of the scenes; nothing that was saved has its default."""
    expected = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    bpy.ops.wm.open_mainfile(filepath=str(file))
    found = {scene.name: values(scene) for scene in bpy.data.scenes}
    assert found.keys() == expected.keys()
    for scene, before in expected.items():
        assert {name: found[scene].get(name) for name in before} == before


def test_settings_that_came_later_have_their_defaults():
    new = values(bpy.context.scene)
    file = FOLDER / "0.1.0.blend"
    bpy.ops.wm.open_mainfile(filepath=str(file))
    before = json.loads(file.with_suffix(".json").read_text(encoding="utf-8"))
    for scene in bpy.data.scenes:
        later = {name: value for name, value in values(scene).items() if name not in before[scene.name]}
        assert len(later) > 20 and later == {name: new[name] for name in later}
