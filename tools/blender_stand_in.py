"""A small stand-in for the ``blender`` executable, on the bpy module from PyPI.

It reads its arguments from left to right as Blender does, and knows these:

    [-b | --background] [FILE.blend]   open a file; without one it starts with Blender's factory scene
    --factory-startup                  accepted: the stand-in never reads preferences or add-ons of its own
    --python FILE                      run a script; --python-expr CODE runs a line
    -c | --command NAME ARGS…          run the command NAME with everything after it, and exit with its status
    -- ARGS…                           for scripts, in sys.argv; not read here
    --version

Photon Bake is registered from the checkout that this file lies in, so ``-c photon_bake`` works without installing.
"""

import importlib.util
import os
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import bpy

ROOT = Path(__file__).resolve().parents[1]
Command = Callable[[list[str]], int]


def main(arguments: list[str]) -> int:
    """Do what Blender would do with `arguments`; returns the exit status."""
    bpy.ops.wm.read_factory_settings()
    commands: dict[str, Command] = {}
    extension = _register_extension(commands)
    try:
        return _read(list(arguments), commands)
    except KeyboardInterrupt:
        return 130
    finally:
        extension.unregister()


def _read(arguments: list[str], commands: dict[str, Command]) -> int:
    while arguments:
        argument = arguments.pop(0)
        if argument == "--":
            break
        if argument in ("-c", "--command"):
            return _command(arguments, commands)
        if argument in ("--python", "--python-expr"):
            if not arguments:
                return _usage(f"{argument} needs a value")
            if not _python(argument, arguments.pop(0)):
                return 1
        elif argument == "--version":
            print(f"Blender {bpy.app.version_string} (bpy module)")
            return 0
        elif not argument.startswith("-"):
            if not _open(argument):
                return 1
        elif argument not in ("-b", "--background", "--factory-startup"):
            return _usage(f"unknown option {argument}")
    return 0


def _usage(problem: str) -> int:
    print(f"blender stand-in: {problem}\n{__doc__}", file=sys.stderr)
    return 2


def _open(path: str) -> bool:
    try:
        with importlib.import_module("photon_bake.addon.output").hushed(1):  # Blender says that it read the file
            bpy.ops.wm.open_mainfile(filepath=os.path.abspath(path))
    except RuntimeError as error:
        print(f"blender stand-in: {error}", file=sys.stderr)
        return False
    return True


def _python(option: str, value: str) -> bool:
    """Run a script or a line as ``__main__``."""
    source = Path(value).read_text(encoding="utf-8") if option == "--python" else value
    name = value if option == "--python" else "<python-expr>"
    try:
        exec(compile(source, name, "exec"), {"__name__": "__main__", "__file__": name})
    except Exception:
        traceback.print_exc()
        return False
    return True


def _command(arguments: list[str], commands: dict[str, Command]) -> int:
    if not arguments or arguments[0] not in commands:
        return _usage(f"-c takes the name of a command: {', '.join(commands)}")
    return commands[arguments[0]](arguments[1:])


def _register_extension(commands: dict[str, Command]) -> ModuleType:
    """Register the checkout's extension; the commands that it adds are kept in `commands`."""

    def keep(name: str, command: Command) -> str:
        commands[name] = command
        return name

    bpy.utils.register_cli_command = keep  # the module has no -c that would call them
    bpy.utils.unregister_cli_command = commands.pop
    extension = _import_extension()
    extension.register()
    return extension


def _import_extension() -> ModuleType:
    """The checkout as the package ``photon_bake``, whatever its folder is called."""
    if importlib.util.find_spec("photon_bake") is None:
        spec = importlib.util.spec_from_file_location("photon_bake", ROOT / "__init__.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["photon_bake"] = module
        spec.loader.exec_module(module)
    return importlib.import_module("photon_bake")


if __name__ == "__main__":
    status = main(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # without the module's own end, which crashes in some versions after a file was opened
