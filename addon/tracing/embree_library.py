"""Embree's own library, which the embreex wheel carries: its functions for Python, and those that kernels call.

Kernels call a function by its name, under which LLVM finds its address: only so can they be kept on disk. The names
are this extension's own, as Blender has an Embree of its own loaded beside this one.
"""

import ctypes
import weakref
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..core.compiling import jit
from ..core.errors import BakeError
from ..core.parallel import once
from ..core.zips import unusable_library

_P, _U, _SIZE = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
_TRIANGLES, _INSTANCE, _INDEX, _VERTEX, _UINT3, _FLOAT3 = 0, 121, 0, 1, 0x5003, 0x9003
_ROBUST = 4
"""Of a tree: rays that meet an edge meet one of its triangles."""


def find_library(package: Path) -> Path | None:
    """Embree in the embreex wheel whose package lies in a folder.

    The wheels of Linux and Windows carry it in embreex.libs beside the package (libembree4-….so.4, embree4.dll), those
    of macOS in embreex/.dylibs (libembree4.….dylib).
    """
    folders = package.parent / "embreex.libs", package / ".dylibs"
    return next((path for folder in folders for path in sorted(folder.glob("*embree4*"))), None)


@once
def _library() -> Any:
    """The library, its functions made known to LLVM.

    Raises
    ------
    BakeError
        If it is not there, or cannot be loaded.
    """
    spec = find_spec("embreex")
    path = find_library(Path(spec.origin).parent) if spec and spec.origin else None
    try:
        library = ctypes.CDLL(str(path)) if path else None
    except OSError:
        library = None
    if library is None:
        raise BakeError(unusable_library("embreex", "it has no Embree in it that can be loaded"))
    if jit():
        import llvmlite.binding  # here, as Blender's start should not wait for it

        for function in (rtc_intersect, rtc_occluded):
            address = ctypes.cast(getattr(library, function.name), _P).value
            llvmlite.binding.add_symbol(function.name_in_kernels, address)
    return library


class RayFunction:
    """One of Embree's functions of a tree, a ray and arguments, all of them addresses: kernels call it, and Python."""

    def __init__(self, name: str) -> None:
        self.name, self.name_in_kernels = name, f"photon_bake_{name}"

    def __call__(self, tree: int, ray: int, arguments: int) -> None:
        _call(self.name, None, _P(int(tree)), _P(int(ray)), _P(arguments))

    @property
    def _numba_type_(self) -> Any:
        """What Numba takes it for."""
        from numba import types

        _library()
        address = types.uintp
        return types.ExternalFunction(self.name_in_kernels, types.void(address, address, address))


rtc_intersect, rtc_occluded = RayFunction("rtcIntersect1"), RayFunction("rtcOccluded1")


class EmbreeTree:
    """Embree's tree over triangles; freed with this object.

    Parameters
    ----------
    vertices : (v, 3) float32
    triangles : (t, 3) int32
    included : (t,) bool
        Which triangles rays meet; they keep their numbers.

    Attributes
    ----------
    handle : int
        What kernels take.
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, included: np.ndarray) -> None:
        self.handle = _new_tree(self)
        if included.any():
            # Embree leaves out triangles whose vertices there are not
            indices = np.where(included[:, None], triangles, -1).astype(np.int32)
            self._attach(vertices.astype(np.float32, copy=False), indices)
        _commit(self.handle)

    def _attach(self, vertices: np.ndarray, indices: np.ndarray) -> None:
        geometry = _new_geometry(_TRIANGLES)
        for kind, format_, data in ((_INDEX, _UINT3, indices), (_VERTEX, _FLOAT3, vertices)):
            buffer = ctypes.c_int(kind), _U(0), ctypes.c_int(format_), _SIZE(12), _SIZE(len(data))
            place = _call("rtcSetNewGeometryBuffer", _P, geometry, *buffer)
            if place:
                ctypes.memmove(place, np.ascontiguousarray(data).ctypes.data, data.nbytes)
        _attach(self.handle, geometry)


class TreeOfTrees:
    """Embree's tree over other trees, which it keeps alive; their triangles keep their numbers.

    Attributes
    ----------
    handle : int
        What kernels take.
    """

    def __init__(self, *parts: EmbreeTree) -> None:
        self._parts, self.handle = parts, _new_tree(self)
        for part in parts:
            geometry = _new_geometry(_INSTANCE)
            _call("rtcSetGeometryInstancedScene", None, geometry, _P(part.handle))
            _attach(self.handle, geometry)
        _commit(self.handle)


def _new_tree(owner: object) -> int:
    """The handle of an empty tree, which is freed with its owner."""
    handle: int = _call("rtcNewScene", _P, _device())
    weakref.finalize(owner, _call, "rtcReleaseScene", None, _P(handle))
    _call("rtcSetSceneFlags", None, _P(handle), ctypes.c_int(_ROBUST))
    return handle


def _new_geometry(kind: int) -> ctypes.c_void_p:
    return _P(_call("rtcNewGeometry", _P, _device(), ctypes.c_int(kind)))


def _attach(tree: int, geometry: ctypes.c_void_p) -> None:
    _call("rtcCommitGeometry", None, geometry)
    _call("rtcAttachGeometry", _U, _P(tree), geometry)
    _call("rtcReleaseGeometry", None, geometry)


def _commit(tree: int) -> None:
    """Build a tree of what is attached to it."""
    _call("rtcCommitScene", None, _P(tree))
    if _call("rtcGetDeviceError", ctypes.c_int, _device()):
        raise BakeError("Embree could not build its tree over the scene; it may be short of memory.")


@once
def _device() -> ctypes.c_void_p:
    """Embree's device, one for all trees: it takes no geometry of another one's into a tree."""
    return _P(_call("rtcNewDevice", _P, _P(None)))


def _call(name: str, result: Any, *arguments: Any) -> Any:
    """What a function of the library returns; each argument is of the ctypes type that it takes."""
    function = getattr(_library(), name)
    function.restype, function.argtypes = result, [type(argument) for argument in arguments]
    return function(*arguments)
