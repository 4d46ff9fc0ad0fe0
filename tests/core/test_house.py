"""The house's rules: ranks of imports, docstrings of rooms, one version."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# Low to high; a file imports only from its own rank or lower.
RANKS = [
    ["addon.core"],
    ["addon.settings"],
    ["addon.scene"],
    ["addon.bsdf"],
    ["addon.emitters"],
    ["addon.tracing"],
    ["addon.photons"],
    ["addon.receivers"],
    ["addon.gather"],
    ["addon.output"],
    ["addon.pipeline"],
    ["addon.blender"],
    ["addon.ui"],
    ["operators"],
    [""],  # the root
]
RANK = {room: rank for rank, rooms in enumerate(RANKS) for room in rooms}

FILES = sorted(
    path.relative_to(ROOT)
    for path in [ROOT / "__init__.py", *ROOT.glob("addon/**/*.py"), *ROOT.glob("operators/**/*.py")]
)
ROOMS = sorted({path.parent for path in FILES})


def module_name(path: Path) -> str:
    """addon/scene/lights.py is `addon.scene.lights`; a package's __init__.py is the package; the root is ``""``."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def room_of(module: str) -> str:
    parts = module.split(".")
    return ".".join(parts[:2]) if parts[0] == "addon" else parts[0]


def imports(path: Path, source: str) -> list[tuple[int, str]]:
    """(line, module inside the extension) for every relative import, those inside functions too."""
    package = list(path.parent.parts)
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.ImportFrom) or not node.level:
            continue
        base = package[: len(package) - (node.level - 1)]
        assert len(package) >= node.level - 1, f"{path}:{node.lineno} imports from outside the extension"
        base += node.module.split(".") if node.module else []
        for alias in node.names:  # a module, or a name inside the module `base`
            target = [*base, alias.name]
            is_module = ROOT.joinpath(*target).with_suffix(".py").exists() or ROOT.joinpath(*target).is_dir()
            found.append((node.lineno, ".".join(target if is_module else base)))
    return found


def complaints(path: Path, source: str) -> list[str]:
    room = room_of(module_name(path))
    if room == "addon":  # addon/__init__.py is below every room
        return [f"{path}:{line}: addon/__init__.py imports nothing" for line, _ in imports(path, source)]
    if room not in RANK:
        return [f"{path}: the room {room} has no rank: give it one in {Path(__file__).name} and in addon/__init__.py"]
    said = []
    for line, target in imports(path, source):
        other = room_of(target)
        if other == "addon":
            said.append(f"{path}:{line}: import the room itself, as in `from .addon.scene import Scene`")
        elif other not in RANK:
            said.append(f"{path}:{line}: the room {other} has no rank: give it one in {Path(__file__).name}")
        elif RANK[other] > RANK[room]:
            said.append(f"{path}:{line}: {room or 'the root'} may not import {other or 'the root'}, a higher rank")
    return said


@pytest.mark.parametrize("path", FILES, ids=str)
def test_imports_only_from_its_rank_or_lower(path):
    said = complaints(path, (ROOT / path).read_text(encoding="utf-8"))
    assert not said, "\n".join(said)


@pytest.mark.parametrize("path", FILES, ids=str)
def test_imports_inside_the_extension_are_relative(path):
    own = {"photon_bake", "bl_ext", "addon", "operators"}
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [node.module or ""]
        for name in names:
            assert name.partition(".")[0] not in own, (
                f"{path}:{node.lineno}: `{name}` must be a relative import: "
                "installed, the package is called bl_ext.<repository>.photon_bake"
            )


@pytest.mark.parametrize(
    "source",
    [
        "from ..gather import Irradiance",
        "from ..pipeline.bake import bake",
        "from .. import pipeline",
        "def late():\n    from ...operators import bake_indirect",
        "from ... import register",
        "from ..attic import thing",
    ],
)
def test_a_forbidden_import_is_found(source):
    assert complaints(Path("addon/scene/example.py"), source)


@pytest.mark.parametrize(
    "source", ["from ..core.errors import BakeError", "from .lights import Lights", "import numpy"]
)
def test_an_allowed_import_is_not(source):
    assert not complaints(Path("addon/scene/example.py"), source)


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room) if room.parts else "root")
def test_every_room_says_what_it_is(room):
    init = ROOT / room / "__init__.py"
    assert init.exists(), f"{room} holds Python files and no __init__.py"
    assert ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))), f"{room}/__init__.py has no docstring"


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: str(room) if room.parts else "root")
def test_a_room_has_a_dozen_files_at_most(room):
    files = [path.name for path in FILES if path.parent == room and path.name != "__init__.py"]
    assert len(files) <= 12, f"{room} has {len(files)} files beside each other: give them rooms"


def is_compiled(function):
    """Whether a function is a kernel or what kernels call, by its decorator."""
    names = [node.id for node in function.decorator_list if isinstance(node, ast.Name)]
    return bool({"kernel", "part", "routine"} & set(names))


