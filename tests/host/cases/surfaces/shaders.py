"""Diffuse shaders, mixes of shaders, and materials that are something else."""

import bpy

from ..registry import case
from ..stage import lamp, matte, nodes, probes, quad, room, shader
from .stage import GROUP, diffuse, divided, mixed, painted_floor, shiny_floor, stripes


def see_through(tree):
    return tree.add("BsdfTransparent")


@case("Diffuse BSDF", GROUP)
def diffuse_bsdf():
    painted_floor(matte((0.2, 0.5, 0.8)))


@case("Mix Shader", GROUP)
def mix_shader():
    # Three quarters blue, one quarter red.
    painted_floor(mixed(lambda tree: 0.25, diffuse((0.1, 0.2, 0.9)), diffuse((0.9, 0.2, 0.1))))


@case("Mix Shader by a texture", GROUP)
def mix_shader_textured():
    def mask(tree):
        return tree.add("TexImage", image=stripes(0, 1, 1, 1, 0, 1), interpolation="Closest")

    painted_floor(mixed(mask, diffuse((0.1, 0.2, 0.9)), diffuse((0.9, 0.2, 0.1))))


@case("Mix Shader by Fresnel", GROUP, effort=6)
def mix_shader_fresnel():
    # Lacquer: a mirror coat on a dark floor, strong where light grazes.
    def fresnel(tree):
        return tree.add("Fresnel", {"IOR": 1.8})

    def gloss(tree):
        return tree.add("BsdfAnisotropic", {"Color": (1, 1, 1), "Roughness": 0.4})

    shiny_floor(mixed(fresnel, diffuse((0.05, 0.02, 0.02)), gloss), at=(-1.8, 0, -1.5), size=0.6)


@case("Mix Shader by Layer Weight", GROUP)
def mix_shader_facing():
    # Blue where seen from above, red at grazing angles.
    def facing(tree):
        return tree.add("LayerWeight", {"Blend": 0.5}).outputs["Facing"]

    painted_floor(mixed(facing, diffuse((0.1, 0.2, 0.9)), diffuse((0.9, 0.2, 0.1))))


@case("Mix Shader with transparency", GROUP)
def mix_shader_transparent():
    divided(mixed(lambda tree: 0.4, diffuse((0.8, 0.5, 0.3)), see_through))


@case("Add Shader", GROUP)
def add_shader():
    # Reflects and lets through, in other colours.
    tree = nodes()
    front = tree.add("BsdfDiffuse", {"Color": (0.2, 0.3, 0.5)})
    back = tree.add("BsdfTranslucent", {"Color": (0.6, 0.3, 0.1)})
    divided(tree.done(tree.add("AddShader", {0: front, 1: back})))


@case("Shader in a node group with inputs", GROUP)
def shader_group():
    # The colour that the group is given counts, and not its default.
    group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    inside = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(start.outputs["Color"], inside.inputs["Color"])
    group.links.new(inside.outputs[0], end.inputs["Shader"])
    tree = nodes()
    node = tree.add("Group", node_tree=group)
    tree.feed(node.inputs["Color"], (0.8, 0.2, 0.4))
    painted_floor(tree.done(node))


@case("Backfacing", GROUP)
def backfacing():
    # A screen that is dark blue on the lamp's side (its back), and white on the other.
    tree = nodes()
    back = tree.add("NewGeometry").outputs["Backfacing"]
    mix = tree.add("Mix", data_type="RGBA")
    tree.feed(mix.inputs[0], back)
    tree.feed(mix.inputs[6], (0.8, 0.8, 0.8))
    tree.feed(mix.inputs[7], (0.05, 0.1, 0.4))
    room()
    probes(n=48, where=lambda p: p[0] < -0.3)
    quad("Screen", (0, 0, 0), (0, 1.8, 0), (0, 0, 1.8), tree.done(tree.add("BsdfDiffuse", {"Color": mix.outputs[2]})))
    lamp("AREA", (-1.8, 0, 0), (0, 0, 0), size=1, energy=200)


@case("Light Path: transparent for shadow rays", GROUP)
def light_path_shadow():
    # An old trick: the screen lets a lamp's light through, and blocks all else.
    tree = nodes()
    shadow = tree.add("LightPath").outputs["Is Shadow Ray"]
    parts = {"Fac": shadow, 1: tree.add("BsdfDiffuse", {"Color": (0.6, 0.6, 0.6)}), 2: tree.add("BsdfTransparent")}
    divided(tree.done(tree.add("MixShader", parts)))


@case("Holdout", GROUP)
def holdout():
    # A floor that reflects nothing.
    painted_floor(shader("Holdout"))


@case("No material", GROUP)
def no_material():
    # 0.8 grey.
    painted_floor(matte((0, 0, 0)))
    bpy.data.objects["Floor"].data.materials.clear()


@case("A material with an empty tree", GROUP)
def empty_tree():
    # Black.
    painted_floor(nodes().block)
