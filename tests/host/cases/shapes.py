"""Objects of every kind: what they are by the time that light meets them.

Most stand under a lamp and hide the floor from it, so that their outline tells; they are red, the floor is white.
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from .registry import case
from .stage import SIDES, box, lamp, matte, mesh, nodes, probes, put, quad, room

GROUP = "Shapes and objects"


def shaded_room(energy=100, at=(0, 0, 0.5)):
    """A dim room with a lamp above where the shapes are."""
    room(dim=0.6)
    probes()
    lamp("POINT", at, energy=energy, shadow_soft_size=0)


def red():
    """What the shapes are made of."""
    return matte((0.7, 0.1, 0.05), "Red")


def plate(half=0.5, at=(0, 0, 0)):
    """A red square under the lamp."""
    return quad("Shape", at, (half, 0, 0), (0, half, 0), red())


def modified(obj, kind, **settings):
    """An object with a modifier."""
    modifier = obj.modifiers.new(kind, kind)
    for key, value in settings.items():
        setattr(modifier, key, value)
    return modifier


def in_collection(obj):
    """An object moved into a collection of its own; returns what the view layer says of that."""
    collection, scene = bpy.data.collections.new("Collection"), bpy.context.scene
    scene.collection.children.link(collection)
    scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    return bpy.context.view_layer.layer_collection.children[collection.name]


def zigzag_room():
    """A room whose floor is a zigzag of steep slopes; returns the floor."""
    room(without=["Floor", "Ceiling"], dim=0.5)
    probes("Left Right Front Back", 32)
    n = 20
    x = np.linspace(-2, 2, n + 1)
    z = np.where(np.arange(n + 1) % 2, -1.7, -2.0)
    rows = np.concatenate([np.stack([x, np.full(n + 1, y), z], 1) for y in (-2, 2)])
    faces = [(i, i + 1, n + 2 + i, n + 1 + i) for i in range(n)]
    lamp("SUN", energy=3, angle=0)
    return mesh("Zigzag", rows, faces, matte((0.7, 0.7, 0.7), "Zigzag"))


@case("N-gon", GROUP)
def ngon():
    # A concave star under the lamp; a fan of triangles would fill its bays.
    shaded_room()
    k = np.arange(10)
    r = np.where(k % 2, 0.35, 1.2)
    star = np.stack([r * np.cos(k * np.pi / 5), r * np.sin(k * np.pi / 5), 0 * k], 1)
    mesh("Shape", star, [tuple(range(10))], red())


@case("Flat shading", GROUP)
def flat():
    zigzag_room()


@case("Smooth shading", GROUP)
def smooth():
    # The normals of the zigzag are nearly upright, so that it reflects more of the sun than it gets.
    zigzag_room().data.shade_smooth()


@case("Sharp edges", GROUP)
def sharp_edges():
    # Smooth, with sharp edges where its slopes meet: as flat.
    data = zigzag_room().data
    data.shade_smooth()
    data.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data.foreach_set("value", [True] * len(data.edges))


@case("Custom normals", GROUP)
def custom_normals():
    # A level floor with normals that lean by 45° to the lamp.
    room(dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("SPOT", (-1.8, 0, -1.2), (0, 0, -2), energy=100, shadow_soft_size=0, spot_size=1.0, spot_blend=0)
    data = bpy.data.objects["Floor"].data
    data.shade_smooth()
    data.normals_split_custom_set([(-0.7071, 0, 0.7071)] * len(data.loops))


@case("Negative scale", GROUP)
def negative_scale():
    # Lies to the red side; as it is modelled, to the green one.
    shaded_room()
    quad("Shape", (0.6, 0, 0), (0.5, 0, 0), (0, 1, 0), red()).scale = (-1, 1, 1)


@case("Uneven scale, turned", GROUP)
def uneven_scale():
    shaded_room()
    shape = box("Shape", (0, 0, 0), (0.3, 0.3, 0.1), red())
    shape.scale, shape.rotation_euler = (4, 1, 1), (0, 0, 0.6)


@case("A child of a turned parent (shear)", GROUP)
def sheared():
    # A long rhombus, of a third of the area of the square that its lengths alone would make.
    shaded_room()
    shape = plate(0.25)
    shape.rotation_euler = (0, 0, np.pi / 4)
    shape.parent = put("Parent", None)
    shape.parent.scale = (5, 1, 1)


@case("Parented with an inverse", GROUP)
def parent_inverse():
    # The inverse takes back what the parent moves.
    shaded_room()
    shape = plate(0.6)
    shape.parent = put("Parent", None)
    shape.parent.location = (1.5, 0, -1)
    shape.matrix_parent_inverse = Matrix.Translation((-1.5, 0, 1))


@case("Delta transform", GROUP)
def delta_transform():
    shaded_room()
    shape = plate(0.6, (0, 0, 0))
    shape.location, shape.delta_location = (1.5, 0, -1), (-1.5, 0, 1)


@case("Constraint", GROUP)
def constraint():
    # Copies the place of an empty under the lamp.
    shaded_room()
    shape = plate(0.6)
    shape.location = (1.5, 0, -1)
    constraint = shape.constraints.new("COPY_LOCATION")
    constraint.target = put("Target", None)


@case("Subdivision Surface modifier", GROUP, effort=2)
def subdivision():
    # Rounds a box to half its breadth.
    shaded_room()
    modified(box("Shape", (0, 0, -0.4), (0.8, 0.8, 0.8), red()), "SUBSURF", levels=3, render_levels=3)


@case("Mirror modifier", GROUP)
def mirror():
    shaded_room()
    modified(quad("Shape", (0.75, 0, 0), (0.65, 0, 0), (0, 1, 0), red()), "MIRROR")


@case("Array modifier", GROUP)
def array():
    shaded_room()
    shape = quad("Shape", (-1, 0, 0), (0.15, 0, 0), (0, 1, 0), red())
    settings = {"count": 5, "use_relative_offset": False, "use_constant_offset": True}
    modified(shape, "ARRAY", **settings, constant_offset_displace=(0.5, 0, 0))


@case("Solidify modifier", GROUP)
def solidify():
    # A thin sheet upright beside the lamp grows to a slab that nearly reaches it.
    shaded_room(at=(0, 0, 0))
    shape = quad("Shape", (0.9, 0, 0), (0, 0.5, 0), (0, 0, 0.5), red())
    modified(shape, "SOLIDIFY", thickness=0.7, offset=-1)


@case("Bevel modifier", GROUP, effort=2)
def bevel():
    # Takes the corners off a box under the lamp.
    shaded_room()
    modified(box("Shape", (0, 0, -0.4), (0.7, 0.7, 0.7), red()), "BEVEL", width=0.6, segments=4)


@case("Displace modifier", GROUP)
def displace():
    # Inflates a box.
    shaded_room()
    modified(box("Shape", (0, 0, -0.5), (0.3, 0.3, 0.3), red()), "DISPLACE", strength=0.7, mid_level=0)


@case("A modifier that the viewport does not show", GROUP)
def render_modifier():
    # In renders, five plates instead of one.
    shaded_room()
    shape = quad("Shape", (-1, 0, 0), (0.15, 0, 0), (0, 1, 0), red())
    settings = {"count": 5, "use_relative_offset": False, "use_constant_offset": True}
    modified(shape, "ARRAY", **settings, constant_offset_displace=(0.5, 0, 0), show_viewport=False)


@case("More subdivisions in renders", GROUP)
def render_levels():
    # A box in the viewport, a ball in renders.
    shaded_room()
    modified(box("Shape", (0, 0, -0.4), (0.8, 0.8, 0.8), red()), "SUBSURF", levels=0, render_levels=3)


@case("An object hidden in the viewport", GROUP)
def viewport_hidden():
    shaded_room()
    plate(0.8).hide_viewport = True


def into_set(objects):
    """Move objects into the scene's Background Set."""
    background = bpy.context.scene.background_set = bpy.data.scenes.new("Set")
    for obj in objects:
        bpy.context.scene.collection.objects.unlink(obj)
        background.collection.objects.link(obj)


