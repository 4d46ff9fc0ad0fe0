"""How a ray finds a surface: one protocol, and the tracers that keep it."""

from .protocol import Hits, Tracer
from .transparency import TransparencyTracer

__all__ = ["Hits", "Tracer", "TransparencyTracer"]
