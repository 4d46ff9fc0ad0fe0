"""Keys by which equal contents are found again: what nodes and a mesh look like to Cycles, and at which frame."""

import os
from collections.abc import Iterator
from hashlib import blake2b
from typing import Any

import bpy
import numpy as np

from .materials.nodes import all_nodes
from .meshes.object_values import of_scene, readings_in

SAYS_NOTHING = {
    *("rna_type", "location", "location_absolute", "width", "height", "dimensions", "select", "show_options"),
    *("show_preview", "show_texture", "hide", "color", "use_custom_color", "label", "color_tag", "parent", "links"),
    *("interface", "active", "active_item", "preview", "warning_propagation", "is_icon_visible", "show_expanded"),
    *("node_preview", "original", "users", "tag", "asset_data", "animation_data", "session_uid"),
}
"""Properties of nodes and sockets that change nothing of what they compute, and those read in another way."""

VALUE_OF = {"FLOAT_VECTOR": "vector", "FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}
WIDTH_OF = {"FLOAT_VECTOR": 3, "FLOAT2": 2, "FLOAT_COLOR": 4, "BYTE_COLOR": 4, "FLOAT": 1, "INT": 1, "BOOLEAN": 1}


def tree_key(tree: "bpy.types.NodeTree") -> bytes:
    """A digest of a node tree, with the groups and images in it."""
    digest = blake2b(digest_size=20)
    for word in _words_of_tree(tree):
        digest.update(word.encode() + b"\0")
    return digest.digest()


def scene_key(block: "bpy.types.ID", scene: "bpy.types.Scene") -> tuple:
    """What a material or world reads of a scene: its frame, if it may look different at another one, and attributes."""
    nodes = list(all_nodes(block.node_tree))
    blocks = {block, block.node_tree, *(node.id_data for node in nodes)}
    sources = {node.image.source for node in nodes if getattr(node, "image", None)}
    moves = bool(sources & {"SEQUENCE", "MOVIE"}) or any(one.animation_data is not None for one in blocks)
    read = [of_scene(reading) for reading in readings_in(block.node_tree)]
    values = tuple(value.tobytes() for value in read if value is not None)
    return ((scene.frame_current, scene.frame_subframe) if moves else (), values)


def mesh_key(mesh: "bpy.types.Mesh") -> bytes:
    """A digest of a mesh's faces and attributes."""
    digest = blake2b(digest_size=20)
    vertex, start = np.empty(len(mesh.loops), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    mesh.polygons.foreach_get("loop_start", start)
    digest.update(vertex.data)
    digest.update(start.data)
    digest.update(repr((tuple(mesh.texspace_location), tuple(mesh.texspace_size))).encode())
    for attribute in mesh.attributes:
        if attribute.data_type in WIDTH_OF and len(attribute.data):
            kind = {"BOOLEAN": bool, "INT": np.int32}.get(attribute.data_type, np.float32)
            values = np.empty(len(attribute.data) * WIDTH_OF[attribute.data_type], kind)
            attribute.data.foreach_get(VALUE_OF.get(attribute.data_type, "value"), values)
            digest.update(f"{attribute.name} {attribute.domain}".encode())
            digest.update(values.data)
    return digest.digest()


def _words_of_tree(tree: "bpy.types.NodeTree") -> Iterator[str]:
    for node in tree.nodes:
        yield node.name
        yield from _words(node)
    for link in tree.links:
        ends = (link.from_node, link.from_socket, link.to_node, link.to_socket)
        yield " ".join([*(getattr(end, "identifier", "") or end.name for end in ends), str(link.is_muted)])


def _words(struct: Any, depth: int = 0) -> Iterator[str]:
    """Every property of a struct and of the structs in it."""
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in SAYS_NOTHING or name.startswith("bl_"):
            continue
        value: Any = getattr(struct, name, None)
        if prop.type == "POINTER":
            yield from _words_of_pointer(name, value, depth)
        elif prop.type == "COLLECTION":
            for one in value if depth < 5 else ():
                yield from _words(one, depth + 1)
        else:
            yield f"{name}={tuple(value) if getattr(prop, 'is_array', False) else value!r}"


def _words_of_pointer(name: str, value: Any, depth: int) -> Iterator[str]:
    if isinstance(value, bpy.types.NodeTree):
        yield from _words_of_tree(value)
    elif isinstance(value, bpy.types.Image):
        yield _image_word(value)
    elif isinstance(value, bpy.types.ID):
        yield f"{name}={value.name_full} {[tuple(row) for row in getattr(value, 'matrix_world', ())]}"
    elif value is not None and not isinstance(value, (bpy.types.Node, bpy.types.NodeSocket)) and depth < 5:
        yield from _words(value, depth + 1)


def _image_word(image: "bpy.types.Image") -> str:
    """What an image looks like: its file as it is now, or its pixels where it has none or was painted on."""
    settings = (image.source, image.alpha_mode, image.colorspace_settings.name, tuple(image.size))
    path = bpy.path.abspath(image.filepath)
    if path and os.path.exists(path) and not image.is_dirty and image.packed_file is None:
        status = os.stat(path)
        return repr((settings, path, status.st_mtime_ns, status.st_size))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return repr((settings, blake2b(pixels.data, digest_size=20).hexdigest()))
