"""A room that a camera looks into."""

import bpy
from photon_bake.tests.host.scenes import add_cube, add_lamp, add_material, add_plane


def coloured(name, colour, node="ShaderNodeBsdfDiffuse", **inputs):
    """A material of one shader."""
    material, shader = add_material(name, node)
    shader.inputs["Base Color" if "Base Color" in shader.inputs else "Color"].default_value = (*colour, 1)
    for socket, value in inputs.items():
        shader.inputs[socket].default_value = value
    return material


def add_camera(scene, location=(0, -2.8, 0), rotation=(1.5708, 0, 0), **lens):
    """The scene's camera; by default it looks along y."""
    data = bpy.data.cameras.new("Camera")
    for name, value in lens.items():
        setattr(data, name, value)
    camera = bpy.data.objects.new("Camera", data)
    camera.location, camera.rotation_euler = location, rotation
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def build_room(scene, size=(48, 32)):
    """A red wall and a green one, a white floor, back and ceiling, and a box; open to the camera."""
    scene.render.resolution_x, scene.render.resolution_y = size
    white, red, green = (
        coloured(name, colour)
        for name, colour in (("White", (0.8, 0.8, 0.8)), ("Red", (0.7, 0.1, 0.1)), ("Green", (0.1, 0.6, 0.2)))
    )
    walls = {
        "Floor": ((0, 0, -1), (0, 0, 0), white),
        "Ceiling": ((0, 0, 1), (3.1416, 0, 0), white),
        "Back": ((0, 1, 0), (1.5708, 0, 0), white),
        "Left": ((-1, 0, 0), (0, 1.5708, 0), red),
        "Right": ((1, 0, 0), (0, -1.5708, 0), green),
    }
    for name, (location, rotation, material) in walls.items():
        wall = add_plane(name, material=material)
        wall.location, wall.rotation_euler = location, rotation
    box = add_cube("Box", material=white)
    box.location, box.scale, box.rotation_euler = (-0.35, 0.3, -0.65), (0.3, 0.3, 0.35), (0, 0, 0.4)
    add_lamp("AREA", location=(0, 0, 0.95), energy=30, size=0.5)
    return add_camera(scene)


def add_fog(scene, size=0.98, **inputs):
    """A cube of a scattering medium in the room, with as many volume bounces as others."""
    scene.cycles.volume_bounces = 32
    material = bpy.data.materials.new("Fog")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, shader = (tree.nodes.new(name) for name in ("ShaderNodeOutputMaterial", "ShaderNodeVolumeScatter"))
    for name, value in inputs.items():
        shader.inputs[name].default_value = value
    tree.links.new(shader.outputs[0], output.inputs["Volume"])
    fog = add_cube("Fog", material=material)
    fog.scale = (size, size, size)
    return fog


def add_ball(name, location, radius, material):
    """A smooth ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=radius, location=location)
    ball = bpy.context.object
    ball.name = name
    ball.data.shade_smooth()
    ball.data.materials.append(material)
    return ball
