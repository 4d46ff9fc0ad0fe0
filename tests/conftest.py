"""Makes the checkout importable as the package `photon_bake`, where the environment has not done so (in a Blender)."""

import importlib.util
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

if importlib.util.find_spec("photon_bake") is None:
    spec = importlib.util.spec_from_file_location(
        "photon_bake", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
    )
    assert spec and spec.loader
    package = importlib.util.module_from_spec(spec)
    sys.modules["photon_bake"] = package
    spec.loader.exec_module(package)
