"""The table of cases: one function a feature, and the fingerprint of the scene that it builds."""

import hashlib
import inspect
import io
import tokenize
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import CodeType

import bpy

from .cycles import set_cycles

SKIPPED = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


GROUPS = ("Lamps", "Emitting surfaces and worlds", "Surfaces", "Volumes", "Textures and colours", "Shapes and objects")
"""In the order of the page."""


@dataclass(frozen=True)
class Case:
    """One feature in one scene.

    Attributes
    ----------
    title, group : str
        What it is called in docs/cases.md, and under which heading.
    build : callable
        Builds the scene, with an object "Probes", into the empty file.
    light_group : str
        Bake this light group alone; empty for all light.
    unsupported : str
        The feature has no support: a warning of the bake has to hold this text. Empty where it is supported.
    differs : str
        What is baked otherwise than Cycles renders it, though supported: the page says how far the light is off.
    effort : int
        How many times the photons and rays of the other cases its bake needs.
    into_image : bool
        Cycles bakes the reference into an image: only then its rays have differentials, without which it sees no bump.
    motion_blur : int
        Steps in which our bake averages light over the shutter; Cycles' are baked at times all over it, since it has
        no motion blur in bakes. 0 without.
    since : tuple of int
        First Blender that has the feature as the reference means it.
    changed : tuple of int
        First Blender in which the feature means something else: those before it have a reference of their own.
    """

    title: str
    group: str
    build: Callable[[], None]
    light_group: str = ""
    unsupported: str = ""
    differs: str = ""
    effort: int = 1
    into_image: bool = False
    motion_blur: int = 0
    since: tuple[int, ...] = (4, 5)
    changed: tuple[int, ...] = ()

    @property
    def name(self) -> str:
        return self.build.__name__

    @property
    def references(self) -> list[str]:
        """The names of its references: that of its last meaning, and where it had another before, of that."""
        return [self.name] + [f"{self.name}_before_{'_'.join(map(str, self.changed))}"] * bool(self.changed)

    @property
    def reference(self) -> str:
        """The name of the one that this Blender is compared with."""
        return self.references[-1] if bpy.app.version < self.changed else self.name

    @property
    def runs_here(self) -> bool:
        return bpy.app.version >= self.since

    def set_scene(self) -> None:
        """Build the case into an empty file."""
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        self.build()
        bpy.context.view_layer.update()

    @property
    def fingerprint(self) -> str:
        """Changes when the code that builds the scene does, or that sets Cycles, whatever its comments say."""
        code = _code_of(self.build) + _code_of(set_cycles) + self.light_group + "shutter" * bool(self.motion_blur)
        return hashlib.sha256(code.encode()).hexdigest()[:16]


CASES: dict[str, Case] = {}


def case(title: str, group: str, **marks: object) -> Callable:
    """Decorator: put a function into the table."""

    def register(build: Callable[[], None]) -> Callable[[], None]:
        assert build.__name__ not in CASES and group in GROUPS, build.__name__
        CASES[build.__name__] = Case(title, group, build, **marks)
        return build

    return register


def _code_of(function: Callable) -> str:
    """The code of a function, and of the functions, classes and constants of this folder that it uses, all the way."""
    found: dict[str, str] = {}
    ahead = [function]
    while ahead:
        part = ahead.pop()
        if part.__qualname__ in found:
            continue
        found[part.__qualname__] = _tokens(inspect.getsource(part))
        for inner in [part] if inspect.isfunction(part) else filter(inspect.isfunction, vars(part).values()):
            for name in _names(inner.__code__):
                value = inner.__globals__.get(name)
                if isinstance(value, int | float | str | tuple | dict):
                    found[name] = repr(value)
                elif getattr(value, "__module__", "").startswith(__package__):
                    ahead.append(value)
    return "".join(name + code for name, code in sorted(found.items()))


def _names(code: CodeType) -> Iterator[str]:
    """Global names and attributes that a function or one inside it reads."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _tokens(source: str) -> str:
    """Source code without comments, blanks and the decorator that names the case."""
    tokens = [t for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.type not in SKIPPED]
    code = "".join(token.string for token in tokens)
    return code[code.index("def") :] if code.startswith("@case") else code
