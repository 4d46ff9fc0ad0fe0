"""Measures how long Blender's window would wait while a bake runs in its thread, as the panel's button starts it.

    python tests/bench/run.py --only window [--scene NAME]

The main thread does as a window's timer does: it sleeps, which needs no lock of Python's, then wants the lock for a
little work. Lateness is the time from the end of the sleep that it asked for to the end of that work. Part of it is the
processor's, which other threads have in turn; a process on every core, which holds none of our locks, tells that part.
A session's first bake also imports SciPy, before its first stage.
"""

import os
import subprocess
import sys
from contextlib import contextmanager
from time import perf_counter, sleep

import bpy
import numpy as np
from equal_error import Case
from figures import table
from own_scenes import OWN_SCENES
from photon_bake.addon.core.inspector import Inspector
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.jobs.solving import Solver
from photon_bake.operators.targets.vertices import VertexRequest

TICK, N_RECEIVERS, SECONDS_ALONE = 0.01, 200_000, 3.0
WORK = 1000  # additions: about 0.05 ms
HEAD = ["Scene", "Meanwhile", "Seconds", "Ticks", "Median, ms", "99%, ms", "Most, ms", "Most while", "Over 50 ms"]


def late_ticks(going_on, doing=lambda: ""):
    """Lateness of each tick, s, while ``going_on()``; and what was being done at the latest one."""
    late, latest = [], ("", 0.0)
    while going_on():
        due = perf_counter() + TICK
        sleep(TICK)
        sum(range(WORK))
        late.append(perf_counter() - due)
        if late[-1] > latest[1]:
            latest = doing(), late[-1]
    return np.array(late), latest[0]


@contextmanager
def busy_processes():
    """A process on every core that only counts."""
    running = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count())]
    try:
        yield
    finally:
        for process in running:
            process.kill()
            process.wait()


def while_solving(solver, progress_of):
    """Lateness of ticks while the panel's thread bakes, and the stage of the latest."""
    solver.start()
    found = late_ticks(solver.is_alive, lambda: progress_of[0])
    solver.solved()
    return found


def bake_on_thread(n_threads):
    """The thread that the panel's button starts, baking the object "Receivers", and what it says that it is doing."""
    stage = [""]

    def listen(name, _):
        stage[0] = name

    progress = Progress(listen)
    job = BakeJob.prepare(bpy.context, [VertexRequest()], progress, ["Receivers"])
    return Solver(job, settings_for("medium", n_threads=n_threads), progress, Inspector()), stage


def for_a_while():
    end = perf_counter() + SECONDS_ALONE
    return lambda: perf_counter() < end


def row(name, meanwhile, late, latest=""):
    """Cells of `HEAD`."""
    figures = [f"{1000 * value:.1f}" for value in (*np.quantile(late, (0.5, 0.99)), late.max())]
    seconds = late.sum() + TICK * len(late)
    return [name, meanwhile, f"{seconds:.1f}", str(len(late)), *figures, latest, str(np.count_nonzero(late > 0.05))]


def rows(name, path):
    """Rows of `HEAD` for a scene: nothing going on, other processes, and a bake."""
    Case.open(name, path, N_RECEIVERS)
    yield row(name, "nothing", late_ticks(for_a_while())[0])
    with busy_processes():
        yield row(name, "a process on every core", late_ticks(for_a_while())[0])
    for n_threads, meanwhile in ((0, "the first bake"), (max(1, os.cpu_count() - 1), "a bake that leaves one core")):
        yield row(name, meanwhile, *while_solving(*bake_on_thread(n_threads)))


def tables(scenes, options):
    """A Markdown table."""
    paths = {**scenes, **dict.fromkeys(OWN_SCENES)}
    chosen = [name for name in options.scene or ["cornell"] if name in paths] or ["window"]
    found = [cells for name in chosen for cells in rows(name, paths[name])]
    return [table("How late a window's timer is during a bake", HEAD, found)]
