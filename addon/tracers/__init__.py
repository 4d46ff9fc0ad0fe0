"""How a ray finds a surface: one protocol, and the tracers that keep it."""

from .protocol import Hits, Tracer

__all__ = ["Hits", "Tracer"]
