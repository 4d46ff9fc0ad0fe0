"""Time and memory foretold: orders that must hold, and words that promise no more than is known."""

import pytest
from photon_bake.addon.pipeline.estimates import Estimate, Work, estimate, rounded_time
from photon_bake.addon.settings.bake import settings_for

ROOM = Work(n_triangles=10_000, n_receivers=20_000)


def seconds(work=ROOM, quality="medium", n_cores=2, pace=1.0, **changes):
    return estimate(work, settings_for(quality, **changes), n_cores, pace).seconds


def test_more_work_takes_longer():
    assert seconds(quality="draft") < seconds(quality="medium") < seconds(quality="high")
    assert seconds() < seconds(Work(10_000, 2_000_000)) and seconds() < seconds(Work(10_000_000, 20_000))
    assert seconds() < seconds(interpolate=False)
    assert seconds(n_cores=8) == pytest.approx(seconds(n_cores=2) / 4)
    assert seconds(n_cores=8, n_threads=2) == pytest.approx(seconds(n_cores=2))
    assert seconds(pace=3) == pytest.approx(3 * seconds())


@pytest.mark.parametrize(
    ("work", "quality", "measured"),
    [
        (Work(30, n_receivers=21_600), "medium", 4.3),  # docs/measurements.md: solving, on two cores
        (Work(1500, n_receivers=20_512), "medium", 8.3),
        (Work(1500, n_receivers=201_548), "medium", 9.2),
        (Work(104_000, n_receivers=21_279), "medium", 11.2),
        (Work(1500, n_receivers=201_548), "draft", 5.0),
        (Work(30, n_receivers=201_441), "high", 16.5),
    ],
)
def test_bakes_that_it_was_not_fitted_to(work, quality, measured):
    """Within a factor of three, whatever the scene."""
    assert measured / 3 < seconds(work, quality) < 3 * measured


def test_a_time_that_was_asked_for():
    assert seconds(time=60.0) == 60


@pytest.mark.parametrize(
    ("exact", "said"),
    [
        (0.2, "1 s"),
        (4.6, "5 s"),
        (18, "20 s"),
        (52, "45 s"),
        (70, "1 min"),
        (400, "7 min"),
        (4000, "1 h"),
        (4e6, "1111 h"),
    ],
)
def test_times_are_rounded_to_what_is_known(exact, said):
    assert rounded_time(exact) == said


def test_the_line():
    assert Estimate(19, 812).line == "about 20 s, 0.8 GB"
