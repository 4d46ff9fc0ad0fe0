"""Lightmaps on Blender's side: UV maps made and packed, images laid out, and what a bake writes to Blender's data."""
