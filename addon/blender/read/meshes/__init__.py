"""Reads meshes: geometry, instances, and the vertices that take light."""
