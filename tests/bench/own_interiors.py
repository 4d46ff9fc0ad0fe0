"""Two interiors that are hard to light: a glazed room under a picture of the sky, and a staircase of many parts.

Glazed: all light is a picture world's, and has to pass panes of glass, or curtains. Stairs: 776 objects, one panel.
"""

from itertools import product
from math import pi

import bpy
import numpy as np
from scene_parts import (
    BOX_FACES,
    ball,
    box,
    column,
    material,
    matte,
    mesh_object,
    table,
    turned_box,
    use_nodes,
    wall_with_hole,
)


def glazed():
    """A living room of 5 × 4 m behind three panes, with curtains, a polished floor and glossy furniture."""
    white, plum = matte("White", 0.8, 0.78, 0.75), matte("Plum", 0.35, 0.12, 0.2)
    polished = material("Polished", (0.35, 0.2, 0.1), roughness=0.18, specular=0.5)
    steel, lacquer = _metal("Steel", 0.9, 0.25), material("Lacquer", (0.05, 0.08, 0.1), roughness=0.1, specular=0.6)
    box("Floor", (-0.2, -0.2, -0.2), (5.2, 4.2, 0), polished)
    box("Ceiling", (-0.2, -0.2, 2.7), (5.2, 4.2, 2.9), white)
    wall_with_hole("Window Wall", 0, (-0.2, 0), (-0.2, 4.2), (0, 2.7), (0.4, 3.6, 0.5, 2.3), white)
    box("East Wall", (5, -0.2, 0), (5.2, 4.2, 2.7), plum)
    box("South Wall", (0, -0.2, 0), (5, 0, 2.7), white)
    box("North Wall", (0, 4, 0), (5, 4.2, 2.7), white)
    for i, y in enumerate((0.4, 1.48, 2.56)):
        box(f"Pane {i + 1}", (-0.11, y + 0.02, 0.5), (-0.104, y + 1.02, 2.3), _glass())
    for i, y in enumerate((1.42, 2.5)):
        box(f"Post {i + 1}", (-0.14, y, 0.5), (-0.06, y + 0.08, 2.3), white)
    for i, y in enumerate((0.3, 2.6)):
        _curtain(f"Curtain {i + 1}", (0.12, y), (1.05, 2.55))
    _furnish_glazed(plum, steel, lacquer)
    _picture_world()


def _furnish_glazed(plum, steel, lacquer):
    table("Table", (2.0, 1.4), (1.4, 0.8, 0.45), lacquer)
    ball("Bowl", (2.6, 1.8, 0.57), 0.12, steel)
    box("Sofa", (4.0, 0.8, 0.1), (4.9, 3.2, 0.45), plum)
    box("Sofa Back", (4.7, 0.8, 0.45), (4.9, 3.2, 0.9), plum)
    box("Sideboard", (1.2, 3.55, 0), (3.4, 4, 0.7), lacquer)
    for i, x in enumerate((1.5, 2.1, 2.8)):
        column(f"Vase {i + 1}", (x, 3.78), 0.07, 0.7 + 0.25 + 0.05 * i, steel if i % 2 else plum)
    turned_box("Pouf", (1.4, 0.8, 0.2), (0.5, 0.5, 0.4), 30, matte("Ochre", 0.6, 0.42, 0.15))


