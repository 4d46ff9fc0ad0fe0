"""The panel's settings: the engine's knobs, their choices and the numbers of these in files."""

from dataclasses import fields

import pytest
from photon_bake.addon.core.parameters import meaning_of
from photon_bake.addon.settings.bake import CHOICES, BakeSettings, settings_for
from photon_bake.addon.ui import properties
from photon_bake.addon.ui.properties.scene import CHOICE_NUMBERS


def test_properties_are_the_engines_knobs(empty_scene):
    properties = empty_scene.photon_bake
    assert properties.settings() == BakeSettings()
    for knob in fields(BakeSettings):
        shown = properties.bl_rna.properties[knob.name]
        assert shown.default == knob.default
        if "low" in knob.metadata:
            assert (shown.hard_min, shown.hard_max) == (knob.metadata["low"], knob.metadata["high"])
            assert shown.description == meaning_of(knob)


@pytest.mark.parametrize("knob", CHOICES)
def test_choices_have_names_and_say_what_they_are(empty_scene, knob):
    items = empty_scene.photon_bake.bl_rna.properties[knob].enum_items
    assert tuple(items.keys()) == CHOICES[knob]
    assert all(item.name != item.identifier and item.description for item in items)


def enums_of(group, path=""):
    """The enum properties of a group and of the groups in it, by path."""
    found = {}
    for name, prop in group.bl_rna.properties.items():
        if prop.type == "ENUM":
            found[path + name] = prop
        elif prop.type == "POINTER" and name in {"lightmap", "camera", "probes", "frames"}:
            found |= enums_of(getattr(group, name), f"{path}{name}.")
    return found


def test_choices_keep_their_numbers(empty_scene):
    """What files were saved with, whatever choices come or go and in which order they are shown."""
    numbers = {
        path: {item.identifier: item.value for item in prop.enum_items}
        for path, prop in enums_of(empty_scene.photon_bake).items()
    }
    assert numbers == {
        "quality": {"draft": 0, "medium": 1, "high": 2, "custom": 3},
        "targets": {"vertex": 1, "lightmap": 2, "camera": 4, "probes": 8},
        "gather": {"final": 0, "density": 1, "light_volume": 2, "photon_volumes": 3},
        "tracer": {"embree": 0, "multi_image": 1},
        "lightmap.atlas": {"per_object": 0, "shared": 1, "auto": 2},
        "lightmap.file_format": {"exr_half": 0, "exr_float": 1, "hdr": 2, "rgbm": 3, "rgbd": 4},
        "lightmap.denoiser": {"auto": 0, "oidn": 1, "own": 2, "none": 3},
        "camera.pass_denoiser": {"auto": 0, "oidn": 1, "none": 2},
        "camera.precision": {"half": 0, "float": 1},
        "camera.compression": {"none": 0, "rle": 1, "zips": 2, "zip": 3, "piz": 4, "dwaa": 5, "dwab": 6},
        "probes.harmonics": {"l1": 0, "l2": 1},
        "probes.axes": {"blender": 0, "gltf": 1},
        "frames.keeping": {"texture": 0, "attributes": 1},
        "light_groups": {"together": 0, "one": 1, "apart": 2},
    }
    assert all(len(set(of_choice.values())) == len(of_choice) for of_choice in numbers.values())
    of_knobs = {path.rpartition(".")[2]: of_choice for path, of_choice in numbers.items()}
    assert {name: of_knobs[name] for name in CHOICE_NUMBERS} == CHOICE_NUMBERS


def test_numbers_do_not_follow_the_order_of_choices(monkeypatch):
    monkeypatch.setitem(CHOICES, "gather", CHOICES["gather"][::-1])
    knob = next(knob for knob in fields(BakeSettings) if knob.name == "gather")
    items = properties._property(BakeSettings, knob).keywords["items"]
    assert {item[0]: item[-1] for item in items} == CHOICE_NUMBERS["gather"]


@pytest.mark.parametrize("quality", ["draft", "medium", "high"])
def test_quality_is_what_the_knobs_say(empty_scene, quality):
    properties = empty_scene.photon_bake
    properties.seed = 5
    properties.quality = quality
    assert properties.settings() == settings_for(quality, seed=5) and properties.quality == quality
    properties.n_photons += 1
    assert properties.quality == "custom"
