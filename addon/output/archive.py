"""Dataclasses of arrays as files: a NumPy archive (.npz) with a description in JSON, and no pickles.

The member ``about`` is JSON: the format and its version, a checksum, words about the content, and the structure, in
which an array is ``{"array": i}``, the member ``a<i>``; a dataclass ``{"class": name, "fields": {…}}``, a mapping
``{"items": [[key, value], …]}``, a sequence ``{"list": […]}``, and everything else itself.
"""

import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import BakeError
from .files import whole_file

FORMAT, VERSION = "photon-bake-light", 1


def write_archive(path: Path, thing: Any, about: Mapping[str, str]) -> None:
    """Write a dataclass of arrays, plain values and others like it, whole or not at all.

    Raises
    ------
    BakeError
        If the file cannot be written.
    """
    arrays: list[np.ndarray] = []
    structure = _packed(thing, arrays)
    head = {"format": FORMAT, "version": VERSION, "checksum": _checksum(structure, arrays), "about": dict(about)}
    text = np.frombuffer(json.dumps({**head, "structure": structure}).encode(), np.uint8)
    with whole_file(path) as file:
        np.savez(file, about=text, **{f"a{i}": array for i, array in enumerate(arrays)})


def read_archive(path: Path, classes: Sequence[type]) -> tuple[Any, dict[str, str]]:
    """What `write_archive` wrote, and what it says of it.

    Parameters
    ----------
    path : Path
    classes : sequence of type
        Dataclasses that may be in it.

    Raises
    ------
    BakeError
        If the file is none of ours, of another version, or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as members:
            head = json.loads(members["about"].tobytes())
            if head.get("format") != FORMAT or head.get("version") != VERSION:
                raise BakeError(f"{path} is of another version of Photon Bake: remove it.")
            arrays = [members[f"a{i}"] for i in range(len(members.files) - 1)]
        if _checksum(head["structure"], arrays) != head["checksum"]:
            raise BakeError(f"{path} is damaged: remove it.")
        return _unpacked(head["structure"], arrays, {one.__name__: one for one in classes}), head["about"]
    except (OSError, ValueError, KeyError, IndexError, zipfile.BadZipFile) as error:
        raise BakeError(f"{path} cannot be read as baked light: remove it.") from error


def _packed(thing: Any, arrays: list[np.ndarray]) -> Any:
    if isinstance(thing, np.ndarray):
        arrays.append(thing)
        return {"array": len(arrays) - 1}
    if is_dataclass(thing) and not isinstance(thing, type):
        values = {field.name: _packed(getattr(thing, field.name), arrays) for field in fields(thing)}
        return {"class": type(thing).__name__, "fields": values}
    if isinstance(thing, Mapping):
        return {"items": [[key, _packed(value, arrays)] for key, value in thing.items()]}
    if isinstance(thing, (list, tuple)):
        return {"list": [_packed(one, arrays) for one in thing]}
    if isinstance(thing, np.generic):
        return thing.item()
    if thing is None or isinstance(thing, (str, bool, int, float)):
        return thing
    raise TypeError(f"A {type(thing).__name__} has no place in an archive.")


def _unpacked(packed: Any, arrays: Sequence[np.ndarray], classes: Mapping[str, type]) -> Any:
    if not isinstance(packed, dict):
        return packed
    if "array" in packed:
        return arrays[packed["array"]]
    if "class" in packed:
        return classes[packed["class"]](
            **{name: _unpacked(value, arrays, classes) for name, value in packed["fields"].items()}
        )
    if "items" in packed:
        return {key: _unpacked(value, arrays, classes) for key, value in packed["items"]}
    return [_unpacked(one, arrays, classes) for one in packed["list"]]


def _checksum(structure: Any, arrays: Sequence[np.ndarray]) -> str:
    digest = blake2b(json.dumps(structure, sort_keys=True).encode(), digest_size=20)
    for array in arrays:
        digest.update(f"{array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data if array.size else b"")
    return digest.hexdigest()