@case("Background Set with a lamp", GROUP)
def lamp_in_set():
    shaded_room()
    into_set([obj for obj in bpy.data.objects if obj.type == "LIGHT"])


@case("Background Set with walls", GROUP)
def walls_in_set():
    shaded_room()
    into_set([bpy.data.objects[name] for name in SIDES])


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


@case("Curve with a bevel", GROUP, effort=2)
def curve():
    # A thick ring round the lamp's feet.
    shaded_room()
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.6)
    data = bpy.context.object.data
    data.bevel_depth, data.bevel_resolution = 0.25, 4
    data.materials.append(red())


@case("Curve with an extrusion and a fill", GROUP)
def curve_filled():
    shaded_room()
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.8)
    data = bpy.context.object.data
    data.dimensions, data.fill_mode, data.extrude = "2D", "BOTH", 0.2
    data.materials.append(red())


@case("Text", GROUP)
def text():
    shaded_room()
    data = bpy.data.curves.new("Text", "FONT")
    data.body, data.size, data.align_x, data.align_y, data.extrude = "MBW", 1.2, "CENTER", "CENTER", 0.15
    data.materials.append(red())
    put("Text", data)


@case("NURBS surface", GROUP, effort=2)
def surface():
    shaded_room()
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(radius=0.8, location=(0, 0, -0.5))
    bpy.context.object.data.materials.append(red())


@case("Metaballs", GROUP)
def metaballs():
    # Two balls that flow into one another.
    shaded_room()
    data = bpy.data.metaballs.new("Balls")
    data.resolution = data.render_resolution = 0.1
    for x in (-0.5, 0.5):
        element = data.elements.new()
        element.co, element.radius = (x, 0, 0), 1.0
    data.materials.append(red())
    put("Balls", data).location = (0, 0, -0.5)


