"""Shaders: what surfaces do to light.

Three stages: a shiny floor with a lamp on the left and probes where its mirror image shines; a room divided by a
screen, the lamp on the left and probes on the right; and a painted floor under a lamp, for what is matte.
"""

from . import (
    angles,
    anisotropy,
    bodies,
    broad,
    displaced,
    facets,
    gloss,
    layered,
    normals,
    see_through,
    shaders,
    sides,
    subsurface,
    unseen,
    unsupported,
)

__all__ = [
    "angles",
    "anisotropy",
    "bodies",
    "broad",
    "displaced",
    "facets",
    "gloss",
    "layered",
    "normals",
    "see_through",
    "shaders",
    "sides",
    "subsurface",
    "unseen",
    "unsupported",
]
