"""Compares this version's bakes with an old commit's: seconds, error and memory, and the seconds of a cold start.

    make bench ARGS="--only versions --against COMMIT [--warm] [--scene NAME…] [--receivers N] [--quality Q]
                     [--rounds N]"

Both versions bake in one run, each in a process of its own, in turns, so that whatever else the machine does falls on
both. A first bake of each is not counted, since it compiles what there is to compile. Seconds and errors are means over
the rounds, each of which has a seed of its own. The cold start, which `--warm` leaves out, is a draft of the demo scene
by the command line with an empty folder of kernels, and once more.
"""

import json
import os
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
import photon_bake
from figures import ROOT, table
from own_scenes import OWN_SCENES

WORKER = Path(__file__).with_name("version_worker.py")
HEAD = ["Scene", "Quality", "Receivers", "Old, s", "New, s", "Times faster", "Old error", "New error"]
HEAD += ["Times faster at equal error", "Old, MB more", "New, MB more"]
COLD_HEAD = ["Version", "First bake, s", "Of them compiling", "Second bake, s"]


def add_options(parser):
    """Options that choose what is measured, beside those of the part speed."""
    of_versions = parser.add_argument_group("of the part versions")
    of_versions.add_argument("--against", metavar="COMMIT", help="the old version")
    of_versions.add_argument("--rounds", type=int, default=3, help="how often each version bakes")
    of_versions.add_argument("--warm", action="store_true", help="without cold starts")


@dataclass(frozen=True)
class Version:
    """A checkout, and the environment in which Python finds it as the package photon_bake."""

    folder: Path
    environment: dict[str, str]

    @staticmethod
    def of(folder, packages):
        """Of a checkout that Python finds in a folder of packages."""
        return Version(folder, {**os.environ, "PYTHONPATH": str(packages)})

    @contextmanager
    def worker(self, name, path, n):
        """A process with a scene open; a call of it bakes at a quality with a seed, and returns what it measured."""
        command = [sys.executable, str(WORKER), str(self.folder), name, str(path or ""), str(n)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        with subprocess.Popen(command, env=self.environment, stderr=subprocess.DEVNULL, **pipes) as process:

            def answer(start):
                for line in process.stdout:
                    if line.startswith(start):
                        return line
                raise SystemExit(f"The version in {self.folder} could not bake {name}.")

            def bake(quality, seed):
                process.stdin.write(f"{quality} {seed}\n")
                process.stdin.flush()
                return json.loads(answer("{"))

            answer("READY")
            yield bake
            process.stdin.close()

    def cold_start(self, blend, scratch):
        """Cells of `COLD_HEAD` after the first: seconds of a first bake, and of a second."""
        kernels = scratch / f"kernels_{self.folder.name}"
        command = [sys.executable, str(self.folder / "tools/blender_stand_in.py"), "-b", str(blend)]
        command += ["-c", "photon_bake", "--quality", "draft", "--report", str(scratch / "report.json")]
        seconds, compiling = [], []
        for _ in range(2):
            started = perf_counter()
            environment = {**self.environment, "PHOTON_BAKE_KERNELS": str(kernels)}
            subprocess.run(command, env=environment, check=True, stderr=subprocess.DEVNULL)
            seconds.append(f"{perf_counter() - started:.1f}")
            compiling.append(f"{json.loads((scratch / 'report.json').read_text()).get('compile_seconds', 0.0):.1f}")
        return [seconds[0], compiling[0], seconds[1]]


@contextmanager
def both(commit):
    """The old version and this one, in a temporary folder that has the old one's checkout."""
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", str(scratch / "old"), commit], check=True)
        try:
            packages = scratch / "packages"
            packages.mkdir()
            (packages / "photon_bake").symlink_to(scratch / "old")
            # This version's kernels are known by the place that it is found in
            new = Version.of(ROOT, Path(photon_bake.__path__[0]).parent)
            yield Version.of(scratch / "old", packages), new, scratch
        finally:
            subprocess.run([*git, "remove", "--force", str(scratch / "old")], check=True)


def row(versions, name, path, n, quality, rounds):
    """Cells of `HEAD`."""
    old, new = versions
    with old.worker(name, path, n) as bake_old, new.worker(name, path, n) as bake_new:
        bake_old(quality, 0), bake_new(quality, 0)
        bakes = [(bake_old(quality, seed), bake_new(quality, seed)) for seed in range(rounds)]
    seconds, errors = ([[of[key] for of in pair] for pair in bakes] for key in ("seconds", "rmse"))
    memory = [max((pair[i]["memory"] or 0) for pair in bakes) for i in (0, 1)]
    (old_s, new_s), (old_error, new_error) = np.mean(seconds, axis=0), np.sqrt(np.mean(np.square(errors), axis=0))
    gain = old_s / new_s
    cells = [
        name,
        quality,
        f"{n:,}",
        f"{old_s:.1f}",
        f"{new_s:.1f}",
        f"{gain:.2f}",
        f"{old_error:.2%}",
        f"{new_error:.2%}",
    ]
    cells += [f"{gain * (old_error / new_error) ** 2:.2f}", *(f"{size:,.0f}" for size in memory)]
    print(*cells, flush=True)
    return cells, gain


def cold_starts(old, new, scratch):
    """The table of both versions' first bakes."""
    blend = scratch / "demo.blend"
    build = [sys.executable, ROOT / "tools/demo_scene.py", "build", blend]
    subprocess.run(build, check=True, stdout=subprocess.DEVNULL)
    cold = [[name, *version.cold_start(blend, scratch)] for name, version in (("old", old), ("new", new))]
    return [table("Cold start: a draft of the demo scene", COLD_HEAD, cold)]


def tables(scenes, options):
    """Markdown tables."""
    if not options.against:
        raise SystemExit("Which version is the old one? Name a commit: --only versions --against COMMIT.")
    paths = {**scenes, **dict.fromkeys(OWN_SCENES)}
    with both(options.against) as (old, new, scratch):
        wanted = [
            (name, n, quality)
            for name in options.scene or paths
            for n in options.receivers or [200_000]
            for quality in options.quality or ["medium"]
        ]
        found = [row((old, new), name, paths[name], n, quality, options.rounds) for name, n, quality in wanted]
        cold = [] if options.warm else cold_starts(old, new, scratch)
    gains = [gain for _, gain in found]
    text = f"Times faster: median {np.median(gains):.2f}, least {min(gains):.2f}.\n"
    rows = [cells for cells, _ in found]
    head = f"This version against {options.against}"
    return [table(head, HEAD, rows), text, *cold]