@case("Shape key", GROUP)
def shape_key():
    # Half-way from a small plate to a large one.
    shaded_room()
    shape = plate(0.2)
    shape.shape_key_add(name="Basis")
    key = shape.shape_key_add(name="Wide")
    for point in key.data:
        point.co = 5 * point.co
    key.value = 0.5


@case("Armature, at the current frame", GROUP)
def armature():
    # At frame 11 the bone has moved the plate under the lamp.
    shaded_room()
    shape = plate(0.7)
    rig = put("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones.new("Bone")
    bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    shape.vertex_groups.new(name="Bone").add(range(4), 1, "REPLACE")
    modified(shape, "ARMATURE", object=rig)
    pose = rig.pose.bones["Bone"]
    for frame, y in ((1, -1.5), (11, 0)):
        pose.location = (0, y, 0)
        pose.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(11)


@case("Animated object, at the current frame", GROUP)
def animated():
    shaded_room()
    shape = plate(0.7)
    for frame, x in ((1, 3), (11, 0), (21, -3)):
        shape.location.x = x
        shape.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(11)


@case("Driver", GROUP)
def driver():
    # Its scale follows the place of another object.
    shaded_room()
    shape = plate(0.3)
    put("Handle", None).location = (2.5, 0, 0)
    for axis in (0, 1):
        curve = shape.driver_add("scale", axis)
        variable = curve.driver.variables.new()
        variable.targets[0].id, variable.targets[0].data_path = bpy.data.objects["Handle"], "location.x"
        curve.driver.type = "AVERAGE"


@case("An object linked from a library", GROUP)
def library():
    # The plate lives in another file.
    shaded_room()
    shape = plate(0.7)
    shape.name = "Elsewhere"
    path = str(Path(tempfile.mkdtemp()) / "library.blend")
    bpy.data.libraries.write(path, {shape})
    data, material = shape.data, shape.data.materials[0]
    bpy.data.objects.remove(shape)
    bpy.data.meshes.remove(data)
    bpy.data.materials.remove(material)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Elsewhere"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])


@case("A material slot of the object", GROUP)
def object_slot():
    # The mesh's slot is black, the object's is red.
    shaded_room()
    shape = quad("Shape", (0, 0, 0), (0.8, 0, 0), (0, 0.8, 0), matte((0, 0, 0)))
    shape.material_slots[0].link = "OBJECT"
    shape.material_slots[0].material = matte((0.9, 0.3, 0.1))


@case("Several materials on one mesh", GROUP)
def material_slots():
    # A box with a bright lid.
    shaded_room()
    shape = box("Shape", (0, 0, -0.5), (0.8, 0.8, 0.3), matte((0, 0, 0)))
    shape.data.materials.append(matte((0.9, 0.3, 0.1)))
    shape.data.polygons[1].material_index = 1


@case("An object hidden from renders", GROUP)
def hidden():
    shaded_room()
    plate(0.8).hide_render = True


@case("An excluded collection", GROUP)
def excluded():
    shaded_room()
    in_collection(plate(0.8)).exclude = True


@case("An indirect-only collection", GROUP)
def indirect_only():
    # The camera does not see it; light does.
    shaded_room()
    in_collection(plate(0.8)).indirect_only = True


@case("A holdout object", GROUP)
def holdout_object():
    # Black where the camera sees it; as it is where light does.
    shaded_room()
    plate(0.8).is_holdout = True


@case("A shadow catcher", GROUP)
def shadow_catcher():
    shaded_room()
    plate(0.8).is_shadow_catcher = True


@case("Loose edges and a face without area", GROUP)
def degenerate():
    # Beside a good face; nothing of them blocks light.
    shaded_room()
    square = [(-0.7, -0.7, 0), (0.7, -0.7, 0), (0.7, 0.7, 0), (-0.7, 0.7, 0)]
    line = [(1, 0, 0), (1.5, 0, 0), (1.2, 0, 0)]
    shape = mesh("Shape", square + line, [(0, 1, 2, 3), (4, 5, 6)], red())
    shape.data.edges.add(1)
    shape.data.edges[-1].vertices = (0, 6)


@case("Many triangles", GROUP)
def many_triangles():
    # A ball of 80,000.
    shaded_room()
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, radius=0.7, location=(0, 0, -0.5))
    bpy.context.object.data.materials.append(red())
    bpy.context.object.data.shade_smooth()


@case("Far from the origin", GROUP)
def far_away():
    # All of the scene, 2 km away.
    shaded_room()
    plate(0.7)
    moved = put("Moved", None)
    moved.location = (2000, 1000, 0)
    for obj in list(bpy.context.scene.objects):
        if obj is not moved:
            obj.parent = moved


@case("A scene of millimetres", GROUP)
def tiny():
    # A hundredth of the size; the lamp has a ten-thousandth of the power.
    shaded_room(energy=0.01)
    plate(0.7)
    shrunk = put("Shrunk", None)
    shrunk.scale = (0.01, 0.01, 0.01)
    for obj in list(bpy.context.scene.objects):
        if obj is not shrunk:
            obj.parent = shrunk
