"""Knobs and presets."""

from dataclasses import fields

import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.settings.bake import CHOICES, BakeSettings, affordable, settings_for


@pytest.mark.parametrize("quality", ["draft", "medium", "high"])
def test_presets_are_in_range(quality):
    assert settings_for(quality).n_photons >= 100_000


def test_medium_is_the_default():
    assert settings_for("medium") == BakeSettings()


def test_changes_go_on_top_of_a_preset():
    assert settings_for("high", seed=3).seed == 3
    assert settings_for("high", n_photons=5000).n_photons == 5000


@pytest.mark.parametrize("change", [{"n_photons": 1}, {"noise": -0.1}, {"noise": float("nan")}, {"seed": -1}])
def test_values_out_of_range_name_the_knob_and_the_range(change):
    with pytest.raises(BakeError, match=f"{next(iter(change))} is .*; choose a value from"):
        settings_for("draft", **change)


def test_unknown_words_name_the_choices():
    with pytest.raises(BakeError, match="final, density"):
        BakeSettings(gather="magic")
    with pytest.raises(BakeError, match="embree, multi_image"):
        BakeSettings(tracer="magic")
    with pytest.raises(BakeError, match="draft, medium, high"):
        settings_for("best")


def test_faces_of_cube_maps_have_a_power_of_two():
    with pytest.raises(BakeError, match="map_size is 100; choose a power of two"):
        BakeSettings(map_size=100)


def test_time_buys_photons_and_elements():
    """They grow with the time there is, up to those of high quality."""
    of_time = [affordable(settings_for("medium", time=seconds), 1e6) for seconds in (1, 10, 1000)]
    assert of_time[0].n_photons == 150_000 and of_time[1].n_photons == 1_500_000
    assert of_time[2].n_photons == settings_for("high").n_photons
    elements = [settings.n_cache_elements for settings in of_time]
    assert elements == sorted(elements) and elements[2] == settings_for("high").n_cache_elements


def test_every_knob_says_what_it_means():
    for knob in fields(BakeSettings):
        assert knob.name in CHOICES or knob.metadata["meaning"], knob.name
