"""The lobes that a material may be the sum of."""

from enum import IntEnum


class Lobe(IntEnum):
    """A way to scatter light."""

    DIFFUSE = 0
    TRANSLUCENT = 1
    GLOSSY = 2
    GLASS = 3


ALL = tuple(Lobe)
