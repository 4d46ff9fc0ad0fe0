"""Keeps every ray that kernels ask Embree for, to ask for them again: Embree's own time for the same rays.

Kernels find Embree's functions by name. Here the names become those of functions in between, which write down a ray
while a recording runs, and hand it on; that costs two nanoseconds a ray. Import this before the first kernel is called.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import llvmlite.binding
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from photon_bake.addon.core.parallel import slices
from photon_bake.addon.tracing.embree import new_ray
from photon_bake.addon.tracing.embree_library import RayFunction, rtc_intersect, rtc_occluded

_FLOATS = 12  # of an RTCRay
_CHUNK = 1 << 14
_ADDRESSES = types.void(types.uintp, types.uintp, types.uintp)
_state = np.zeros(4, np.uint64)
_STATE = _state.ctypes.data
_ON, _N, _CAPACITY, _ROWS = range(4)

ROW = np.dtype([("ray", np.float32, _FLOATS), ("tree", np.uint64), ("shadow", np.uint64)], align=True)
"""A ray as it is written down; 64 bytes."""

_EIGHTHS = ROW.itemsize // 8


@intrinsic
def _pointer(_, address):
    """An address as a pointer."""

    def code(_, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.uintp), code


def _in_between(function: RayFunction, shadow: int):
    """Give the name of one of Embree's functions to one that writes down its rays."""
    ask = function._numba_type_  # the library's own, to be renamed
    real = f"{ask.symbol}_itself"
    llvmlite.binding.add_symbol(real, llvmlite.binding.address_of_symbol(ask.symbol))
    ask = types.ExternalFunction(real, _ADDRESSES)

    @numba.cfunc(_ADDRESSES)
    def recording(tree, ray, arguments):
        state = numba.carray(_pointer(_STATE), (4,), np.uint64)
        if state[_ON]:
            if state[_N] < state[_CAPACITY]:
                row = numba.carray(_pointer(state[_ROWS] + state[_N] * np.uint64(8 * _EIGHTHS)), (_EIGHTHS,), np.uint64)
                own = numba.carray(_pointer(ray), (_FLOATS // 2,), np.uint64)
                for k in range(_FLOATS // 2):
                    row[k] = own[k]
                row[_FLOATS // 2], row[_FLOATS // 2 + 1] = tree, shadow
            state[_N] += np.uint64(1)
        ask(tree, ray, arguments)

    llvmlite.binding.add_symbol(function.name_in_kernels, recording.address)
    return recording


_kept = [_in_between(rtc_intersect, 0), _in_between(rtc_occluded, 1)]


@numba.njit(nogil=True)
def _replay(rows, floats, address):
    for i in range(len(rows)):
        for k in range(_FLOATS):
            floats[k] = rows[i].ray[k]
        if rows[i].shadow:
            _occluded_itself(rows[i].tree, address, 0)
        else:
            floats.view(np.int32)[18] = -1
            _intersect_itself(rows[i].tree, address, 0)


_intersect_itself = types.ExternalFunction(f"{rtc_intersect.name_in_kernels}_itself", _ADDRESSES)
_occluded_itself = types.ExternalFunction(f"{rtc_occluded.name_in_kernels}_itself", _ADDRESSES)


@dataclass(frozen=True)
class Recorded:
    """Rays that Embree was asked for, (n,) of `ROW`."""

    rows: np.ndarray

    @property
    def n_shadow_rays(self):
        return int(self.rows["shadow"].sum())

    def replay(self, n_threads):
        """Ask Embree for the same rays again."""

        def part(chunk):
            room = new_ray()
            _replay(self.rows[chunk], room.floats, room.address)

        with ThreadPoolExecutor(n_threads) as pool:
            list(pool.map(part, slices(len(self.rows), _CHUNK)))


def recorded(work, most=1 << 24):
    """The rays that `work()` asks Embree for on one thread, `most` of them at most."""
    rows = np.empty(most, ROW)
    _state[:] = 1, 0, most, rows.ctypes.data
    work()
    _state[_ON] = 0
    return Recorded(rows[: int(_state[_N])].copy())
