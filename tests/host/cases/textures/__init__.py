"""Colours from textures, attributes and maths, on a floor under a lamp that lights its middle most."""

from . import images, maths, procedural

__all__ = ["images", "maths", "procedural"]
