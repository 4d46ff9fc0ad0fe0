"""Vertex light finished: what was gathered at vertices and on the faces between them becomes the vertices' values.

Samples that nobody sees are told from others (`say`), and vertices are fitted to the rest (`fit`).
"""

from .finish import FinishedVertices, VertexSamples, finish_vertices

__all__ = ["FinishedVertices", "VertexSamples", "finish_vertices"]
