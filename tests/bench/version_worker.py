"""One version's bakes, as another process asks for them: see versions.py.

    python version_worker.py FOLDER NAME PATH RECEIVERS

FOLDER is the version's checkout, whose own bench opens the scene; PATH is empty for a scene of the bench's own. For
each line that it reads, a quality and a seed, it bakes, and answers with a line of JSON; for an empty one it ends.
"""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np


def main(folder, name, path, n):
    sys.path.insert(0, str(Path(folder) / "tests" / "bench"))
    from equal_error import Case, settings_for
    from memory import extra_memory

    case = Case.open(name, Path(path) if path else None, int(n))
    case.bake(settings_for("draft"))  # loads libraries, and compiles kernels
    print("READY", flush=True)
    while asked := sys.stdin.readline().split():
        settings, started = replace(settings_for(asked[0]), seed=int(asked[1])), perf_counter()
        light, memory = extra_memory(lambda settings=settings: case.bake(settings))
        seconds = perf_counter() - started
        rmse = case.truth.relative_rmse(case.at_probes(light.value) / np.pi)
        said = float(light.relative_noise)
        print(json.dumps({"seconds": seconds, "rmse": float(rmse), "said": said, "memory": memory}), flush=True)
    os._exit(0)  # without the bpy module's own end


main(*sys.argv[1:])
