"""Ways through bodies: random walks inside of objects with subsurface scattering, and which of them need none."""

from .opaque import without_thick_bodies

__all__ = ["without_thick_bodies"]
