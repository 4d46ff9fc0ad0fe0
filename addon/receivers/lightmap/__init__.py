"""Texels of lightmaps that want light: charts, coverage, and where in space they are."""
