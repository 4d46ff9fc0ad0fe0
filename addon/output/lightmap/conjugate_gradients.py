"""Sparse symmetric systems, by conjugate gradients preconditioned with symmetric Gauss–Seidel sweeps.

Of a matrix A = L + I + U, whose rows and columns were scaled so that its diagonal is 1, the preconditioner is
(I + L)(I + U). Eisenstat (1981) solves by (I + L)⁻¹ A (I + U)⁻¹, which takes a vector p to

    q = t + (I + L)⁻¹ (p − t),     t = (I + U)⁻¹ p,

so that a step reads the matrix once, as plain conjugate gradients do, and far fewer steps are needed. Three right sides
are solved at once: the matrix is read once for all.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...core.compiling import kernel, kernel_array, part
from ...core.vec3 import minus, mul, plus, put, row, times, wide

_ROUNDING = 2.0**-22  # of the right sides: smaller residuals are noise


class Matrix(NamedTuple):
    """A symmetric positive definite matrix (n, n) in compressed rows, scaled to a diagonal of 1, for kernels.

    Attributes
    ----------
    ends, middle : (n,) int32
        Where the row of each unknown ends, and where its element on the diagonal is.
    column : (m,) int32
        Rising within each row.
    value : (m,) float32
    """

    ends: np.ndarray
    middle: np.ndarray
    column: np.ndarray
    value: np.ndarray


def scaled(matrix: csr_array) -> tuple[Matrix, np.ndarray]:
    """S A S of a matrix A whose diagonal is above 0, and the diagonal of S = D^(−½), (n,) float64."""
    matrix.sort_indices()
    scale = 1 / np.sqrt(matrix.diagonal())
    of_row = np.repeat(np.arange(len(scale)), np.diff(matrix.indptr))
    middle = np.flatnonzero(matrix.indices == of_row)
    ends, middle, column = (kernel_array(of, np.int32) for of in (matrix.indptr[1:], middle, matrix.indices))
    value = (matrix.data * scale[of_row] * scale[matrix.indices]).astype(np.float32)
    return Matrix(ends, middle, column, value), scale


def solve(
    matrix: Matrix, right: np.ndarray, start: np.ndarray, tolerance: float, most_steps: int, check: Callable[[], None]
) -> np.ndarray:
    """Solve matrix x = right for x (n, 3) float32: what takes time is to read and write vectors.

    Parameters
    ----------
    right, start : (n, 3) float32
    tolerance : float
        Of the residual, in the preconditioner's norm, over the first one.
    check : callable
        Is called at each step, to be cancelled.
    """
    x, residual, step = start.copy(), np.empty_like(start), np.zeros_like(start)
    lift, swept = np.empty((2, *x.shape), np.float32)
    share, product, size = np.zeros((3, 1, 3))
    first_residual(matrix, right, x, residual, size)
    of_right = np.einsum("nc,nc->c", right, right, dtype=np.float64)
    enough = np.maximum(tolerance**2 * size, _ROUNDING**2 * of_right)
    for _ in range(most_steps):
        if (size <= enough).all():
            break
        check()
        next_step(matrix, residual, share, step, lift)
        sweep(matrix, step, lift, swept, product)
        before = size.copy()
        # What has been solved stays as it is, and what rounding lets go no further
        moves = (before > enough) & (product > 0)
        length = np.divide(before, product, out=np.zeros_like(before), where=moves)
        advance(x, residual, lift, swept, length, size)
        share = size / np.maximum(before, 1e-300)
    return x


@kernel
def first_residual(matrix, right, x, residual, size):
    """Write (I + L)⁻¹ (right − A x), (n, 3), and its square, (1, 3)."""
    first, total = 0, (0.0, 0.0, 0.0)
    for i in range(len(x)):
        rest = minus(wide(row(right, i)), _sum(matrix, x, first, matrix.ends[i]))
        rest = minus(rest, _sum(matrix, residual, first, matrix.middle[i]))
        put(residual, i, rest)
        total = plus(total, mul(rest, rest))
        first = matrix.ends[i]
    put(size, 0, total)


@kernel
def next_step(matrix, residual, share, step, lift):
    """Make the next step p (n, 3) of the residual and a share (1, 3) of the last one; write t = (I + U)⁻¹ p."""
    of_last = row(share, 0)
    for i in range(len(step) - 1, -1, -1):
        p = plus(wide(row(residual, i)), mul(wide(row(step, i)), of_last))
        put(step, i, p)
        put(lift, i, minus(p, _sum(matrix, lift, matrix.middle[i] + 1, matrix.ends[i])))


@kernel
def sweep(matrix, step, lift, swept, product):
    """Write (I + L)⁻¹ (p − t), (n, 3), which is q − t, and p · q, (1, 3)."""
    first, total = 0, (0.0, 0.0, 0.0)
    for i in range(len(step)):
        p, t = wide(row(step, i)), wide(row(lift, i))
        rest = minus(minus(p, t), _sum(matrix, swept, first, matrix.middle[i]))
        put(swept, i, rest)
        total = plus(total, mul(p, plus(rest, t)))
        first = matrix.ends[i]
    put(product, 0, total)


@kernel
def advance(x, residual, lift, swept, length, size):
    """Go a step of lengths (1, 3): x and residual change by its t and q. Write the new residual's square, (1, 3)."""
    by, total = row(length, 0), (0.0, 0.0, 0.0)
    for i in range(len(x)):
        t = wide(row(lift, i))
        put(x, i, plus(wide(row(x, i)), mul(t, by)))
        left = minus(wide(row(residual, i)), mul(plus(wide(row(swept, i)), t), by))
        put(residual, i, left)
        total = plus(total, mul(left, left))
    put(size, 0, total)


@part
def _sum(matrix, x, start, stop):
    """Sum of the elements from `start` to `stop` times the x of their columns."""
    total = (0.0, 0.0, 0.0)
    for k in range(start, stop):
        total = plus(total, times(wide(row(x, matrix.column[k])), np.float64(matrix.value[k])))
    return total
