"""A script's steps, played from the timer of a Blender that has a window."""

import os
import sys
import traceback

import bpy


def play(steps, pause, end):
    """Take a step after each pause in seconds, and leave Blender when there are no more.

    Parameters
    ----------
    steps : iterator
        Each step lets Blender run on.
    end : callable
        Is told of the exit status, 1 where a step raised, and returns the one to leave with.
    """

    def tick():
        try:
            next(steps)
        except StopIteration:
            leave(0)
        except BaseException:
            traceback.print_exc()
            leave(1)
        return pause

    def leave(status):
        status = end(status)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
