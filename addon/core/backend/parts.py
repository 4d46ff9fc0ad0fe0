"""How parts are compiled: as far as kernels need them, which is less than Numba does for what Python may call.

Numba optimises each function with all that it calls, and makes machine code of it; what a kernel calls it then takes
apart again. A part stays as it was lowered and simplified by itself; kernels link parts, and are optimised as a whole.
"""

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _PartLibrary(JITCodeLibrary):
    """A part and those that it calls, without machine code."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    @property
    def codegen(self) -> Any:
        return _NoMachineCode


class _NoMachineCode:
    @staticmethod
    def set_env(name: str, environment: Any) -> None:
        """Nothing: globals of what has no machine code have no address."""


class PartCompiler(Compiler):
    """Numba's compiler with another kind of library."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library or _PartLibrary(target.codegen(), "part"), *rest)