def stairs():
    """A stairwell of 6 × 5 m over two floors: 40 steps with 17 balusters each, rails and frames, under one panel."""
    white, oak, iron = matte("White", 0.75, 0.74, 0.7), matte("Oak", 0.45, 0.28, 0.14), _metal("Iron", 0.3, 0.45)
    box("Floor", (-0.2, -0.2, -0.2), (6.2, 5.2, 0), matte("Tiles", 0.4, 0.38, 0.36))
    box("Ceiling", (-0.2, -0.2, 5.6), (6.2, 5.2, 5.8), white)
    box("West Wall", (-0.2, -0.2, 0), (0, 5.2, 5.6), white)
    box("East Wall", (6, -0.2, 0), (6.2, 5.2, 5.6), matte("Sage", 0.35, 0.45, 0.32))
    box("South Wall", (0, -0.2, 0), (6, 0, 5.6), white)
    box("North Wall", (0, 5, 0), (6, 5.2, 5.6), white)
    panel = material("Panel", (0.8, 0.8, 0.8), roughness=1, specular=0)
    emission = next(node for node in panel.node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs
    emission["Emission Color"].default_value, emission["Emission Strength"].default_value = (1, 0.9, 0.75, 1), 12
    corners = [(x, y, 5.55) for x, y in ((2.4, 2.1), (2.4, 2.9), (3.6, 2.9), (3.6, 2.1))]
    mesh_object("Panel", corners, [(0, 1, 2, 3)], panel)
    for flight, (y, up) in enumerate(((0.3, 0.0), (3.3, 2.6))):
        _flight(flight + 1, y, up, oak, iron)
    box("Landing", (5.0, 0.3, 2.5), (6, 4.7, 2.6), oak)
    for i, (x, z) in enumerate(product(np.linspace(0.4, 5.5, 23), (3.4, 4.2))):
        box(f"Frame {i + 1}", (x, 4.97, z), (x + 0.2, 5.0, z + 0.3), oak if i % 3 else iron)
    world = bpy.context.scene.world = bpy.data.worlds.new("Dark")
    use_nodes(world)
    next(node for node in world.node_tree.nodes if node.type == "BACKGROUND").inputs["Strength"].default_value = 0


def _flight(nth, y, up, oak, iron):
    """Twenty steps of 1.4 m, each with balusters on its free side, and a rail."""
    for i in range(20):
        x = 0.4 + 0.23 * i if nth == 1 else 4.9 - 0.23 * i
        z = up + 0.13 * (i + 1)
        box(f"Step {nth}.{i + 1}", (x, y, z - 0.04), (x + 0.28, y + 1.4, z), oak)
        for k in range(17):
            at = x + 0.23 * (k + 0.5) / 17, y + (1.36 if nth == 1 else 0.04)
            column(f"Baluster {nth}.{i + 1}.{k + 1}", at, 0.004, z + 0.9, iron, n=6, bottom=z)
    (low, high) = (0.4, 5.0) if nth == 1 else (0.5, 5.1)
    rail = y + (1.36 if nth == 1 else 0.04)
    ends = [(low, up + 1.03 if nth == 1 else up + 3.6), (high, up + 3.6 if nth == 1 else up + 1.03)]
    corners = [(x, rail + side, z + lift) for x, z in ends for side in (-0.03, 0.03) for lift in (0, 0.04)]
    mesh_object(f"Rail {nth}", corners, BOX_FACES, oak)


def _glass():
    glass, new = _shader("Glass")
    if new:
        shader = new("ShaderNodeBsdfGlass")
        shader.inputs["Roughness"].default_value, shader.inputs["IOR"].default_value = 0, 1.5
        _shown(glass, new, shader)
    return glass


def _shader(name):
    """A material, and what makes its nodes; None if it has them already."""
    known = bpy.data.materials.get(name)
    if known is not None:
        return known, None
    made = bpy.data.materials.new(name)
    use_nodes(made)
    made.node_tree.nodes.clear()
    return made, made.node_tree.nodes.new


def _shown(owner, new, shader, output="Material"):
    """Show a shader."""
    owner.node_tree.links.new(shader.outputs[0], new(f"ShaderNodeOutput{output}").inputs["Surface"])


def _metal(name, reflectance, roughness):
    metal = material(name, (reflectance,) * 3, roughness=roughness, specular=0.5)
    principled = next(node for node in metal.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Metallic"].default_value = 1
    return metal


def _curtain(name, corner, size):
    """A sheet in waves that reflects a third of the light, lets a third through, and has holes for a fifth."""
    cloth, new = _shader("Curtain")
    if new:
        shaders = [new(f"ShaderNodeBsdf{kind}") for kind in ("Diffuse", "Translucent", "Transparent")]
        for shader in shaders[:2]:
            shader.inputs["Color"].default_value = (0.8, 0.77, 0.7, 1)
        whole = shaders[0]
        for other, share in zip(shaders[1:], (0.5, 0.2), strict=True):
            mix = new("ShaderNodeMixShader")
            mix.inputs[0].default_value = share
            cloth.node_tree.links.new(whole.outputs[0], mix.inputs[1])
            cloth.node_tree.links.new(other.outputs[0], mix.inputs[2])
            whole = mix
        _shown(cloth, new, whole)
    (x, y), (width, height), n = corner, size, 48
    across = np.linspace(0, 1, n + 1)
    wave = x + 0.05 * np.sin(across * 14 * pi)
    vertices = [(a, y + width * b, z) for z in (0.05, height) for a, b in zip(wave, across, strict=True)]
    faces = [(i, i + 1, i + n + 2, i + n + 1) for i in range(n)]
    mesh_object(name, vertices, faces, cloth).data.shade_smooth()


def _picture_world():
    """An overcast sky with a bright patch where the sun stands behind it, as a picture of 256 × 128 pixels."""
    width, height = 256, 128
    image = bpy.data.images.new("Overcast", width, height, float_buffer=True)
    latitudes = (np.arange(height) + 0.5) / height * pi - pi / 2
    longitudes = (np.arange(width) + 0.5) / width * 2 * pi
    theta, phi = np.meshgrid(latitudes, longitudes, indexing="ij")
    way = np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)], axis=-1)
    to_sun = np.array([0.8, 0.1, 0.59]) / np.linalg.norm([0.8, 0.1, 0.59])
    cosine = np.abs(way @ to_sun) * np.sign(way @ to_sun)
    sky = np.where(way[..., 2] > 0, 0.6 + 1.2 * way[..., 2], 0.15)[..., None] * np.array([0.75, 0.87, 1.0])
    patch = 60 * np.exp((cosine - 1) / 0.01)[..., None] * np.array([1.0, 0.9, 0.7])
    pixels = np.concatenate([sky + patch, np.ones((height, width, 1))], axis=2).astype(np.float32)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    world = bpy.context.scene.world = bpy.data.worlds.new("Overcast")
    use_nodes(world)
    world.node_tree.nodes.clear()
    new = world.node_tree.nodes.new
    picture, background = new("ShaderNodeTexEnvironment"), new("ShaderNodeBackground")
    picture.image = image
    world.node_tree.links.new(picture.outputs["Color"], background.inputs["Color"])
    _shown(world, new, background, "World")
