"""What is found about many things at once, said in one line: "12 meshes: shared by several objects".

Warnings of a bake are sentences about one thing each. `grouped` joins those that differ only in names and numbers.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from .errors import TooCoarse, WarningKind, kind_of


@dataclass(frozen=True)
class Finding:
    """Something that holds of one thing or several.

    Attributes
    ----------
    line : str
        All of it in a few words.
    sentences : tuple of str
        What there is to say in full, one thing each.
    names : tuple of str
        Objects to select; empty where it is not about objects.
    kind : WarningKind
    remedies : tuple of str
        Names of what `photon_bake.remedy` can do about it, the best first.
    blocks : bool
        Whether a bake would refuse to begin.
    """

    line: str
    sentences: tuple[str, ...]
    names: tuple[str, ...] = ()
    kind: WarningKind = "difference"
    remedies: tuple[str, ...] = ()
    blocks: bool = False


_KNOWN: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    (r"^Mesh '.*' is shared by", "shared mesh", ("single_user", "bake_copies")),
    (r"has no faces to bake to", "no faces", ()),
    (r"has zero scale along an axis", "no scale along an axis", ()),
    (r"makes a new mesh that shows no attribute", "new mesh by a modifier", ("bake_copies",)),
    (r"of its surface shows no light", "faces without light", ("bake_copies",)),
    (r"turns its back to the light", "back to the light", ("flip_normals", "open_side")),
    (r"is inside out", "inside out", ("recalculate_outside", "open_side")),
    (r"ha(?:s|ve) too few vertices", "too few vertices", ("refine",)),
    (r"got no light, since", "changed during the bake", ("bake",)),
    (r"are not finite", "not finite", ()),
    (r"^Emissive faces of", "emits in a wall's plane", ()),
    (r"texels a met(?:re|er) instead of", "larger than Max Size", ("max_size",)),
    (r"(?:are|is) linked from another file", "linked from another file", ("bake_copies",)),
    (r"lies over itself|lie in one place of UV map", "UV map lies over itself", ("make_uv_map",)),
    (r"could not be unwrapped|charts of", "could not be unwrapped", ()),
    (r"are not meshes and got no light", "not a mesh", ("bake_copies",)),
    (r"show instances, which have", "instances", ("bake_copies",)),
    (r"show the same light in several places", "copied faces", ("bake_copies",)),
    (r"have hair, points or a volume", "hair or volume", ()),
    (r"^Nothing in the scene gives light", "Nothing gives light", ("add_light",)),
)
"""Warnings by what they say: in few words after the number of things, and what can be done."""

_SUBJECT = re.compile(r"^(?:Left out: )?(?:The )?(\w+)(?: \w+)?(?: of)? '([^']*)':? (.*)$", re.DOTALL)


def grouped(warnings: Iterable[str]) -> list[Finding]:
    """Warnings that differ only in names and numbers, joined; in the order of their first."""
    groups: dict[tuple[str, WarningKind], list[str]] = {}
    for warning in warnings:
        groups.setdefault((_skeleton(warning), kind_of(warning)), []).append(warning)
    return [_joined(sentences, kind) for (_, kind), sentences in groups.items()]


def _skeleton(sentence: str) -> str:
    """A sentence without its names and numbers, or what it is known to say."""
    for pattern, _, _ in _KNOWN:
        if re.search(pattern, sentence):
            return pattern
    return re.sub(r"\d[\d.,]*", "#", re.sub(r"'[^']*'(?:, '[^']*')*", "'…'", sentence))


def _joined(sentences: list[str], kind: WarningKind) -> Finding:
    first = sentences[0]
    known = next(((line, remedies) for pattern, line, remedies in _KNOWN if re.search(pattern, first)), ("", ()))
    several = re.match(r"(\d+) object\(s\)", first)
    if several and known[0]:
        line = f"{counted(int(several[1]), 'object')}: {known[0]}"
        return Finding(line, tuple(sentences), _names_in(sentences), kind, known[1])
    subject = _SUBJECT.match(first)
    if not subject and len(sentences) == 1 and known[0]:
        return Finding(known[0], tuple(sentences), (), kind, known[1])
    if not subject or not (known[0] or len(sentences) > 1):
        line = first if len(sentences) == 1 else f"{len(sentences)} times: {first}"
        return Finding(line, tuple(sentences), _names_in(sentences), kind, known[1])
    noun, name, rest = subject.groups()
    what = known[0] or rest.split(":")[0].split(";")[0].rstrip(".").removeprefix("its ")
    line = f"{counted(len(sentences), noun.lower())}: {what}" if len(sentences) > 1 else f"{name}: {what}"
    return Finding(line, tuple(sentences), _names_in(sentences), kind, known[1])


def _names_in(sentences: list[str]) -> tuple[str, ...]:
    """The names that come first in sentences about objects; and all names of a sentence that has a list of them."""
    found: list[str] = []
    for sentence in sentences:
        if isinstance(sentence, TooCoarse):
            found += sentence.names
            continue
        names = re.findall(r"'([^']*)'", sentence)
        listed = re.search(r"object\(s\)|^Objects|is shared by|of objects ", sentence)
        found += names if listed else names[:1]
    return tuple(dict.fromkeys(found))


def counted(n: int, noun: str) -> str:
    """``1 mesh``, ``12 meshes``."""
    plural = noun + ("es" if noun.endswith(("s", "sh", "ch", "x")) else "s")
    return f"{n:,} {noun if n == 1 else plural}"
