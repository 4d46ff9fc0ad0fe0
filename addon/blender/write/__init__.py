"""Writes baked light into meshes."""
