"""The process that compiles kernels: a script that the Python of Blender runs, outside Blender.

    python process.py PACKAGE ROOT

It imports the extension under the name that it has in Blender, since what Numba keeps on disk tells kernels apart by
the full names of the types that they take. It says how far it is with what bakes need, and when there is all, or
what is wrong. It ends with its parent, whose end closes its standard input.
"""

import importlib
import importlib.util
import os
import sys
from contextlib import suppress
from threading import Thread
from types import ModuleType


def main(package: str, root: str) -> None:
    """Compile all kernels."""
    Thread(target=_end_with_parent, daemon=True).start()
    if hasattr(os, "nice"):
        with suppress(OSError):
            os.nice(10)
    _import_as(package, root)
    errors = importlib.import_module(f"{package}.addon.core.errors")
    try:
        importlib.import_module(f"{package}.addon.core.zips").check_libraries()
    except errors.BakeError as error:
        print("complaint", error, flush=True)
        sys.exit(1)
    tiny = importlib.import_module(f"{package}.addon.pipeline.warm_up.tiny_bakes")
    bakes = tiny.tiny_bakes()
    for number, bake in enumerate(bakes, 1):
        bake()
        print("done", number / len(bakes), flush=True)
    tiny.tiny_live()
    print("all kernels", flush=True)


def _import_as(package: str, root: str) -> None:
    """Import the extension, whose folder is `root`, as `package`; packages around it hold nothing else."""
    around = package.split(".")[:-1]
    for i in range(len(around)):
        name = ".".join(around[: i + 1])
        sys.modules[name] = ModuleType(name)
        sys.modules[name].__path__ = []
    spec = importlib.util.spec_from_file_location(
        package, os.path.join(root, "__init__.py"), submodule_search_locations=[root]
    )
    assert spec is not None and spec.loader is not None
    sys.modules[package] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[package])


def _end_with_parent() -> None:
    """Wait for the end of the standard input."""
    with suppress(OSError):
        while os.read(0, 1):
            pass
    os._exit(1)


if __name__ == "__main__":
    main(*sys.argv[1:])
