"""Reads materials: node trees as closures, textures and expressions."""
