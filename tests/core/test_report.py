import json

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.output import Report, atomic_path, check_writable, peak_memory_mb


def test_a_report_keeps_numbers_of_numpy(tmp_path):
    report = Report(status="done", counts={"photons": np.int64(7)}, relative_noise=np.float32(0.25), objects=["Wand Ω"])
    report.write(tmp_path / "r.json")
    read = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert read["status"] == "done" and read["counts"] == {"photons": 7} and read["relative_noise"] == 0.25
    assert read["objects"] == ["Wand Ω"]


def test_a_report_that_fails_leaves_the_one_before(tmp_path):
    path = tmp_path / "r.json"
    Report(message="first").write(path)
    with pytest.raises(ValueError):
        Report(relative_noise=float("nan")).write(path)
    assert json.loads(path.read_text())["message"] == "first"
    assert [p.name for p in tmp_path.iterdir()] == ["r.json"]


def test_atomic_path_replaces_only_when_the_block_ends_well(tmp_path):
    path = tmp_path / "scene.blend"
    path.write_text("old")
    with pytest.raises(RuntimeError), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    with atomic_path(path) as temporary:
        assert temporary.parent == tmp_path and temporary.suffix == ".blend"
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new" and len(list(tmp_path.iterdir())) == 1


def test_what_cannot_be_written_is_found_before(tmp_path):
    check_writable(tmp_path / "new.json")
    assert not list(tmp_path.iterdir())
    with pytest.raises(BakeError, match="folder"):
        check_writable(tmp_path)
    with pytest.raises(BakeError, match="cannot be written"):
        check_writable(tmp_path / "missing" / "r.json")
    (tmp_path / "file").touch()
    with pytest.raises(BakeError, match="cannot be written"):
        check_writable(tmp_path / "file" / "r.json")


def test_peak_memory_sees_what_was_held():
    before = peak_memory_mb()
    assert before is not None and 5 < before < 1e5
    np.ones(40_000_000 + int(before * 1e6 / 8))
    assert peak_memory_mb() > before + 200
