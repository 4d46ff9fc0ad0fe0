"""What the cases are built from: rooms, probes, lamps and node trees.

A change here changes the scenes, and so asks for new references of all cases that use what changed.
"""

from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Vector

SIDES = {
    "Left": ((-1, 0, 0), (0.6, 0.12, 0.1)),
    "Right": ((1, 0, 0), (0.12, 0.5, 0.15)),
    "Front": ((0, -1, 0), (0.6, 0.6, 0.6)),
    "Back": ((0, 1, 0), (0.6, 0.6, 0.6)),
    "Floor": ((0, 0, -1), (0.6, 0.6, 0.6)),
    "Ceiling": ((0, 0, 1), (0.6, 0.6, 0.6)),
}
"""Where the walls of the room are, as unit vectors, and their base colours."""

HALF = 2.0
"""Half the side of the room, m."""


class Nodes:
    """The node tree of a material, world or lamp, emptied."""

    def __init__(self, block):
        if bpy.app.version < (5, 0, 0) or (isinstance(block, bpy.types.Light) and bpy.app.version < (5, 2, 0)):
            block.use_nodes = True
        self.block, self.tree = block, block.node_tree
        self.tree.nodes.clear()

    def add(self, kind, inputs=None, **properties):
        """A node of a kind, with values or sockets as inputs."""
        node = self.tree.nodes.new("ShaderNode" + kind)
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            self.feed(node.inputs[key], value)
        return node

    def feed(self, socket, value):
        """Give a socket a value, or link it to a node's first output or to an output."""
        if isinstance(value, bpy.types.Node):
            value = value.outputs[0]
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1)
        else:
            socket.default_value = value

    def done(self, surface, output="OutputMaterial"):
        """Make a node the surface; returns what the tree belongs to."""
        self.feed(self.add(output).inputs["Surface"], surface)
        return self.block


def nodes(name="Feature"):
    """The empty node tree of a new material."""
    return Nodes(bpy.data.materials.new(name))


def shader(kind, inputs=None, name="Feature", **properties):
    """A material of one node."""
    tree = nodes(name)
    return tree.done(tree.add(kind, inputs, **properties))


def matte(color, name="Matte"):
    """A Lambertian material."""
    return shader("BsdfDiffuse", {"Color": color}, name)


def glow(color, strength, name="Glow"):
    """A material that emits and reflects nothing."""
    return shader("Emission", {"Color": color, "Strength": strength}, name)


def tinted(make: Callable):
    """A matte material whose colour is the node or socket that `make` adds to its tree."""
    tree = nodes()
    return tree.done(tree.add("BsdfDiffuse", {"Color": make(tree)}))


def put(name, data):
    """An object in the scene."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def mesh(name, vertices, faces, material=None):
    """A mesh object in the scene."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(map(float, v)) for v in vertices], [], [tuple(map(int, f)) for f in faces])
    data.update()
    if material is not None:
        data.materials.append(material)
    return put(name, data)


def quad(name, center, u, v, material=None):
    """A rectangle of sides 2u and 2v that faces along u × v, with a UV map that spans it."""
    center, u, v = (np.array(x, float) for x in (center, u, v))
    corners = [center - u - v, center + u - v, center + u + v, center - u + v]
    obj = mesh(name, corners, [(0, 1, 2, 3)], material)
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    return obj


