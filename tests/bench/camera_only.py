"""Meshes that want light and change none: white, and seen by camera rays alone."""

import bpy
import numpy as np

LIFT = 1e-4
"""How far they are lifted off the surfaces under them, as a share of the diagonal of the region that they are in."""

ATTRIBUTE = "Cycles"


def camera_only_mesh(name, vertices, triangles):
    """Add an object of (v, 3) vertices in metres and (t, 3) triangles, smooth, with a colour attribute for Cycles."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(3 * len(triangles))
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(triangles, np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(triangles), 3, dtype=np.int32))
    mesh.shade_smooth()
    mesh.update(calc_edges=True)
    mesh.color_attributes.active_color = mesh.color_attributes.new(ATTRIBUTE, "FLOAT_COLOR", "POINT")
    mesh.materials.append(_white())
    obj = bpy.data.objects.new(name, mesh)
    for rays in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(obj, f"visible_{rays}", False)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


def add_probes(position, normal, size):
    """Add the object "Probes": at each position (n, 3), m, one triangle of `size` metres with its normal (n, 3)."""
    aside = np.cross(np.where(np.abs(normal[:, :1]) > 0.9, [[0, 1, 0]], [[1, 0, 0]]), normal)
    aside *= size / np.linalg.norm(aside, axis=1, keepdims=True)
    along = np.cross(normal, aside)
    corners = np.stack([position - aside - along, position + aside - along, position + along], axis=1)
    return camera_only_mesh("Probes", corners.reshape(-1, 3), np.arange(3 * len(position)).reshape(-1, 3))


def _white():
    material = bpy.data.materials.new("Probe")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = (1, 1, 1, 1)
    principled.inputs["Roughness"].default_value = 1
    principled.inputs["Specular IOR Level"].default_value = 0
    return material