def without_annotations(tree):
    """(line, name) of functions that lack annotations and are no kernels or parts."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and not is_compiled(node):
            arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
            bare = [one.arg for one in arguments if one.annotation is None and one.arg not in ("self", "cls")]
            if bare or (node.returns is None and (arguments[1:] or node.name != "__init__")):
                yield node.lineno, node.name


@pytest.mark.parametrize("path", FILES, ids=str)
def test_functions_without_annotations_are_kernels_or_parts(path):
    found = list(without_annotations(ast.parse((ROOT / path).read_text(encoding="utf-8"))))
    assert not found, f"{path}: these need annotations, or a decorator: {found}"


def test_a_function_without_annotations_is_found():
    source = "def bare(x): ...\n@kernel\ndef fast(x): ...\n@part\ndef dot(x): ...\nclass A:\n    def b(self): ...\n"
    assert [name for _, name in without_annotations(ast.parse(source))] == ["bare", "b"]


def long_functions(tree):
    """(line, name) of functions that do not fit on a screen, their docstrings apart."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            doc = node.body[0] if ast.get_docstring(node) is not None else None
            lines = node.end_lineno - node.lineno + 1 - (doc.end_lineno - doc.lineno + 1 if doc else 0)
            if lines > 60:
                yield node.lineno, node.name


@pytest.mark.parametrize("path", FILES, ids=str)
def test_a_function_fits_on_a_screen(path):
    found = list(long_functions(ast.parse((ROOT / path).read_text(encoding="utf-8"))))
    assert not found, f"{path}: these have more than 60 lines beside their docstrings, split them by step: {found}"


def test_a_long_function_is_found():
    doc, lines = '    """A\n    B"""\n', "    x = 1\n"
    source = f"def fits():\n{doc}{59 * lines}\ndef long():\n{doc}{60 * lines}"
    assert [name for _, name in long_functions(ast.parse(source))] == ["long"]


def test_every_file_of_the_zip_serves_the_extension():
    """What only tests and benches use does not ship: each file is reached by imports from the root.

    Or from what compiles kernels, a process of its own that finds its work by name.
    """
    warm_up = Path("addon/pipeline/warm_up")
    reached, waiting = set(), [Path("__init__.py"), warm_up / "process.py", warm_up / "tiny_bakes.py"]
    while waiting:
        path = waiting.pop()
        if path in reached:
            continue
        reached.add(path)
        for _, module in imports(path, (ROOT / path).read_text(encoding="utf-8")):
            base = Path(*module.split("."))
            waiting += [one for one in (base.with_suffix(".py"), base / "__init__.py") if (ROOT / one).is_file()]
    unused = [str(path) for path in FILES if path not in reached and path.name != "__init__.py"]
    assert not unused, f"nothing of the extension imports {', '.join(unused)}"


def manifest():
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def test_the_version_is_the_changelogs_newest():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## \[?v?(\d+\.\d+\.\d+)", changelog, re.MULTILINE)
    assert newest, "CHANGELOG.md has no heading like `## 0.1.0`"
    assert manifest()["version"] == newest[1], "blender_manifest.toml and CHANGELOG.md name different versions"


def test_the_extension_asks_for_files_only():
    assert set(manifest()["permissions"]) == {"files"}
    assert manifest()["license"] == ["SPDX:GPL-3.0-or-later"]


def test_the_committed_manifest_names_no_wheels():
    assert not {"wheels", "platforms"} & set(manifest()), "wheels and platforms are tools/build_zip.py's to add"


DOCS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
LINK = re.compile(r"\[`?([^\]`]+)`?\]\(([^)#]+\.py)\)((?:,?\s`[A-Za-z_.]+`)*)")


def defined_in(source):
    """Names that a file defines or imports, those inside its classes too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.alias):
            yield node.asname or node.name


def names_linked(text):
    """(path, name) of what Markdown links to by a name of code: `[evaluate](glossy.py)`, or beside the link.

    English words are not told from names without an underscore or a capital inside.
    """
    for words, path, beside in LINK.findall(text):
        code = [word for word in re.split(r", ?", words) if re.fullmatch(r"[\w.]*([a-z][A-Z]|\w_|_\w)[\w.]*", word)]
        for name in code + re.findall(r"`([^`]+)`", beside):
            if name not in (Path(path).name, Path(path).stem, Path(path).parent.name):
                yield path, name


@pytest.mark.parametrize("path", DOCS, ids=lambda path: path.name)
def test_names_that_docs_link_to_are_in_the_files(path):
    missing = []
    for target, name in names_linked(path.read_text(encoding="utf-8")):
        file = path.parent / target
        if not file.is_file() or not set(name.split(".")) <= set(defined_in(file.read_text(encoding="utf-8"))):
            missing.append(f"{name} in {target}")
    assert not missing, f"{path.name} names what is not there: {', '.join(missing)}"


def test_names_that_docs_link_to_are_found():
    text = "[a_b](x/y.py) [Word](x/y.py) [y](x/y.py) `f`, `G.h` and `k`, [y_z.py](y_z.py) [Ab.cD, e_f](z.py)"
    assert [name for _, name in names_linked(text)] == ["a_b", "f", "G.h", "Ab.cD", "e_f"]
