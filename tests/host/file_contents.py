"""What a file holds, to be compared before and after a bake."""

import hashlib

import bpy
import numpy as np

_VALUES = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
_OF_THE_WINDOW = {"window_managers", "screens", "workspaces", "brushes", "palettes"}
_NOT_HELD = {
    *("rna_type", "original", "preview", "bl_rna", "session_uid", "users", "tag", "is_evaluated", "is_missing"),
    *("is_updated", "is_updated_data", "hash", "cycles", "depsgraph", "view_layer", "frame_current_final", "mode"),
    *("pixels", "size", "channels", "depth", "is_dirty", "is_float", "has_data", "type", "render_slots", "resolution"),
    *("matrix_local", "matrix_world", "matrix_parent_inverse_world", "bound_box", "dimensions", "is_from_set", "info"),
    *("tool_settings", "point_cache"),
    *("frame_duration", "alpha_mode", "file_format", "bindcode", "node_tree_override", "execution_time", "is_active"),
}
"""Properties that tell of Blender's state and not of the file, or that evaluation or reading images changes."""
_DEEPEST = 3


def contents():
    """What Blender's data holds, a value for each path such as 'objects/Cube/location'; meshes by what is in them."""
    found = {}
    for kind in bpy.data.bl_rna.properties:
        if kind.type != "COLLECTION" or kind.identifier in {"all_ids", *_OF_THE_WINDOW}:  # 5.2 has all once more
            continue
        for block in getattr(bpy.data, kind.identifier):
            path = f"{kind.identifier}/{block.name_full}"
            found[path] = block.name_full
            if isinstance(block, bpy.types.Mesh):
                found |= _of_mesh(block, path)
            else:
                _walk(block, path, found, _DEEPEST)
    for obj in bpy.context.view_layer.objects:
        found[f"shown/{obj.name_full}"] = obj.mode, obj.select_get(), obj.hide_get()
    found["active"] = getattr(bpy.context.view_layer.objects.active, "name_full", "")
    return found


def differences(before, after):
    """The paths that one of two contents has not, or has with another value."""
    return sorted(path for path in before.keys() | after.keys() if before.get(path) != after.get(path))


def _walk(struct, path, found, depth):
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in _NOT_HELD:
            continue
        value = getattr(struct, name, None)
        if prop.type in _VALUES:
            found[f"{path}/{name}"] = _value(value)
        elif value is None or depth == 0:
            continue
        elif prop.type == "COLLECTION":
            found[f"{path}/{name}"] = len(value)
            for index, item in enumerate(value):
                _one(item, f"{path}/{name}/{index}", found, depth)
        else:
            _one(value, f"{path}/{name}", found, depth)


def _one(item, path, found, depth):
    """Something that is owned here, or the name of what is not."""
    if item is None:
        found[path] = None
    elif isinstance(item, bpy.types.ID) and not item.is_embedded_data:
        found[path] = item.name_full
    else:
        _walk(item, path, found, depth - 1)


def _value(value):
    return tuple(map(_value, value)) if hasattr(value, "__len__") and not isinstance(value, str | set) else repr(value)


def _of_mesh(mesh, path):
    """Digests of a mesh's geometry and of each attribute."""
    found = {f"{path}/sizes": (len(mesh.vertices), len(mesh.edges), len(mesh.polygons), len(mesh.loops))}
    found[f"{path}/slots"] = [material and material.name_full for material in mesh.materials]
    for attribute in mesh.attributes:
        if not len(attribute.data):  # no such elements, or the mesh is in edit mode
            continue
        name = next(name for name in ("vector", "color", "value") if name in attribute.data[0].bl_rna.properties)
        values = np.array([getattr(one, name) for one in attribute.data])
        digest = hashlib.sha1(values.tobytes()).hexdigest()
        found[f"{path}/attributes/{attribute.name}"] = attribute.domain, attribute.data_type, digest
    return found
