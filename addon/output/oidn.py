"""Intel's OpenImageDenoise."""

import importlib.util
from collections.abc import Mapping

import numpy as np

MOST_MEMORY = 1000  # MB that a filter may take for itself: with more it is hardly faster


def has_oidn() -> bool:
    """Whether the pyoidn wheel is there."""
    return importlib.util.find_spec("pyoidn") is not None


def filtered(
    kind: str,
    colour: np.ndarray,
    flags: Mapping[str, bool],
    guides: Mapping[str, np.ndarray] | None = None,
    memory: int = MOST_MEMORY,
) -> np.ndarray:
    """A picture (h, w, 3) through a filter, (h, w, 3) float32.

    Parameters
    ----------
    kind : 'RT' or 'RTLightmap'
    flags : dict of str to bool
        Of the filter.
    guides : dict of str to (h, w, 3), optional
        Further pictures that it takes, by its names for them.
    memory : int
        Megabytes that the filter may take for itself; it takes 1000 at most.

    Raises
    ------
    RuntimeError
        If OpenImageDenoise fails.
    """
    import pyoidn

    images = {name: np.ascontiguousarray(image, np.float32) for name, image in (guides or {}).items()}
    images["color"] = np.ascontiguousarray(colour, np.float32)
    images["output"] = np.empty_like(images["color"])
    with pyoidn.Device() as device:
        device.commit()
        with pyoidn.Filter(device, kind) as filter_:
            for name, image in images.items():
                filter_.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
            for name, value in flags.items():
                filter_.set_bool(name, value)
            filter_.set_int("maxMemoryMB", min(memory, MOST_MEMORY))
            filter_.commit()
            filter_.execute()
        message = device.get_error()
    if message:
        raise RuntimeError(message)
    return images["output"]
