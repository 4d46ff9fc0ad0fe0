"""Errors in a sentence."""

import traceback

from ...addon.core.errors import BakeError


def describe(error: Exception) -> str:
    """One sentence about an error; for one that is no fault of the input, its traceback goes to the console."""
    if isinstance(error, BakeError):
        return str(error)
    traceback.print_exception(error)
    return f"The bake failed unexpectedly ({type(error).__name__}: {error}); the console has the details."
