"""Instances of every kind."""

import bpy
import numpy as np

from ..registry import case
from ..stage import mesh, nodes, put, quad
from .stage import GROUP, modified, plate, red, shaded_room


def scattered(original, n, size, attribute=""):
    """A grid of n × n instances of an object by geometry nodes; `attribute` names a colour of each by its place."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = ("GeometryNodeMeshGrid", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo", "NodeGroupOutput")
    grid, points, info, end = (group.nodes.new(kind) for kind in kinds)
    for name, value in (("Size X", size), ("Size Y", size), ("Vertices X", n), ("Vertices Y", n)):
        grid.inputs[name].default_value = value
    info.inputs["Object"].default_value = original
    group.links.new(grid.outputs["Mesh"], points.inputs["Points"])
    group.links.new(info.outputs["Geometry"], points.inputs["Instance"])
    instances = points.outputs["Instances"]
    if attribute:
        store, place = (group.nodes.new(f"GeometryNode{kind}") for kind in ("StoreNamedAttribute", "InputPosition"))
        store.data_type, store.domain, store.inputs["Name"].default_value = "FLOAT_COLOR", "INSTANCE", attribute
        group.links.new(instances, store.inputs["Geometry"])
        group.links.new(place.outputs[0], next(one for one in store.inputs if one.name == "Value" and one.enabled))
        instances = store.outputs[0]
    group.links.new(instances, end.inputs[0])
    holder = put("Holder", bpy.data.meshes.new("Holder"))
    modified(holder, "NODES", node_group=group)


@case("Geometry nodes: instances on points", GROUP)
def geometry_nodes():
    # A grid of 3 × 3 plates of another object, which is itself hidden in renders.
    shaded_room()
    original = plate(0.22)
    original.hide_render = True
    scattered(original, 3, 1.4)


def read_by_instances(kind, output, **properties):
    """Plates on the floor that are as bright as what a node reads of each instance, under a lamp near a corner."""
    shaded_room(at=(0.6, 0.6, -0.5))
    tree = nodes("Read")
    node = tree.add(kind, **properties)
    original = quad(
        "Shape",
        (0, 0, -1.9),
        (0.4, 0, 0),
        (0, 0.4, 0),
        tree.done(tree.add("BsdfDiffuse", {"Color": node.outputs[output]})),
    )
    original.hide_render = True
    return original


@case("Instances coloured by an attribute of theirs", GROUP)
def instance_attributes():
    # Red along x, green along y.
    original = read_by_instances("Attribute", "Color", attribute_type="INSTANCER", attribute_name="place")
    scattered(original, 3, 2, "place")


@case(
    "Instances with random colours (Object Info)", GROUP, since=(5, 2)
)  # whose random numbers are others than those of 4.5
def instance_random():
    scattered(read_by_instances("ObjectInfo", "Random"), 3, 2)


@case("Geometry nodes: a mesh with a material", GROUP)
def geometry_nodes_material():
    # A cone made by nodes, and painted by them.
    shaded_room()
    group = bpy.data.node_groups.new("Make", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    kinds = ["GeometryNodeMeshCone", "GeometryNodeSetMaterial", "NodeGroupOutput"]
    cone, paint, end = (group.nodes.new(kind) for kind in kinds)
    cone.inputs["Radius Bottom"].default_value, cone.inputs["Depth"].default_value = 0.9, 0.3
    paint.inputs["Material"].default_value = red()
    group.links.new(cone.outputs["Mesh"], paint.inputs["Geometry"])
    group.links.new(paint.outputs["Geometry"], end.inputs[0])
    modified(put("Holder", bpy.data.meshes.new("Holder")), "NODES", node_group=group)


@case("Collection instance", GROUP)
def collection_instance():
    # Two instances of a collection that the scene does not have.
    shaded_room()
    collection = bpy.data.collections.new("Set")
    shape = plate(0.4)
    bpy.context.scene.collection.objects.unlink(shape)
    collection.objects.link(shape)
    for x in (-0.7, 0.7):
        instance = put("Instance", None)
        instance.instance_type, instance.instance_collection = "COLLECTION", collection
        instance.location, instance.scale = (x, 0, 0), (1, 2, 1)


@case("Instances on faces", GROUP)
def face_instances():
    # One small plate a face of the carrier, which renders do not show.
    shaded_room()
    x, y = np.meshgrid(np.linspace(-1, 1, 4), np.linspace(-1, 1, 4))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    faces = [(4 * i + j, 4 * i + j + 1, 4 * i + j + 5, 4 * i + j + 4) for i in range(3) for j in range(3)]
    carrier = mesh("Carrier", points, faces)
    carrier.instance_type, carrier.show_instancer_for_render = "FACES", False
    carrier.show_instancer_for_viewport = False
    plate(0.25).parent = carrier


@case("Linked duplicates", GROUP)
def linked_duplicates():
    # Three objects of one mesh.
    shaded_room()
    shape = plate(0.35)
    for x in (-0.8, 0.8):
        put("Copy", shape.data).location = (x, 0, 0)
