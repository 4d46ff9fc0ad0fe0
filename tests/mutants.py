"""Mutation testing by `make mutants`: small changes to formulas, each of which some test has to notice.

    make mutants                              40 mutants of each group
    make mutants ARGS="bsdf --sample 0"       all mutants of one group
    make mutants ARGS="--seed 1 --show"       another sample; survivors as they read

Cosmic Ray makes the mutants: other operators, comparisons, numbers, conditions and loops. Kernels run as plain Python,
since compiling takes a minute for each mutant; so of a group's tests those run that are quick that way. They
run in processes forked from one that has NumPy and SciPy loaded, the quickest test first.
"""

import argparse
import ast
import importlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / "build" / "mutants"
COPY = PLACE / "photon_bake"
TEST_LIMIT = 0.5
"""Processor seconds that a test may take as plain Python to be among those that are run."""
TIMEOUT, LONGEST = 120, 3600
"""Seconds after which a mutant counts as killed, and those that the unchanged code may take."""
EQUAL = ("RemoveDecorator",)
"""Operators that are left out: as plain Python, functions with and without decorators are the same."""

LOADED = ("numba", "scipy.ndimage", "scipy.sparse.linalg", "scipy.spatial", "scipy.special", "hypothesis", "pytest")
"""What is loaded once, for all processes that are forked."""

GROUPS: dict[str, tuple[list[str], list[str]]] = {
    "bsdf": (
        ["addon/bsdf/*.py", "addon/bsdf/broad/*.py"],
        ["lobes", "mixture", "broad_lobes", "closure_normals", "albedo_tables", "light_balance"],
    ),
    "emitters": (
        ["addon/emitters/*.py", "addon/emitters/aiming/*.py"],
        ["emission", "lamp_hits", "direct_light", "aiming", "world", "integrating_sphere"],
    ),
    "photons": (
        ["addon/photons/*.py"],
        ["photons", "photon_store", "guiding", "bounce_map", "region_directed", "emission", "light_balance"],
    ),
    "direct": (["addon/gather/direct/*.py"], ["lamp_choice", "direct_light", "lamp_hits", "world"]),
}
"""Files of each group, and the tests in tests/core that concern them."""


class Mutant(NamedTuple):
    """A change of a file: the n-th place of an operator."""

    path: str
    operator: str
    n: int
    line: int


class Chosen:
    """A plugin of pytest: the tests that are quick enough, whatever they are marked with, the quickest first."""

    def __init__(self, wanted: list[str] | None = None) -> None:
        self.wanted, self.seconds = wanted, dict[str, float]()

    def pytest_itemcollected(self, item: Any) -> None:
        item.add_marker("plain")

    def pytest_collection_finish(self, session: Any) -> None:
        if self.wanted is not None:
            of = {item.nodeid: item for item in session.items}
            session.items[:] = [of[name] for name in self.wanted if name in of]

    def pytest_runtest_setup(self, item: Any) -> None:
        if self.wanted is None:
            signal.setitimer(signal.ITIMER_VIRTUAL, TEST_LIMIT)

    def pytest_runtest_teardown(self, item: Any) -> None:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.when == "call" and report.passed:
            self.seconds[report.nodeid] = report.duration


def mutants_of(path: str) -> list[Mutant]:
    """All changes of a file but those of annotations, which nothing reads."""
    from cosmic_ray.ast import ast_nodes, get_ast_from_path
    from cosmic_ray.plugins import get_operator, operator_names

    tree = get_ast_from_path(COPY / path)
    spans = unread(ast.parse((COPY / path).read_text(encoding="utf-8")))
    found = []
    for name in operator_names():
        operator = get_operator(name)
        if operator.arguments() or name.rpartition("/")[2] in EQUAL:
            continue
        places = [place for node in ast_nodes(tree) for place in operator().mutation_positions(node)]
        for n, (start, _end) in enumerate(places):
            if not any(first <= start < last for first, last in spans):
                found.append(Mutant(path, name, n, start[0]))
    return found


