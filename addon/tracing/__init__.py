"""How a ray finds a surface: one protocol, and the tracers that keep it."""

from .protocol import Hits, RayKind, Tracer, seen_by
from .transparency import LightTracer

__all__ = ["Hits", "LightTracer", "RayKind", "Tracer", "seen_by"]
