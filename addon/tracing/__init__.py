"""How a ray finds a surface: one protocol, and the tracers that keep it."""

from .embree import EmbreeTracer
from .protocol import Hits, Tracer
from .transparency_tracer import TransparencyTracer

__all__ = ["EmbreeTracer", "Hits", "Tracer", "TransparencyTracer"]