def box(name, center, half, material=None):
    """A closed box that faces outward."""
    signs = np.array([(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return mesh(name, np.array(center) + signs * np.array(half), faces, material)


def cloud(name, material, density, n=32, low=(-1, -1, -1), high=(1, 1, 1)):
    """A volume object whose grid has the node that `density` makes of a tree and of x, y and z, in n voxels a side."""
    tree = Nodes.__new__(Nodes)
    tree.block = tree.tree = group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    place = tree.add("SeparateXYZ", {0: group.nodes.new("GeometryNodeInputPosition")})
    cube = group.nodes.new("GeometryNodeVolumeCube")
    for key, value in {"Min": low, "Max": high, **{f"Resolution {axis}": n for axis in "XYZ"}}.items():
        tree.feed(cube.inputs[key], value)
    tree.feed(cube.inputs["Density"], density(tree, *place.outputs))
    made = group.nodes.new("GeometryNodeSetMaterial")
    made.inputs["Material"].default_value = material
    tree.feed(made.inputs["Geometry"], cube)
    tree.feed(group.nodes.new("NodeGroupOutput").inputs[0], made)
    data = bpy.data.volumes.new(name)
    data.materials.append(material)
    obj = put(name, data)
    obj.modifiers.new("Made", "NODES").node_group = group
    return obj


def room(without=(), paint=None, dim=1.0):
    """The walls, a quad each, facing inward.

    Parameters
    ----------
    without : names of the sides that are open
    paint : material by name of the side that has it
    dim : factor on the base colours of the others
    """
    for name, (side, color) in SIDES.items():
        if name in without:
            continue
        side = np.array(side, float)
        u = np.array([0.0, 1, 0]) if side[0] else np.array([1.0, 0, 0])
        material = (paint or {}).get(name) or matte(np.array(color) * dim, name)
        quad(name, side * HALF, u * HALF, np.cross(-side, u) * HALF, material)


def probes(sides="Left Right Front Back Floor Ceiling", n=24, where=lambda p: True):
    """Tiny triangles on the walls that only camera rays see, so that they change nothing.

    The points are those of a spherical Fibonacci lattice around the room's centre that fall on one of `sides` and pass
    `where`.
    """
    k = np.arange(n)
    z, phi = 1 - (2 * k + 1) / n, k * np.pi * (3 - 5**0.5)
    ring = np.sqrt(1 - z * z)
    around = np.stack([ring * np.cos(phi), ring * np.sin(phi), z], 1)
    points = around / np.abs(around).max(axis=1, keepdims=True)
    kept = [(p, side) for p in points for side in sides.split() if np.dot(p, SIDES[side][0]) > 0.9999 and where(p)]
    vertices = []
    for p, side in kept:
        normal = -np.array(SIDES[side][0], float)
        u = np.array([0.0, 1, 0]) if normal[0] else np.array([1.0, 0, 0])
        v, foot = np.cross(normal, u), p * HALF + 0.01 * normal
        vertices += [foot - 0.002 * (u + v), foot + 0.002 * (u - v), foot + 0.002 * v]
    obj = mesh("Probes", vertices, np.arange(len(vertices)).reshape(-1, 3), matte((1, 1, 1), "Probe"))
    obj.visible_diffuse = obj.visible_glossy = obj.visible_transmission = False
    obj.visible_volume_scatter = obj.visible_shadow = False


def lamp(kind, at=(0, 0, 0), to=None, name="Lamp", scale=(1, 1, 1), **settings):
    """A lamp that shines down, or towards a point."""
    light = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(light, key, value)
    obj = put(name, light)
    obj.location, obj.scale = at, scale
    if to is not None:
        obj.rotation_euler = (Vector(to) - Vector(at)).to_track_quat("-Z", "Y").to_euler()
    return obj


def sky():
    """The empty node tree of a new world."""
    bpy.context.scene.world = bpy.data.worlds.new("World")
    return Nodes(bpy.context.scene.world)


def world(color, strength=1.0):
    """A world of one colour."""
    tree = sky()
    return tree.done(tree.add("Background", {"Color": color, "Strength": strength}), "OutputWorld")


def missing_picture():
    """An image whose file is not there."""
    image = bpy.data.images.new("Missing", 4, 4)
    image.source, image.filepath = "FILE", "//nowhere/missing.png"
    return image


def picture(pixels, name="Picture", colorspace="", byte=True):
    """An image of rows of pixels from the bottom left, (h, w, 3 or 4), packed into the file."""
    pixels = np.asarray(pixels, np.float32)
    rgba = np.ones((*pixels.shape[:2], 4), np.float32)
    rgba[..., : pixels.shape[2]] = pixels
    image = bpy.data.images.new(name, rgba.shape[1], rgba.shape[0], alpha=True, float_buffer=not byte)
    if colorspace:
        image.colorspace_settings.name = colorspace
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()
    return image
