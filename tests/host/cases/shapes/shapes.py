"""Shapes that are no meshes, shapes that move, and how objects stand in a scene."""

import tempfile
from pathlib import Path

import bpy

from ..registry import case
from ..stage import box, matte, mesh, put, quad
from .stage import GROUP, modified, plate, red, shaded_room


def in_collection(obj):
    """An object moved into a collection of its own; returns what the view layer says of that."""
    collection, scene = bpy.data.collections.new("Collection"), bpy.context.scene
    scene.collection.children.link(collection)
    scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    return bpy.context.view_layer.layer_collection.children[collection.name]


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
