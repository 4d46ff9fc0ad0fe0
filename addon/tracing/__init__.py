"""How a ray finds a surface: one protocol, and the tracers that keep it."""

from .protocol import Hits, Tracer
from .transparency import LightTracer

__all__ = ["Hits", "LightTracer", "Tracer"]
