"""What the system lacks is installed by root on Debian, and else named in one line."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "system_packages.sh"

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the libraries are those of Linux")


@pytest.fixture
def system(tmp_path):
    """Run the script on a system without libX11, as a user of some number, with an apt-get that ends as it is told."""

    def run(user, apt="exit 0", quiet=""):
        commands = {
            "id": f"echo {user}",
            "apt-get": f'echo "$@" >>{tmp_path}/apt; {apt}',
            "python": "printf ' libx11-6'",
        }
        for name, body in commands.items():
            (tmp_path / name).write_text(f"#!/bin/sh\n{body}\n")
            (tmp_path / name).chmod(0o755)
        environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "QUIET": quiet}
        done = subprocess.run(["sh", SCRIPT, "python"], env=environment, capture_output=True, text=True)
        asked = (tmp_path / "apt").read_text().splitlines() if (tmp_path / "apt").exists() else []
        assert done.stdout == ""
        return done.returncode, done.stderr.splitlines(), asked

    return run


INSTALL = "install -y --no-install-recommends libx11-6"


def test_root_gets_it_installed(system):
    assert system(0) == (0, ["Installing with apt: libx11-6"], ["update", INSTALL])


def test_it_is_silent_if_asked(system):
    assert system(0, quiet="s") == (0, [], ["update", INSTALL])


def test_others_get_the_line(system):
    status, said, asked = system(1000)
    assert status == 1 and len(said) == 1 and asked == []
    assert said[0].endswith(f"as root, on Debian: apt-get update && apt-get {INSTALL}")


def test_what_apt_said_is_shown_where_it_failed(system):
    status, said, _ = system(0, apt="echo no network; exit 100")
    assert status == 1 and said[1] == "no network" and INSTALL in said[-1]


def test_nothing_happens_where_nothing_is_missing():
    done = subprocess.run(["sh", SCRIPT, sys.executable], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
