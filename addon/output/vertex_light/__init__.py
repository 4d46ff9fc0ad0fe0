"""Vertex light finished: what was gathered at vertices and on the faces between them becomes the vertices' values.

Noise is taken out of both (`denoise`), and vertices are fitted to what somebody sees of them (`fit`, `finish`).
"""

from .denoise import denoised
from .finish import FinishedVertices, VertexSamples, finish_vertices

__all__ = ["FinishedVertices", "VertexSamples", "denoised", "finish_vertices"]
