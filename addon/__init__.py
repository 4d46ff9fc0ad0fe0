"""The engine: scene → photons → gather → output.

Rooms from low to high rank; a file imports only from its own rank or lower:

    errors, progress, parallel, knobs, settings, lightmap_settings, camera_settings, probe_settings, inspector,
    sampling, unrolling < scene < bsdf < tracers < photons < receivers < gather < output < solution < bake, camera_bake,
    camera_pass, probe_bake, refinement < blender < ui < operators < the repository's root

`bpy` and Blender's `mathutils` are imported only in `addon/blender`, `addon/ui`, `operators` and the root.
"""
