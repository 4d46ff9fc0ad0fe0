"""Digests of what data is made of, by which equal contents are told without keeping them."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import blake2b
from typing import Any

import numpy as np


def content_digest(*things: Any) -> bytes:
    """A digest of arrays, dataclasses, mappings, sequences and plain values, whatever their depth.

    Raises
    ------
    TypeError
        If there is anything else in them.
    """
    digest = blake2b(digest_size=20)
    for thing in things:
        _add(digest, thing)
    return digest.digest()


def _add(digest: Any, thing: Any) -> None:
    if isinstance(thing, np.ndarray):
        digest.update(f"array {thing.dtype.str} {thing.shape}".encode())
        digest.update(np.ascontiguousarray(thing).reshape(-1).view(np.uint8).data if thing.size else b"")
    elif is_dataclass(thing) and not isinstance(thing, type):
        digest.update(f"{type(thing).__qualname__} ".encode())
        for field in fields(thing):
            digest.update(f"{field.name}=".encode())
            _add(digest, getattr(thing, field.name))
    elif isinstance(thing, (str, bytes, int, float, complex, bool, np.generic, Enum)) or thing is None:
        digest.update(f"{type(thing).__name__} {thing!r};".encode())
    elif isinstance(thing, Mapping):
        digest.update(f"mapping {len(thing)} ".encode())
        for key, value in thing.items():
            _add(digest, key)
            _add(digest, value)
    elif isinstance(thing, (Sequence, set, frozenset)):
        items = sorted(thing, key=repr) if isinstance(thing, (set, frozenset)) else thing
        digest.update(f"sequence {len(thing)} ".encode())
        for one in items:
            _add(digest, one)
    else:
        raise TypeError(f"A {type(thing).__name__} has no digest.")
