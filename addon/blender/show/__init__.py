"""Baked light shown in materials, and taken out again without trace.

    use_baked_light(scene, layers)    # materials add base color × baked light; bounces that the bake replaces are off
    set_levels(scene, layers, strength, shows)                                                      # live
    leave_baked_light()               # everything as it was

Behind each Principled, Diffuse, Translucent and Subsurface Scattering BSDF stands a group node. What they add is
computed by one node group for the whole file, *Photon Bake Light*: a sum over `Layer`s of strength × color × light,
each from a color attribute or from a lightmap.

| File | Its subject |
|---|---|
| layers.py | `Layer`: one kind of light with its level |
| light_group.py, shader_group.py, tree_builder.py | the two node groups |
| sheets.py | lightmaps of any number of objects behind one image node |
| insertion.py, stand_ins.py | groups in node trees; materials for what has none |
| scene_settings.py, solid_view.py | bounces and viewports, set and restored |
| baked_light.py | all of it together |
| removal.py | lightmaps taken out of the file |
"""

from .baked_light import has_layers, is_shown, leave_baked_light, set_levels, use_baked_light
from .layers import Layer, LightSource
from .removal import remove_lightmaps

__all__ = [
    "Layer",
    "LightSource",
    "has_layers",
    "is_shown",
    "leave_baked_light",
    "remove_lightmaps",
    "set_levels",
    "use_baked_light",
]
