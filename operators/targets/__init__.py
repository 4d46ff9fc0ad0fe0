"""What can be baked: vertices, lightmaps, a camera, probes, and refined meshes."""
