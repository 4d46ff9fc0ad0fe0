"""Kernels are kept on disk under a digest of their sources, in a folder that may be missing or full of old ones."""

import os
import subprocess
import sys
from pathlib import Path
from time import time

import pytest
from photon_bake.addon.core import compiling

SOURCE = """
import sys
import numpy as np
from photon_bake.addon.core.compiling import kernel, part, seconds_compiled

@part
def doubled(x):
    return x + x

@kernel
def double_all(values, out):
    for i in range(len(values)):
        out[i] = doubled(values[i])

if __name__ == "__main__":
    assert "numba" not in sys.modules
    out = np.zeros(3, np.float32)
    double_all(np.arange(3, dtype=np.float32), out)
    assert out.tolist() == [0, 2, 4]
    print(seconds_compiled())
"""


TUPLES = """
from typing import NamedTuple
import numpy as np
from photon_bake.addon.core.compiling import by_reference, kernel, routine

@by_reference
class Inner(NamedTuple):
    values: np.ndarray
    scale: np.float32

@by_reference
class Outer(NamedTuple):
    inner: Inner
    corner: tuple
    rows: np.ndarray
    yes: bool

@routine
def scaled(inner, i):
    return inner.values[i] * inner.scale

@kernel
def fill(outer, out):
    for i in range(len(out)):
        outer.rows[i, 1] = scaled(outer.inner, i) + outer.corner[2]
        out[i] = outer.rows[i, 1] if outer.yes else np.float32(0)

if __name__ == "__main__":
    for scale, yes in ((2, True), (3, True), (3, False)):
        inner = Inner(np.arange(4, dtype=np.float32), np.float32(scale))
        outer = Outer(inner, (np.float32(0), np.float32(0), np.float32(5)), np.zeros((4, 2), np.float32), yes)
        out = np.empty(4, np.float32)
        fill(outer, out)
        expected = scale * np.arange(4) + 5
        assert out.tolist() == (expected * yes).tolist()
        assert outer.rows[:, 1].tolist() == expected.tolist()
    kinds = getattr(fill, "dispatcher", None)
    assert kinds is None or len(kinds.signatures) == 1
"""


@pytest.fixture
def seconds(tmp_path):
    """Run a kernel in a process of its own, which keeps kernels in a folder; returns the seconds that it compiled."""
    module = tmp_path / "doubling.py"
    module.write_text(SOURCE)

    def run(folder):
        environment = {**os.environ, "PHOTON_BAKE_KERNELS": str(folder), "NUMBA_DISABLE_JIT": "0"}
        done = subprocess.run([sys.executable, module], env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return float(done.stdout)

    return run


def test_a_kernel_is_compiled_once(seconds, tmp_path):
    folder = tmp_path / "kernels"
    assert seconds(folder) > 0
    assert len(list(folder.iterdir())) == 1
    assert seconds(folder) == 0


@pytest.mark.parametrize("disabled", ["0", "1"])
def test_a_tuple_by_reference_has_its_members(tmp_path, disabled):
    """Also in a process that takes the kernel from disk."""
    module = tmp_path / "tuples.py"
    module.write_text(TUPLES)
    environment = {**os.environ, "PHOTON_BAKE_KERNELS": str(tmp_path / "kernels"), "NUMBA_DISABLE_JIT": disabled}
    for _ in range(2):
        done = subprocess.run([sys.executable, module], env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr


def test_without_a_folder_kernels_are_compiled_anew(seconds, tmp_path):
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    assert seconds(nowhere / "kernels") > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["doubling.py", "file"]


def test_the_folder_is_the_variables_or_the_extensions_or_the_users(tmp_path, monkeypatch):
    monkeypatch.setattr(compiling, "_chosen", None)
    monkeypatch.setenv("PHOTON_BAKE_KERNELS", str(tmp_path / "named"))
    compiling.keep_in(tmp_path / "extension")
    assert compiling.kept_in() == tmp_path / "named"
    monkeypatch.delenv("PHOTON_BAKE_KERNELS")
    assert compiling.kept_in() == tmp_path / "extension"
    compiling.keep_in(None)
    monkeypatch.setenv("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME", "")
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    assert compiling.kept_in().is_relative_to(tmp_path)

    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert compiling.kept_in() is None


def test_the_digest_is_of_the_file_and_all_that_it_imports():
    core = compiling.ROOT / "addon" / "core"
    numbers = core / "sampling" / "path_numbers.py"
    assert compiling._sources(numbers) == {numbers, core / "compiling.py"}
    assert core / "compiling.py" in compiling._sources(Path(__file__))  # tests' kernels are made of parts too
    assert compiling.digest_of(core / "vec3.py") != compiling.digest_of(core / "sampling" / "path_numbers.py")
    assert compiling.digest_of_all([core / "vec3.py"]) == compiling.digest_of_all([core / "vec3.py"])


def test_numbas_settings_are_in_the_digest(monkeypatch):
    file = compiling.ROOT / "addon" / "core" / "vec3.py"
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "0")
    without = compiling.digest_of_all([file])
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert compiling.digest_of_all([file]) != without


def test_what_nothing_has_used_is_removed(tmp_path):
    long_ago = time() - (compiling.KEPT_DAYS + 1) * 86400
    for name, used in (("old", long_ago), ("new", time())):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "kernel.nbc").write_text("")
        os.utime(folder, (used, used))
    compiling.remove_unused(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["new"]
