"""How a ray finds a surface: one protocol, and the tracers that keep it."""

from .light_tracer import LightTracer
from .protocol import Hits, RayKind, Tracer, seen_by

__all__ = ["Hits", "LightTracer", "RayKind", "Tracer", "seen_by"]
