"""Blender's volumes as media: what volume shaders say, and what it fills."""
