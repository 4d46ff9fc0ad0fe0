"""Shaders: what surfaces do to light.

Three stages: a shiny floor with a lamp on the left and probes where its mirror image shines; a room divided by a
screen, the lamp on the left and probes on the right; and a painted floor under a lamp, for what is matte.
"""

from . import broad, gloss, layered, normals, see_through, shaders, unseen, unsupported

__all__ = ["broad", "gloss", "layered", "normals", "see_through", "shaders", "unseen", "unsupported"]
