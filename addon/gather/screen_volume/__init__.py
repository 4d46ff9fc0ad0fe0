"""Directional light of photons on the pixels of a camera."""
