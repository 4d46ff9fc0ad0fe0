"""Shaders of live light, compiled from GLSL files that are put one after the other."""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gpu

from ...core.errors import BakeError

_FOLDER = Path(__file__).parents[3] / "shaders" / "live"


@dataclass(frozen=True)
class Shader:
    """What a shader is made of, and takes.

    Attributes
    ----------
    vertex, fragment : tuple of str
        Names of GLSL files.
    inputs, between : dict of str to str
        Types of what comes with each vertex, and of what goes on to pixels; whole numbers go on as they are.
    constants, textures : dict of str to str
        Types of what `bound` sets.
    """

    vertex: tuple[str, ...]
    fragment: tuple[str, ...]
    inputs: Mapping[str, str]
    between: Mapping[str, str]
    constants: Mapping[str, str]
    textures: Mapping[str, str]

    def compiled(self) -> "Compiled":
        """The shader as the driver has it.

        Raises
        ------
        BakeError
            If it refuses, with what it says.
        """
        info, between = gpu.types.GPUShaderCreateInfo(), gpu.types.GPUStageInterfaceInfo("_".join(self.fragment))
        for name, kind in self.between.items():
            (between.flat if kind == "INT" else between.smooth)(kind, name)
        for slot, (name, kind) in enumerate(self.inputs.items()):
            info.vertex_in(slot, kind, name)
        for name, kind in self.constants.items():
            info.push_constant(kind, name)
        for slot, (name, kind) in enumerate(self.textures.items()):
            info.sampler(slot, kind, name)
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "color")
        info.vertex_source(_text("vert", self.vertex))
        info.fragment_source(_text("frag", self.fragment))
        return Compiled(_created(lambda: gpu.shader.create_from_info(info), self.fragment[-1]), self)


@dataclass(frozen=True)
class Compiled:
    """A shader that can be drawn with."""

    shader: Any
    of: Shader

    def bind(self, constants: Mapping[str, Any], textures: Mapping[str, Any]) -> Any:
        """Set all that it takes, of what may be more; returns what `GPUBatch.draw` takes."""
        self.shader.bind()
        for name, kind in self.of.constants.items():
            with suppress(ValueError):  # what a shader does not need the compiler drops
                (self.shader.uniform_int if kind == "INT" else self.shader.uniform_float)(name, constants[name])
        for name in self.of.textures:
            with suppress(ValueError):
                self.shader.uniform_sampler(name, textures[name])
        return self.shader


def _text(stage: str, names: tuple[str, ...]) -> str:
    """Files one after the other; the last one has the stage in its name."""
    paths = [*(f"{name}.glsl" for name in names[:-1]), f"{names[-1]}.{stage}.glsl"]
    return "\n".join((_FOLDER / path).read_text(encoding="utf-8") for path in paths)


def _created(create: Callable[[], Any], name: str) -> Any:
    """What `create` returns; where it fails it is called once more, to hear what the driver says.

    Blender sends that to the console, and to Python only that there is something.
    """
    with suppress(Exception):
        return create()
    with _overheard() as said:
        try:
            return create()
        except Exception as error:
            said.append(str(error))
    words = " ".join(" ".join(said).split())
    raise BakeError(
        f"The graphics driver does not compile the shader '{name}' of live light, so it stays off; it says: {words}"
    )


@contextmanager
def _overheard() -> Iterator[list[str]]:
    """What goes to the process's output meanwhile; it goes on to the console afterwards."""
    said: list[str] = []
    sys.stdout.flush()
    sys.stderr.flush()
    with tempfile.TemporaryFile() as file:
        kept = {number: os.dup(number) for number in (1, 2)}
        try:
            for number in kept:
                os.dup2(file.fileno(), number)
            yield said
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            for number, copy in kept.items():
                os.dup2(copy, number)
                os.close(copy)
            file.seek(0)
            said[:0] = [file.read().decode("utf-8", "replace")]
            os.write(2, said[0].encode("utf-8"))
