"""Objects of every kind: what they are by the time that light meets them.

Most stand under a lamp and hide the floor from it, so that their outline tells; they are red, the floor is white.
"""

from . import hair, meshes, repeated, shapes

__all__ = ["hair", "meshes", "repeated", "shapes"]
