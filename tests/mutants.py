"""Mutation testing by `make mutants`: small changes to formulas, each of which some test has to notice.

    make mutants                              40 mutants of each group
    make mutants ARGS="bsdf --sample 0"       all mutants of one group
    make mutants ARGS="--seed 1 --show"       another sample; survivors as they read

Cosmic Ray makes the mutants: other operators, comparisons, numbers, conditions and loops. Kernels run as plain Python,
since compiling takes a minute for each mutant; so of a group's tests those run that are quick that way, the quickest
first. A process collects them once, and sees which functions each of them calls. For a mutant it forks, puts the
changed code into the functions that are loaded, and runs the tests that call the changed one. What stands outside of
functions has done its work by then: a change there has a process of its own, which loads everything anew.
"""

import argparse
import ast
import gc
import importlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / "build" / "mutants"
COPY = PLACE / "photon_bake"
FOUND = PLACE / "found.json"
TEST_LIMIT = 0.5
"""Processor seconds that a test may take as plain Python to be among those that are run."""
MUTANT_LIMIT, TIMEOUT, LONGEST = 5, 120, 14400
"""Processor seconds a test and seconds in all after which a mutant counts as killed, and those for all of a group."""
MEMORY = 8 << 30
"""Bytes of address space, beyond which a mutant counts as killed."""
EQUAL = ("RemoveDecorator",)
"""Operators that are left out: as plain Python, functions with and without decorators are the same."""

LOADED = ("numba", "scipy.ndimage", "scipy.sparse.linalg", "scipy.spatial", "scipy.special", "hypothesis", "pytest")
"""What is loaded once, for all processes that are forked."""

GROUPS = {
    "bsdf": ("addon/bsdf addon/bsdf/broad", "values/bsdf test_lobes.py test_mixture.py"),
    "emitters": ("addon/emitters addon/emitters/aiming", "values/emitters test_emission.py test_world.py"),
    "photons": ("addon/photons", "values/photons test_photons.py test_photon_store.py test_region_directed.py"),
    "direct": ("addon/gather/direct", "values/direct test_lamp_choice.py"),
}
"""The rooms of each group, and the tests in tests/core that concern them."""


class Mutant(NamedTuple):
    """A change of a file: the n-th place of an operator, and the function where it is, "" outside of any."""

    path: str
    operator: str
    n: int
    line: int
    function: str

    def source(self) -> str:
        """The file as it was changed."""
        from cosmic_ray.mutating import mutate_code
        from cosmic_ray.plugins import get_operator

        source = (COPY / self.path).read_text(encoding="utf-8")
        return mutate_code(source, get_operator(self.operator)(), self.n) or source

    def __str__(self) -> str:
        old, new = (COPY / self.path).read_text(encoding="utf-8").splitlines(), self.source().splitlines()
        lines = " → ".join(lines[self.line - 1].strip() for lines in (old, new) if self.line <= len(lines))
        return f"{self.path}:{self.line} {self.function}: {lines}"


def mutants_of(path: str) -> list[Mutant]:
    """All changes of a file but those of annotations, which nothing reads."""
    from cosmic_ray.ast import ast_nodes, get_ast_from_path
    from cosmic_ray.plugins import get_operator, operator_names

    tree = get_ast_from_path(COPY / path)
    python = ast.parse((COPY / path).read_text(encoding="utf-8"))
    spans, functions = unread(python), list(bodies(python))
    found = []
    for name in operator_names():
        operator = get_operator(name)
        if operator.arguments() or name.rpartition("/")[2] in EQUAL:
            continue
        places = [place for node in ast_nodes(tree) for place in operator().mutation_positions(node)]
        for n, (start, _end) in enumerate(places):
            if not any(first <= start < last for first, last in spans):
                of = [function for function, first, last in functions if first <= start < last]
                found.append(Mutant(path, name, n, start[0], of[0] if of else ""))
    return found


