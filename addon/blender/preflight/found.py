"""What a rule found."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import bpy

from ...core.findings import Finding, counted
from ..warn import listed


@dataclass(frozen=True)
class Found:
    """A finding, and the objects that get no light for it."""

    finding: Finding
    unlit: "tuple[bpy.types.Object, ...]" = ()


def of_objects(
    objects: "Sequence[bpy.types.Object]",
    what: str,
    why: str,
    *remedies: str,
    get: Literal["light", "no light", "refused"] = "light",
) -> list[Found]:
    """A finding about objects, none where there are none.

    Parameters
    ----------
    what : str
        A few words that follow "12 objects: ".
    why : str
        Sentences about all of them.
    get : str
        Whether they get light in spite of it, or none, or the bake refuses to begin.
    """
    if not objects:
        return []
    names = tuple(obj.name for obj in objects)
    finding = Finding(
        line=f"{counted(len(objects), 'object') if len(objects) > 1 else names[0]}: {what}",
        sentences=(why, listed([f"'{name}'" for name in names])),
        names=names,
        kind="advice" if get == "light" else "difference",
        remedies=remedies,
        blocks=get == "refused",
    )
    return [Found(finding, tuple(objects) if get == "no light" else ())]


def of_bake(line: str, why: str, *remedies: str, blocks: bool = True) -> list[Found]:
    """A finding about the bake as a whole."""
    return [Found(Finding(line, (why,), kind="advice", remedies=remedies, blocks=blocks))]
