"""Reads a scene out of Blender: objects, instances, and which rays see them."""
