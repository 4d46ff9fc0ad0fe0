"""Live light in 3D views: how it is drawn over Solid shading, and what changes of Blender's data it follows."""