Place = tuple[int, int]
"""Line and column."""


def span(first: ast.AST, last: ast.AST) -> tuple[Place, Place]:
    """Start and end of nodes."""
    at: Any = first, last
    return (at[0].lineno, at[0].col_offset), (at[1].end_lineno, at[1].end_col_offset)


def unread(tree: ast.AST) -> list[tuple[Place, Place]]:
    """Where annotations stand."""
    nodes: list[ast.expr | None] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            nodes.append(node.returns)
        elif isinstance(node, ast.arg | ast.AnnAssign):
            nodes.append(node.annotation)
    return [span(node, node) for node in nodes if node is not None]


def bodies(tree: Any, within: str = "") -> Iterator[tuple[str, Place, Place]]:
    """Functions of a module and its classes by their qualified names, and where the body of each stands."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield within + node.name, *span(node.body[0], node.body[-1])
        elif isinstance(node, ast.ClassDef):
            yield from bodies(node, f"{within}{node.name}.")


def forked(work: Callable[[], int], timeout: float) -> int | None:
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
        time.sleep(0.005)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def run(tests: str, plugin: Any) -> int:
    """Run tests of the copy in this process."""
    import pytest

    os.chdir(COPY)
    files = [f"tests/core/{name}" for name in tests.split()]
    return int(pytest.main(["-q", "-p", "no:cacheprovider", *files], plugins=[plugin]))


def passes(item: Any, limit: float) -> bool:
    """Whether a test passes in so many processor seconds."""
    from _pytest.runner import runtestprotocol

    def too_slow(*_: Any) -> None:
        raise TimeoutError

    signal.signal(signal.SIGVTALRM, too_slow)
    signal.setitimer(signal.ITIMER_VIRTUAL, limit)
    with warnings.catch_warnings():  # NumPy's of infinities and NaN, which compiled kernels make in silence
        warnings.simplefilter("ignore")
        reports = runtestprotocol(item, log=False, nextitem=None)
    signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    return all(report.passed for report in reports)


class Plain:
    """A plugin of pytest: takes all tests, whatever they are marked with, and runs them in its own way."""

    def pytest_itemcollected(self, item: Any) -> None:
        item.add_marker("plain")


class Wanted(Plain):
    """Runs tests in an order until one fails."""

    def __init__(self, names: list[str]) -> None:
        self.names = names

    def pytest_runtestloop(self, session: Any) -> bool:
        items = {item.nodeid: item for item in session.items}
        if not all(name in items and passes(items[name], MUTANT_LIMIT) for name in self.names):
            os._exit(1)
        return True


class Hunt(Plain):
    """Runs, for each mutant inside of functions, the quick tests that call the changed one; writes `FOUND`."""

    def __init__(self, mutants: list[Mutant]) -> None:
        self.mutants = mutants

    def pytest_runtestloop(self, session: Any) -> bool:
        calls, items = quick_tests(session.items), {item.nodeid: item for item in session.items}
        functions = [each for each in gc.get_objects() if isinstance(each, FunctionType)]
        loaded = [each for each in functions if each.__code__.co_filename.startswith(str(COPY))]
        killed, callers = [], []
        for mutant in self.mutants:
            tests = [items[name] for name, called in calls.items() if f"{mutant.path}:{mutant.function}" in called]
            killed.append(forked(lambda m=mutant, t=tests: judged(m, loaded, t), TIMEOUT) != 0)
            callers.append(len(tests))
        FOUND.write_text(json.dumps([list(calls), killed, callers]))
        return True


def judged(mutant: Mutant, loaded: list[FunctionType], tests: list[Any]) -> int:
    """Whether a test fails once a mutant's code is that of the functions that are loaded."""
    file = str(COPY / mutant.path)
    changed = {code.co_qualname: code for code in codes(compile(mutant.source(), file, "exec"))}
    for function in loaded:
        old = function.__code__
        new = changed.get(old.co_qualname, old) if old.co_filename == file else old
        if new.co_freevars == old.co_freevars:
            function.__code__ = new
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    return int(not all(passes(item, MUTANT_LIMIT) for item in tests))