def unread(tree: ast.AST) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Where annotations stand, as (line, column) of start and end."""
    nodes: list[ast.expr | None] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            nodes.append(node.returns)
        elif isinstance(node, ast.arg | ast.AnnAssign):
            nodes.append(node.annotation)
    return [((n.lineno, n.col_offset), (n.end_lineno or 0, n.end_col_offset or 0)) for n in nodes if n is not None]


def forked(work: Any, timeout: float) -> int | None:
    """What a function returns in a process of its own, where its output is lost; None if it took too long."""
    child = os.fork()
    if child == 0:
        quiet = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(quiet, stream)
        status = 1
        try:
            status = int(work())
        finally:
            os._exit(status)
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.02)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def run(names: list[str], plugin: Chosen, *options: str) -> int:
    """Run tests of the copy in this process."""
    import pytest

    os.chdir(COPY)
    files = [file for name in names if (file := f"tests/core/test_{name}.py") and Path(file).exists()]
    return int(pytest.main(["-q", "-p", "no:cacheprovider", *options, *files], plugins=[plugin]))


def too_slow(*_: Any) -> None:
    raise TimeoutError


def quick_tests(names: list[str]) -> list[str]:
    """Those that pass as plain Python within the limits, the quickest first."""
    told = PLACE / "quick.json"
    told.unlink(missing_ok=True)

    def work() -> int:
        signal.signal(signal.SIGVTALRM, too_slow)
        plugin = Chosen()
        run(names, plugin)
        told.write_text(json.dumps(plugin.seconds))
        return 0

    forked(work, LONGEST)
    seconds = json.loads(told.read_text())
    return sorted(seconds, key=lambda name: seconds[name])


def is_killed(mutant: Mutant, names: list[str], quick: list[str]) -> tuple[bool, str]:
    """Whether a test notices a change; and the line as it was changed."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    file = COPY / mutant.path
    source = file.read_text(encoding="utf-8")
    changed = mutate_code(source, get_operator(mutant.operator)(), mutant.n) or source
    lines = changed.splitlines()
    file.write_text(changed, encoding="utf-8")
    try:
        status = forked(lambda: run(names, Chosen(quick), "-x"), TIMEOUT)
    finally:
        file.write_text(source, encoding="utf-8")
    return status != 0, lines[mutant.line - 1].strip() if mutant.line <= len(lines) else ""


def copy_checkout() -> None:
    """A copy whose files are changed, without anything compiled."""
    shutil.rmtree(PLACE, ignore_errors=True)
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in listed.stdout.splitlines():
        if (ROOT / name).is_file() and name.endswith((".py", ".toml", ".npz", ".npy", ".json", ".md")):
            (COPY / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, COPY / name)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=f"of {', '.join(GROUPS)}; all without one")
    parser.add_argument("--sample", type=int, default=40, help="mutants of each group; 0 for all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--show", action="store_true", help="print survivors as they read")
    options = parser.parse_args()
    copy_checkout()
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    sys.dont_write_bytecode = True
    sys.path[:0] = [str(PLACE)]
    for name in LOADED:
        importlib.import_module(name)
    for group in options.groups or GROUPS:
        patterns, names = GROUPS[group]
        paths = sorted(str(path.relative_to(COPY)) for pattern in patterns for path in COPY.glob(pattern))
        every = [mutant for path in paths for mutant in mutants_of(path)]
        some = sorted(random.Random(options.seed).sample(every, min(options.sample, len(every)) or len(every)))
        quick = quick_tests(names)
        print(f"{group}: {len(some)} of {len(every)} mutants, by {len(quick)} tests", flush=True)
        killed = 0
        for mutant in some:
            noticed, line = is_killed(mutant, names, quick)
            killed += noticed
            if not noticed and options.show:
                print(f"  {mutant.path}:{mutant.line} {mutant.operator.rpartition('/')[2]}: {line}", flush=True)
        print(f"{group}: {killed} of {len(some)} killed, {killed / len(some):.0%}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
