"""Low-discrepancy points that need no state: any point of the sequence by its number."""

import numpy as np

_PLASTIC = 1.3247179572447460  # the real root of x³ = x + 1

R2_STEPS = np.array([1 / _PLASTIC, 1 / _PLASTIC**2])
"""From each point of the R₂ sequence to the next, modulo 1."""


def r2_sequence(number: np.ndarray) -> np.ndarray:
    """Points of Roberts' R₂ sequence by their numbers (n,) int: (n, 2) float32 in [0, 1).

    Additive recurrence by 1/φ and 1/φ² of the plastic number φ: successive points fill the square evenly.
    """
    points = np.mod(0.5 + np.asarray(number)[:, None] * R2_STEPS, 1.0).astype(np.float32)
    return np.minimum(points, np.float32(1 - 2**-24))