def codes(code: CodeType) -> Iterator[CodeType]:
    """The code of all functions within some code."""
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from codes(constant)


def quick_tests(items: list[Any]) -> dict[str, set[str]]:
    """Tests that pass within the limit, the quickest first, and the functions that each calls.

    Where a test was too slow with some parameters, others are not tried.
    """
    seconds, calls, slow = dict[str, float](), dict[str, set[str]](), set[str]()
    for item in items:
        name, function = item.nodeid, item.nodeid.partition("[")[0]
        if function in slow or forked(lambda item=item: timed(item), TIMEOUT) != 0:
            slow.add(function)
            continue
        seconds[name] = json.loads(FOUND.read_text())
        if forked(lambda item=item: watched(item), TIMEOUT) == 0:
            calls[name] = set(json.loads(FOUND.read_text()))
    return {name: calls[name] for name in sorted(calls, key=lambda name: seconds[name])}


def timed(item: Any) -> int:
    """0 if a test passes within the limit; writes its processor seconds to `FOUND`."""
    start = time.process_time()
    passed = passes(item, TEST_LIMIT)
    FOUND.write_text(json.dumps(time.process_time() - start))
    return int(not passed)


def watched(item: Any) -> int:
    """0 if a test passes; writes to `FOUND` which functions of the copy it calls."""
    called = set[CodeType]()

    def profile(frame: Any, event: str, _: Any) -> None:
        if event == "call":
            called.add(frame.f_code)

    threading.setprofile(profile)
    sys.setprofile(profile)
    passed = passes(item, MUTANT_LIMIT)
    sys.setprofile(None)
    ours = [code for code in called if code.co_filename.startswith(str(COPY))]
    FOUND.write_text(json.dumps([f"{Path(code.co_filename).relative_to(COPY)}:{code.co_qualname}" for code in ours]))
    return int(not passed)


def is_noticed(mutant: Mutant, tests: str, quick: list[str]) -> bool:
    """Whether a test notices a change outside of functions."""
    file = COPY / mutant.path
    source = file.read_text(encoding="utf-8")
    file.write_text(mutant.source(), encoding="utf-8")
    try:
        return forked(lambda: run(tests, Wanted(quick)), TIMEOUT) != 0
    finally:
        file.write_text(source, encoding="utf-8")


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
        hunt(group, options)
    return 0


def hunt(group: str, options: argparse.Namespace) -> None:
    """Make mutants of a group, and print how many are killed."""
    rooms, tests = GROUPS[group]
    paths = sorted(str(path.relative_to(COPY)) for room in rooms.split() for path in (COPY / room).glob("*.py"))
    every = [mutant for path in paths for mutant in mutants_of(path)]
    some = sorted(random.Random(options.seed).sample(every, min(options.sample, len(every)) or len(every)))
    within = [mutant for mutant in some if mutant.function]
    if forked(lambda: run(tests, Hunt(within)), LONGEST) != 0:
        sys.exit(f"The tests of {group} could not be run.")
    quick, killed, callers = json.loads(FOUND.read_text())
    print(f"{group}: {len(some)} of {len(every)} mutants, by {len(quick)} tests", flush=True)
    survivors = [
        (mutant, "" if n else " (no test calls it)")
        for mutant, dead, n in zip(within, killed, callers, strict=True)
        if not dead
    ]
    outside = [mutant for mutant in some if not mutant.function]
    survivors += [(mutant, "") for mutant in outside if not is_noticed(mutant, tests, quick)]
    for mutant, why in survivors if options.show else []:
        print(f"  {mutant}{why}", flush=True)
    n_killed = len(some) - len(survivors)
    print(f"{group}: {n_killed} of {len(some)} killed, {n_killed / len(some):.0%}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
