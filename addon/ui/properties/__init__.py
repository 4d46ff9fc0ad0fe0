"""Settings on the scene and on objects, as Blender properties."""
