"""The engine: scene → photons → gather → output.

Rooms from low to high rank; a file imports only from its own rank or lower:

    core < settings < scene < bsdf < emitters < tracing < photons < receivers < gather < output < pipeline < blender
    < ui < operators < the repository's root

`bpy` and Blender's `mathutils` are imported only in `addon/blender`, `addon/ui`, `operators` and the root.
"""
