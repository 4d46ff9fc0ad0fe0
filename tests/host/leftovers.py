"""All that a file and Blender know, to be compared before and after."""

import bpy

_OWN = {"rna_type", "bl_rna", "original", "session_uid", "id_data", "is_evaluated"}


def snapshot(folder=None):
    """Data-blocks with users, fake users and custom properties, node trees, settings, handlers, views and files."""
    return {
        "blocks": blocks(),
        "trees": {m.name: dump(m.node_tree) for m in bpy.data.materials if m.node_tree},
        "groups": {g.name: dump(g) for g in bpy.data.node_groups},
        "meshes": {mesh.name: of_mesh(mesh) for mesh in bpy.data.meshes},
        "slots": {
            o.name: [(s.link, s.material and s.material.name) for s in o.material_slots] for o in bpy.data.objects
        },
        "scenes": {scene.name: of_scene(scene) for scene in bpy.data.scenes},
        "handlers": handlers(),
        "views": views(),
        "files": sorted(str(path.relative_to(folder)) for path in folder.rglob("*")) if folder else [],
    }


def differences(before, after):
    """What differs between two snapshots, as short words."""
    found = []
    for part, was in before.items():
        now = after[part]
        if isinstance(was, dict):
            found += [
                f"{part} {key}: {was.get(key)} → {now.get(key)}" for key in {*was, *now} if was.get(key) != now.get(key)
            ]
        elif was != now:
            found.append(f"{part}: {was} → {now}")
    return found


def blocks():
    found = {}
    for kind in dir(bpy.data):
        collection = getattr(bpy.data, kind)
        if isinstance(collection, bpy.types.bpy_prop_collection) and kind not in {"libraries", "screens", "workspaces"}:
            for block in collection:
                found[kind, block.name] = (block.users, block.use_fake_user, keys_of(block))
    return found


def keys_of(block):
    """Names of custom properties; what add-ons' settings are kept in does not count."""
    return sorted(key for key in block.keys() if key not in {"cycles", "photon_bake", "cycles_visibility"})  # noqa: SIM118


def dump(tree):
    """All that a node tree says: nodes with their settings and sockets, and links."""
    nodes = {}
    for node in tree.nodes:
        sockets = [(s.identifier, value_of(s), s.hide) for s in [*node.inputs, *node.outputs]]
        settings = {
            name: repr(getattr(node, name))
            for name in node.bl_rna.properties.keys()  # noqa: SIM118
            if name not in {"inputs", "outputs", "internal_links", "rna_type"}
        }
        nodes[node.name] = (settings, sockets, sorted(node.keys()))
    links = sorted(
        (a.from_node.name, a.from_socket.identifier, a.to_node.name, a.to_socket.identifier, a.is_muted)
        for a in tree.links
    )
    return nodes, links, tree.nodes.active.name if tree.nodes.active else None


def value_of(socket):
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def of_mesh(mesh):
    return (
        [one.name for one in mesh.uv_layers],
        mesh.uv_layers.active and mesh.uv_layers.active.name,
        [one.name for one in mesh.uv_layers if one.active_render],
        sorted((one.name, one.domain, one.data_type) for one in mesh.attributes),
        mesh.attributes.active_color_name,
        mesh.attributes.default_color_name,
        [material and material.name for material in mesh.materials],
    )


def of_scene(scene):
    owners = {"render": scene.render, "eevee": scene.eevee, "cycles": getattr(scene, "cycles", None)}
    owners["rays"] = getattr(scene.eevee, "ray_tracing_options", None)
    return {name: plain_values(owner) for name, owner in owners.items() if owner is not None}


def plain_values(owner):
    values = {}
    for prop in owner.bl_rna.properties:
        if prop.type in {"BOOLEAN", "INT", "FLOAT", "ENUM", "STRING"} and prop.identifier not in _OWN:
            value = getattr(owner, prop.identifier)
            values[prop.identifier] = tuple(value) if getattr(prop, "is_array", False) else value
    return values


def handlers():
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    return {name: [str(one) for one in listed] for name, listed in lists.items() if isinstance(listed, list)}


def views():
    spaces = [s for screen in bpy.data.screens for area in screen.areas for s in area.spaces if s.type == "VIEW_3D"]
    return [space.shading.color_type for space in spaces], [sorted(screen.keys()) for screen in bpy.data.screens]
