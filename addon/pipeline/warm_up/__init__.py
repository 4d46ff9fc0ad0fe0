"""Kernels compiled ahead of the first bake, by tiny bakes through all stages in a process of their own.

In Blender's own process compiling would hold Python's lock for up to 0.2 s at a time, and the window with it.
"""

from .ahead import COMPILING, Compiler

compiler = Compiler()
"""There is one folder of kernels, so there is one."""

__all__ = ["COMPILING", "compiler"]
