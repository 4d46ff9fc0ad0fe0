"""What a bake can end with besides light, and what it can say although it goes on.

A warning is a string. A plain one says that light differs from Cycles'; those of the classes below say something else.
"""

from collections.abc import Iterable
from typing import Literal

WarningKind = Literal["difference", "missing", "advice"]


class BakeError(Exception):
    """Input that cannot be baked. The message is one sentence naming the object and the remedy."""


class Cancelled(Exception):  # noqa: N818 (a wish, not an error)
    """The user asked the bake to stop; raised by `Progress.update`."""


class Advice(str):
    """A warning about light that is as Cycles'."""


class TooCoarse(Advice):
    """Advice that objects have too few vertices to show their light.

    Attributes
    ----------
    names : tuple of str
        Of all of them.
    """

    names: tuple[str, ...]

    def __new__(cls, names: "Iterable[str]") -> "TooCoarse":
        every = tuple(names)
        quoted = ", ".join(f"'{name}'" for name in every[:5]) + (", …" if len(every) > 5 else "")
        if len(every) == 1:
            sentence = f"Object {quoted} has too few vertices to show its light: refine its mesh."
        else:
            sentence = (
                f"{len(every)} object(s) have too few vertices to show their light ({quoted}): refine their meshes."
            )
        made = super().__new__(cls, sentence)
        made.names = every
        return made

    def __getnewargs__(self) -> tuple[tuple[str, ...]]:  # type: ignore[override]
        return (self.names,)  # for copies, which reports are made of


class Missing(str):
    """A warning about a file that is missing: light is as Cycles' without it, and so not as the artist meant it."""


def kind_of(warning: str) -> WarningKind:
    """What a warning is about."""
    if isinstance(warning, Advice):
        return "advice"
    return "missing" if isinstance(warning, Missing) else "difference"


def refuse_differences(warnings: Iterable[str]) -> None:
    """Allow advice alone.

    Raises
    ------
    BakeError
        If a warning says that light differs from Cycles', or that a file is missing.
    """
    serious = [warning for warning in warnings if kind_of(warning) != "advice"]
    if serious:
        more = f" (and {len(serious) - 1} more)" if len(serious) > 1 else ""
        raise BakeError(f"Strict, so nothing was written{more}: {serious[0]}")
