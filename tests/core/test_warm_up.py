"""Kernels are compiled ahead by a process, which a bake waits for; afterwards nothing is left to compile."""

from pathlib import Path
from time import perf_counter, sleep

import pytest
from photon_bake.addon.core import compiling
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.pipeline.warm_up import COMPILING, ahead
from photon_bake.addon.pipeline.warm_up.tiny_bakes import tiny_bakes
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, receivers_in_box, scene_of

SLOW = "import time\nprint('done 0.5', flush=True)\ntime.sleep({seconds})\nprint('done 1.0', flush=True)\n"
AND_ALL = SLOW + "print('all kernels', flush=True)"

needs_jit = pytest.mark.skipif(not compiling.jit(), reason="nothing is compiled")


@pytest.fixture
def compiler(tmp_path, monkeypatch):
    """A compiler with an empty folder, whose process is a script; call it with the script's text."""
    monkeypatch.setenv("PHOTON_BAKE_KERNELS", str(tmp_path / "kernels"))
    compiling.folder_of.cache_clear()
    script, made = tmp_path / "script.py", []

    def make(text):
        script.write_text(text)
        monkeypatch.setattr(ahead, "_SCRIPT", script)
        made.append(ahead.Compiler())
        return made[-1]

    yield make
    for one in made:
        one.stop()
    compiling.folder_of.cache_clear()


@needs_jit
def test_a_bake_waits_and_says_so_once(compiler):
    said, first = [], compiler(AND_ALL.format(seconds=0.3))
    first.wait(Progress(lambda stage, fraction: said.append((stage, fraction))))
    assert {stage for stage, _ in said} == {COMPILING} and (COMPILING, 0.5) in said
    assert first.seconds >= 0.3
    first._process.wait(10)
    said.clear()
    second = compiler(SLOW.format(seconds=9))
    second.wait(Progress(lambda stage, fraction: said.append(stage)))
    assert not said and not second.complaint and not second.running


@needs_jit
def test_no_bake_waits_for_the_kernels_of_live_light(compiler):
    compiler(SLOW.format(seconds=0) + "time.sleep(60)").wait(Progress())
    said, second = [], compiler(SLOW.format(seconds=60))
    second.wait(Progress(lambda stage, fraction: said.append(stage)))
    assert not said and second.running


@needs_jit
def test_a_waiting_bake_is_cancelled_and_the_process_ended(compiler):
    one = compiler(SLOW.format(seconds=60))
    one.start()
    progress = Progress()
    progress.cancel()
    started = perf_counter()
    with pytest.raises(Cancelled):
        one.wait(progress)
    assert one.running
    one.stop()
    assert not one.running and perf_counter() - started < 1


@needs_jit
def test_the_process_ends_with_its_parent(compiler, monkeypatch):
    """Whose end closes the pipe to it."""
    script = Path(ahead.__file__).with_name("process.py")
    waiting = "from time import sleep\n_import_as = lambda *_: sleep(60)"
    one = compiler(script.read_text().replace("\n\nif __name__", f"\n\n{waiting}\nif __name__"))
    one.start()
    one._process.stdin.close()
    one._process.wait(10)


@needs_jit
def test_what_is_wrong_with_a_library_is_said(compiler, tmp_path, monkeypatch):
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "numba.py").write_text("raise ImportError('Numba needs NumPy 2.5 or less. Got NumPy 9.9.')")
    monkeypatch.syspath_prepend(str(broken))
    one = compiler(Path(ahead.__file__).with_name("process.py").read_text())
    one.start()
    while one.running:
        sleep(0.05)
    assert one.complaint.startswith(
        "numba, which every bake needs, cannot be imported (Numba needs NumPy 2.5 or less. Got NumPy 9.9): "
    )


@needs_jit
def test_without_a_folder_there_is_no_process(compiler, tmp_path, monkeypatch):
    (tmp_path / "kernels").write_text("")
    one = compiler(SLOW.format(seconds=60))
    one.start()
    assert not one.running


_QUICK = {4, 5}  # of the tiny bakes: the density estimate, and the light volume


@pytest.mark.plain
@pytest.mark.parametrize(
    "number",
    [pytest.param(i, marks=() if i in _QUICK else pytest.mark.minutes) for i in range(len(tiny_bakes()))],
)
def test_every_stage_bakes(number):
    """As machine code, as plain Python, and with indices checked: see tests/core/conftest.py."""
    tiny_bakes()[number]()


@needs_jit
def test_after_tiny_bakes_other_bakes_compile_nothing():
    """The test before this has run them."""
    for tiny in tiny_bakes():
        tiny()
    before = compiling.seconds_compiled()
    scene = scene_of(*box(), albedo=0.5, emission=1.0)
    for gather in ("final", "density", "light_volume"):
        settings = settings_for("draft", n_photons=2000, n_gather_rays=8, n_cache_elements=200, gather=gather)
        bake(scene, receivers_in_box(20), settings, EmbreeTracer(scene))
    assert compiling.seconds_compiled() == before
