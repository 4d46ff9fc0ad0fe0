"""Measures what compiled code would bring to the look-ups of gather rays, and what its compiler would cost.

    pip install --no-deps --target build/numba numba llvmlite
    PYTHONPATH=build/numba python tests/bench/numba_trial.py [--scenes DIR] [--scene NAME]

Numba is no dependency of the extension. It is worth one only if the window never waits for the compiler.
"""

import json
import os
import subprocess
import sys
import tempfile
import zlib
from importlib.metadata import PackageNotFoundError, distribution
from threading import Thread
from time import perf_counter, process_time

import numpy as np
import ray_rates
from figures import load, scene_options, scenes_in, table
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.gather.direct.ray_directions import gather_directions
from photon_bake.addon.scene.z_curve import z_curve
from photon_bake.addon.tracing import Hits
from responsiveness import late_ticks

SCENES = ("cornell", "classroom")
N_RECORDS, N_RAYS, N_TIMES = 1024, 128, 15  # a chunk of the final gather
HEAD = ["Scene", "Rays", "Embree, ms", "NumPy, ms", "Compiled, ms", "NumPy over compiled", "NumPy over Embree"]
HEAD += ["Compiled over Embree", "Rays otherwise near", "Sums apart"]
COMPILE_HEAD = ["First use", "Import, s", "First call, s", "Latest tick of a window, ms"]
SIZE_HEAD = ["Package", "Version", "MB in the zip", "MB unpacked"]


class LookUps:
    """A chunk of gather rays in a scene, with the cache of a bake at medium quality."""

    def __init__(self, scene, receivers):
        engine = ray_rates.Engine.of(scene, receivers)
        self.cache = engine.rays._cache
        self.normals, self.embree = scene.normals, engine.tracer._trees[0]._embree
        chosen = ray_rates.spread(receivers, N_RECORDS)
        chosen = chosen[np.argsort(z_curve(receivers.position[chosen]), kind="stable")]
        origins, normals = (np.repeat(of[chosen], N_RAYS, 0) for of in (receivers.position, receivers.normal))
        self.origins, self.directions = origins, gather_directions(normals, N_RAYS, stream(0))
        self.found = self.by_embree()

    def by_embree(self):
        return self.embree.run(self.origins, self.directions, output=True)

    def by_numpy(self):
        """What the engine does: sums (r, 3) of the radiance that rays meet, and which end too near (n,)."""
        triangle, distance, u, v = (self.found[name] for name in ("primID", "tfar", "u", "v"))
        hits = Hits(triangle, distance, u, v, self.normals[triangle])
        radiance, near = self.cache.look_up(hits, self.directions)
        radiance = np.where(near[:, None], np.float32(0), radiance)
        return radiance.reshape(-1, N_RAYS, 3).sum(axis=1, dtype=np.float64), near

    def compiled(self):
        """The same by Numba."""
        from numba_look_up import sums_of_records

        rays = self.directions, *(self.found[name] for name in ("primID", "tfar", "u", "v"))
        elements, cache = self.cache.elements, self.cache
        cells = elements.cells.cuts, elements.cells.first
        elements = elements.cuts, elements.first
        return sums_of_records(rays, self.normals, cells, elements, cache.radiance, cache._reach, N_RAYS)

    def row(self, name):
        """Cells of `HEAD`."""
        (expected, near), (sums, also_near) = self.by_numpy(), self.compiled()
        embree, numpy, compiled = (
            min(ray_rates.seconds(work, process_time) for _ in range(N_TIMES))
            for work in (self.by_embree, self.by_numpy, self.compiled)
        )
        times = [f"{1000 * seconds:.1f}" for seconds in (embree, numpy, compiled)]
        ratios = [f"{ratio:.2f}" for ratio in (numpy / compiled, numpy / embree, compiled / embree)]
        apart = f"{np.abs(sums - expected).max() / expected.max():.0e}"
        return [name, f"{len(near):,}", *times, *ratios, str(np.count_nonzero(near != also_near)), apart]


def first_use():
    """Print, for the process that asks, what the first use of the compiled code takes, in a thread as a bake is."""
    seconds = {}

    def use():
        start = perf_counter()
        from numba_look_up import sums_of_records

        seconds["import"] = perf_counter() - start
        sums_of_records(*_one_ray(), 1)
        seconds["call"] = perf_counter() - start - seconds["import"]

    thread = Thread(target=use)
    thread.start()
    late, _ = late_ticks(thread.is_alive)
    print(json.dumps({**seconds, "late": late.max(initial=0)}))


def _one_ray():
    """Arguments of the compiled function, of the types that they have in a bake."""
    number, index, vector = np.zeros(1, np.float32), np.zeros(1, np.int32), np.zeros((1, 3), np.float32)
    pieces = np.ones(1, np.int32), index
    return (vector, index, number, number, number), vector, pieces, pieces, np.zeros((4, 3), np.float32), number


def compile_rows():
    """Rows of `COMPILE_HEAD`: in a process that has no compiled code, and in one that finds it in Numba's cache."""
    with tempfile.TemporaryDirectory() as folder:
        for what in ("compiled", "from Numba's cache on disk"):
            command = [sys.executable, __file__, "--first-use"]
            environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
            printed = subprocess.run(command, check=True, env=environment, stdout=subprocess.PIPE, text=True).stdout
            said = json.loads(printed.splitlines()[-1])
            yield [what, f"{said['import']:.2f}", f"{said['call']:.2f}", f"{1000 * said['late']:.0f}"]


def size_rows():
    """Rows of `SIZE_HEAD`: packages as they would be in the zip, each file deflated as in their wheels."""
    for name in ("numba", "llvmlite"):
        package = distribution(name)
        files = [path.locate() for path in package.files if "__pycache__" not in path.parts]
        files = [path for path in files if path.is_file()]
        deflated = sum(len(zlib.compress(path.read_bytes())) for path in files)
        sizes = (f"{size / 1e6:.1f}" for size in (deflated, sum(path.stat().st_size for path in files)))
        yield [name, package.version, *sizes]


def main():
    if "--first-use" in sys.argv:
        return first_use()
    parser = scene_options(__doc__)
    parser.add_argument("--scene", nargs="+", metavar="NAME")
    options = parser.parse_args()
    try:
        distribution("numba")
    except PackageNotFoundError:
        raise SystemExit("Numba is not installed: " + __doc__.split("\n\n")[1].strip()) from None
    scenes = {name: path for name, path in scenes_in(options.scenes).items() if name in (options.scene or SCENES)}
    print(f"Python {sys.version.split()[0]}, NumPy {np.__version__}, one thread\n")
    table("First use of compiled code in a bake's thread", COMPILE_HEAD, compile_rows())
    table("Packages", SIZE_HEAD, size_rows())
    table("A chunk of gather rays", HEAD, [LookUps(*load(path)[:2]).row(name) for name, path in scenes.items()])


if __name__ == "__main__":
    main()
