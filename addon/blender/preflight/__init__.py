"""What can be told of a bake before it: which objects will get light, which will not and why, how much work it is.

It asks no dependency graph and reads no vertex, so that it is done while a panel waits; a bake itself finds out more.
"""

from .asked import Asked
from .check import Preflight, check

__all__ = ["Asked", "Preflight", "check"]
