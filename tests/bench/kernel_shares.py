"""Where a bake's processor time goes: the share of each kernel, Embree's own time among them.

    python tests/bench/run.py --only shares [--scene NAME…]

By the processor's clock of the thread that calls a kernel, at medium on one thread, so that other processes matter
little. What no kernel does is Python, NumPy and SciPy.
"""

from collections import Counter
from dataclasses import replace
from threading import Lock
from time import process_time, thread_time

from equal_error import Case
from figures import table
from own_scenes import OWN_SCENES
from photon_bake.addon.core.compiling import Compiled
from photon_bake.addon.settings.bake import settings_for

N_RECEIVERS, LEAST = 200_000, 0.01


class Clocked:
    """While it is entered, every call of a kernel from Python is clocked."""

    def __init__(self):
        self.seconds, self._lock, self._call = Counter(), Lock(), Compiled.__call__

    def __enter__(self):
        def call(kernel, *arguments):
            begun = thread_time()
            try:
                return self._call(kernel, *arguments)
            finally:
                with self._lock:
                    self.seconds[f"{kernel.__module__.rpartition('.addon.')[2]}.{kernel.__name__}"] += (
                        thread_time() - begun
                    )

        Compiled.__call__ = call
        return self

    def __exit__(self, *_):
        Compiled.__call__ = self._call


def rows(name, path):
    """Rows of a scene: kernels with at least a hundredth of the time, and the rest."""
    case, settings = Case.open(name, path, N_RECEIVERS), replace(settings_for("medium"), n_threads=1)
    case.bake(settings)  # compiles
    begun = process_time()
    with Clocked() as clocked:
        case.bake(settings)
    whole = process_time() - begun
    shares = {kernel: seconds / whole for kernel, seconds in clocked.seconds.most_common()}
    shown = {kernel: share for kernel, share in shares.items() if share >= LEAST}
    yield from ([name, kernel, f"{share:.0%}"] for kernel, share in shown.items())
    yield [name, "other kernels", f"{sum(shares.values()) - sum(shown.values()):.0%}"]
    yield [name, "no kernel", f"{1 - sum(shares.values()):.0%}"]


def tables(scenes, options):
    """A Markdown table."""
    paths = {**scenes, **dict.fromkeys(OWN_SCENES)}
    found = [row for name in options.scene or ["classroom", "window"] for row in rows(name, paths[name])]
    return [table("Shares of the processor's time by kernel", ["Scene", "Kernel", "Share"], found)]
