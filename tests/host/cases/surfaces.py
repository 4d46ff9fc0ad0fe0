"""Shaders: what surfaces do to light.

Three stages: a shiny floor with a lamp on the left and probes where its mirror image shines; a room divided by a
screen, the lamp on the left and probes on the right; and a painted floor under a lamp, for what is matte.
"""

import bpy
import numpy as np

from .registry import case
from .stage import box, glow, lamp, matte, nodes, picture, probes, put, quad, room, shader

GROUP = "Surfaces"


def shiny_floor(material, at=(-1.5, 0, -0.5), size=1.0):
    """A dark room with a floor of the material, which throws a lamp's light to the right wall and the ceiling."""
    room(paint={"Floor": material}, dim=0.5)
    probes("Right Ceiling", 60, lambda p: p[0] > 0 and p[2] > -0.5)
    lamp("AREA", at, (0.2, 0, -2), size=size, energy=200)


def divided(material, thick=0.0):
    """A room divided by a screen, or by a block of some thickness; probes see what comes through.

    What goes straight through a transparent screen is direct light, and only its bounces count.
    """
    room()
    probes(n=48, where=lambda p: p[0] > 0.3)
    if thick:
        box("Screen", (0, 0, 0), (thick / 2, 2.1, 2.1), material)
    else:
        quad("Screen", (0, 0, 0), (0, 2, 0), (0, 0, 2), material)
    lamp("AREA", (-1.8, 0, 0), (0, 0, 0), size=2.5, energy=300)


def painted_floor(material):
    """A dim room with a floor of the material, and a lamp that shines down on it."""
    room(paint={"Floor": material}, dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("AREA", (0, 0, 0.5), size=1.0, energy=100)


def principled(**inputs):
    """A material of a Principled BSDF; a name's underscores are blanks."""
    return shader("BsdfPrincipled", {key.replace("_", " "): value for key, value in inputs.items()})


def mixed(fac, first, second):
    """A material that mixes two shaders; each argument makes one socket or value of a tree."""
    tree = nodes()
    parts = {"Fac": fac(tree), 1: first(tree), 2: second(tree)}
    return tree.done(tree.add("MixShader", parts))


def diffuse(color):
    return lambda tree: tree.add("BsdfDiffuse", {"Color": color})


def see_through(tree):
    return tree.add("BsdfTransparent")


def stripes(*values):
    """Grey stripes side by side, as an image without a colour space."""
    return picture(np.repeat(np.array(values, float)[None, :, None], 3, axis=2), colorspace="Non-Color")


@case("Principled BSDF, as new", GROUP)
def principled_default():
    # On a dark base, what gloss reflects doubles the light.
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05)))


@case("Principled BSDF, matte", GROUP)
def principled_matte():
    painted_floor(principled(Base_Color=(0.7, 0.5, 0.2), Roughness=1.0, Specular_IOR_Level=0.0))


@case("Principled BSDF, roughness 0.1", GROUP, effort=3)
def principled_glossy():
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05), Roughness=0.1))


@case("Principled BSDF, high IOR", GROUP, effort=3)
def principled_ior():
    # Reflects four times what IOR 1.5 does.
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05), Roughness=0.3, IOR=2.5))


@case("Principled BSDF, full specular level", GROUP, effort=3)
def principled_specular():
    shiny_floor(principled(Base_Color=(0.05, 0.05, 0.05), Roughness=0.3, Specular_IOR_Level=1.0))


@case("Principled BSDF, specular tint", GROUP)
def principled_tint():
    # The gloss is blue.
    inputs = {"Base_Color": (0.05, 0.05, 0.05), "Roughness": 0.3, "Specular_Tint": (0.1, 0.3, 1)}
    shiny_floor(principled(Specular_IOR_Level=1.0, **inputs))


@case("Metal, mirror", GROUP, effort=6)
def metal_mirror():
    shiny_floor(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.0))


@case("Metal, roughness 0.3", GROUP, effort=6)
def metal_brushed():
    shiny_floor(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.3))


@case("Metal, roughness 1", GROUP)
def metal_rough():
    # Darker than a matte surface, and still with a direction.
    shiny_floor(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=1.0))


@case("Metal, half", GROUP, effort=4)
def metal_half():
    shiny_floor(principled(Base_Color=(0.8, 0.5, 0.2), Metallic=0.5, Roughness=0.3, Specular_IOR_Level=0.0))


@case("Metal by a texture", GROUP, effort=4)
def metal_textured():
    # Metal in stripes on a red floor.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(0, 1, 0, 1, 1, 0, 1, 1), interpolation="Closest")
    inputs = {"Base Color": (0.9, 0.2, 0.1), "Metallic": image, "Roughness": 0.2, "Specular IOR Level": 0.0}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Roughness by a texture", GROUP, effort=2)
def roughness_textured():
    # Half of the floor is a mirror.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(0.05, 0.9, 0.05, 0.9, 0.05, 0.9), interpolation="Closest")
    inputs = {"Base Color": (0.8, 0.8, 0.8), "Metallic": 1.0, "Roughness": image}
    shiny_floor(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Glossy BSDF", GROUP, effort=4)
def glossy():
    shiny_floor(shader("BsdfAnisotropic", {"Color": (0.3, 0.6, 0.9), "Roughness": 0.4}))


@case("Glossy BSDF, Beckmann", GROUP, unsupported="Feature")
def glossy_beckmann():
    shiny_floor(shader("BsdfAnisotropic", {"Color": (0.3, 0.6, 0.9), "Roughness": 0.5}, distribution="BECKMANN"))


@case("Glossy BSDFs of roughness 0.15 and 0.8, mixed", GROUP, effort=6)
def glossy_mixed():
    # A sharp red lobe and a wide blue one: the mean of their roughness would be neither.
    def glossy_of(color, roughness):
        return lambda tree: tree.add("BsdfAnisotropic", {"Color": color, "Roughness": roughness})

    shiny_floor(mixed(lambda tree: 0.6, glossy_of((0.9, 0.4, 0.1), 0.15), glossy_of((0.1, 0.5, 0.9), 0.8)))


@case("Metallic BSDF", GROUP, effort=6)
def metallic():
    inputs = {"Base Color": (0.6, 0.5, 0.2), "Edge Tint": (0.9, 0.9, 0.9), "Roughness": 0.3}
    shiny_floor(shader("BsdfMetallic", inputs))


@case("Two mirrors (light by way of both)", GROUP, effort=9)
def two_mirrors():
    # Between a mirror floor and a mirror ceiling.
    mirror = shader("BsdfAnisotropic", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.0})
    room(paint={"Floor": mirror, "Ceiling": mirror}, dim=0.5)
    probes("Right Back Front", 60)
    lamp("AREA", (-1.5, 0, -0.5), (-0.5, 0, -2), size=1, energy=200)


@case("Glass pane (Principled transmission)", GROUP, effort=12)
def principled_glass():
    divided(principled(Transmission_Weight=1.0, Roughness=0.0, Base_Color=(0.6, 0.9, 0.7)), 0.2)


@case("Rough glass pane (Principled transmission)", GROUP, effort=15)
def principled_rough_glass():
    divided(principled(Transmission_Weight=1.0, Roughness=0.4, Base_Color=(0.6, 0.9, 0.7)), 0.2)


@case("Half transmission (Principled)", GROUP, effort=4)
def principled_half_glass():
    divided(principled(Transmission_Weight=0.5, Roughness=0.2, Base_Color=(0.6, 0.9, 0.7)), 0.2)


@case("Glass BSDF", GROUP, effort=9)
def glass():
    divided(shader("BsdfGlass", {"Color": (0.7, 0.8, 0.95), "Roughness": 0.0, "IOR": 1.5}), 0.2)


@case("Glass BSDF, rough", GROUP, effort=9)
def glass_rough():
    divided(shader("BsdfGlass", {"Color": (0.7, 0.8, 0.95), "Roughness": 0.5, "IOR": 1.5}), 0.2)


@case("Glass ball (a caustic)", GROUP, effort=16)
def glass_ball():
    # The ball gathers the light of a lamp above into a bright spot.
    room(dim=0.6)
    probes("Floor", 400, lambda p: np.hypot(p[0], p[1]) < 0.3)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.6, location=(0, 0, -0.7))
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(shader("BsdfGlass", {"Roughness": 0.0, "IOR": 1.5}))
    lamp("AREA", (0, 0, 1.9), size=3.0, energy=200)


@case("Glass ball over what no light stops at (a caustic in mid-air)", GROUP, effort=24)
def glass_ball_in_mid_air():
    # The bright spot falls on probes half a metre above the floor, and through them.
    room(dim=0.6)
    probes("Floor", 400, lambda p: np.hypot(p[0], p[1]) < 0.3)
    bpy.data.objects["Probes"].location.z = 0.5
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=0.6, location=(0, 0, -0.3))
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(shader("BsdfGlass", {"Roughness": 0.0, "IOR": 1.5}))
    lamp("AREA", (0, 0, 1.9), size=3.0, energy=200)


@case("Refraction BSDF", GROUP, effort=8)
def refraction():
    divided(shader("BsdfRefraction", {"Color": (0.9, 0.7, 0.5), "Roughness": 0.2, "IOR": 1.4}, distribution="GGX"), 0.2)


@case("Translucent BSDF", GROUP)
def translucent():
    divided(shader("BsdfTranslucent", {"Color": (0.8, 0.5, 0.3)}))


@case("Transparent BSDF, coloured", GROUP)
def transparent():
    divided(shader("BsdfTransparent", {"Color": (0.9, 0.5, 0.2)}))


@case("Alpha 0.5 (Principled)", GROUP)
def alpha():
    divided(principled(Alpha=0.5, Base_Color=(0.6, 0.6, 0.6), Specular_IOR_Level=0.0))


@case("Alpha by a texture", GROUP)
def alpha_textured():
    # Holes in a third of the screen.
    tree = nodes()
    image = tree.add("TexImage", image=stripes(1, 1, 0, 1, 1, 0, 1, 1, 0), interpolation="Closest")
    inputs = {"Alpha": image, "Base Color": (0.6, 0.6, 0.6), "Specular IOR Level": 0.0}
    divided(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Alpha by a picture's own", GROUP)
def alpha_of_picture():
    # Leaves cut out of a card.
    pixels = np.ones((8, 8, 4))
    pixels[..., :3] = (0.3, 0.7, 0.2)
    pixels[2:6, 1:7, 3] = 0
    tree = nodes()
    image = tree.add("TexImage", image=picture(pixels), interpolation="Closest")
    inputs = {"Base Color": image, "Alpha": image.outputs["Alpha"], "Specular IOR Level": 0.0}
    divided(tree.done(tree.add("BsdfPrincipled", inputs)))


@case("Diffuse BSDF", GROUP)
def diffuse_bsdf():
    painted_floor(matte((0.2, 0.5, 0.8)))


@case("Diffuse BSDF, roughness 1 (Oren-Nayar)", GROUP, unsupported="Feature")
def oren_nayar():
    # The lamp grazes the floor, which throws more light back towards it than a Lambertian one.
    room(paint={"Floor": shader("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Roughness": 1.0})}, dim=0.4)
    probes("Left", 90, lambda p: p[2] > -0.95)
    lamp("AREA", (-1.8, 0, -1.4), (0.5, 0, -2), size=0.5, energy=100)


@case("Principled BSDF, diffuse roughness", GROUP, unsupported="Feature", since=(5, 0))
def principled_diffuse_roughness():
    floor = principled(Base_Color=(0.8, 0.8, 0.8), Diffuse_Roughness=1.0, Specular_IOR_Level=0.0)
    room(paint={"Floor": floor}, dim=0.4)
    probes("Left", 90, lambda p: p[2] > -0.95)
    lamp("AREA", (-1.8, 0, -1.4), (0.5, 0, -2), size=0.5, energy=100)


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


@case("Mix Shader by Layer Weight", GROUP, unsupported="Feature")
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


@case("Backfacing", GROUP, unsupported="Feature")
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


@case("Light Path: transparent for shadow rays", GROUP, unsupported="Feature")
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


def spotlit_floor():
    """A dim room with a spot without a size above the floor: only shadow rays meet such a lamp."""
    room(dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("SPOT", (0, 0, 1), energy=100, shadow_soft_size=0, spot_size=1.5, spot_blend=0)


def screen_below(material, half, hidden_from):
    """A square under the lamp that kinds of rays do not see."""
    hide(quad("Plate", (0, 0, -0.5), (half, 0, 0), (0, half, 0), material), hidden_from)


@case("An object that only the camera sees", GROUP)
def camera_only():
    # The plate would keep the lamp from the floor.
    spotlit_floor()
    screen_below(matte((0, 0, 0)), 1.0, "diffuse glossy transmission shadow")


@case("An object that only shadow rays see", GROUP)
def shadow_only():
    # The black plate keeps the lamp from part of the floor, and no bounced light from anything.
    spotlit_floor()
    screen_below(matte((0, 0, 0)), 0.7, "camera diffuse glossy transmission")


@case("An object that shadow rays do not see", GROUP)
def no_shadow_object():
    # The lamp shines through the black plate, and bounced light does not.
    spotlit_floor()
    screen_below(matte((0, 0, 0)), 1.0, "shadow")


@case("An object that diffuse rays do not see", GROUP)
def not_diffuse():
    # The white plate keeps the lamp from part of the floor, and sends no light back.
    spotlit_floor()
    screen_below(matte((0.9, 0.9, 0.9)), 0.7, "diffuse")


@case("An object that glossy rays do not see", GROUP)
def not_glossy():
    # A glowing square that a mirror floor does not show.
    mirror = shader("BsdfAnisotropic", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.0})
    room(paint={"Floor": mirror}, dim=0.5)
    probes("Right Ceiling", 60)
    quad("Emitter", (-1.5, 0, -0.5), (0, 0.8, 0), (0.8, 0, 0), glow((1, 0.8, 0.6), 10))
    hide(bpy.data.objects["Emitter"], "glossy")


def hide(obj, rays):
    """Hide an object from kinds of rays."""
    for kind in rays.split():
        setattr(obj, "visible_" + kind, False)


# What no material of ours has.


@case("Principled BSDF, coat", GROUP, unsupported="Coated")
def coat():
    inputs = {"Base Color": (0.05, 0.05, 0.05), "Roughness": 1.0, "Specular IOR Level": 0.0}
    coated = {"Coat Weight": 1.0, "Coat Roughness": 0.1, "Coat IOR": 2.0}
    shiny_floor(shader("BsdfPrincipled", {**inputs, **coated}, "Coated"))


@case("Principled BSDF, sheen", GROUP, unsupported="Velvet")
def sheen():
    inputs = {"Base Color": (0.02, 0.02, 0.02), "Roughness": 1.0, "Specular IOR Level": 0.0}
    velvet = {"Sheen Weight": 1.0, "Sheen Roughness": 0.3}
    room(paint={"Floor": shader("BsdfPrincipled", {**inputs, **velvet}, "Velvet")}, dim=0.3)
    probes("Left Right", 48)
    lamp("AREA", (-1.8, 0, -1.5), (0.5, 0, -2), size=0.5, energy=100)


@case("Principled BSDF, subsurface", GROUP, unsupported="Wax")
def subsurface():
    # A thin slab of wax lets light through.
    inputs = {"Base Color": (0.8, 0.5, 0.3), "Roughness": 1.0, "Specular IOR Level": 0.0}
    wax = {"Subsurface Weight": 1.0, "Subsurface Radius": (1, 0.5, 0.3), "Subsurface Scale": 0.5}
    divided(shader("BsdfPrincipled", {**inputs, **wax}, "Wax"), 0.1)


@case("Principled BSDF, anisotropic metal", GROUP, unsupported="Brushed")
def anisotropic():
    inputs = {"Base Color": (0.8, 0.8, 0.8), "Metallic": 1.0, "Roughness": 0.4, "Anisotropic": 0.9}
    shiny_floor(shader("BsdfPrincipled", inputs, "Brushed"))


@case("Normal map", GROUP, unsupported="Tiles")
def normal_map():
    # Leans the floor by 40° to the red wall.
    tree = nodes("Tiles")
    pixels = np.full((4, 4, 3), (0.5 - 0.5 * np.sin(0.7), 0.5, 0.5 + 0.5 * np.cos(0.7)))
    image = tree.add("TexImage", image=picture(pixels, colorspace="Non-Color"))
    bumped = tree.add("NormalMap", {"Color": image})
    floor = tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Normal": bumped}))
    room(paint={"Floor": floor}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)


@case("Bump", GROUP, unsupported="Plaster")
def bump():
    # A slope of 45° without a slope; Cycles itself bakes none, as its rays here have no differentials.
    tree = nodes("Plaster")
    height = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["Object"]})
    bumped = tree.add("Bump", {"Height": height, "Distance": 1.0})
    floor = tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8), "Normal": bumped}))
    room(paint={"Floor": floor}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)


@case("Fog in the room (volume)", GROUP, unsupported="Fog")
def volume():
    tree = nodes("Fog")
    fog = tree.add("VolumePrincipled", {"Density": 0.5})
    tree.feed(tree.add("OutputMaterial").inputs["Volume"], fog)
    painted_floor(matte((0.6, 0.6, 0.6)))
    box("Fog", (0, 0, 0), (1.9, 1.9, 1.9), tree.block)


@case("Hair Principled BSDF", GROUP, unsupported="Fur")
def hair_shader():
    painted_floor(shader("BsdfHairPrincipled", name="Fur"))


@case("Toon BSDF", GROUP, unsupported="Toon")
def toon():
    painted_floor(shader("BsdfToon", {"Color": (0.8, 0.5, 0.3), "Size": 0.3}, "Toon"))


@case("Displacement", GROUP, unsupported="Ramp")
def displacement():
    # Makes a slope of the floor, up to the green wall.
    tree = nodes("Ramp")
    tree.done(tree.add("BsdfDiffuse", {"Color": (0.8, 0.8, 0.8)}))
    height = tree.add("SeparateXYZ", {"Vector": tree.add("TexCoord").outputs["Object"]})
    moved = tree.add("Displacement", {"Height": height, "Midlevel": -2.0, "Scale": 0.4})
    tree.feed(tree.tree.get_output_node("ALL").inputs["Displacement"], moved)
    tree.block.displacement_method = "DISPLACEMENT"
    room(paint={"Floor": tree.block}, dim=0.5)
    probes("Left Right Ceiling", 32)
    lamp("AREA", (-1.5, 0, -0.5), (0.5, 0, -2), size=0.8, energy=100)


@case("A hair system", GROUP, unsupported="Lawn")
def hair():
    # Black grass on the floor.
    painted_floor(matte((0.7, 0.7, 0.7)))
    data = bpy.data.hair_curves.new("Lawn")
    roots = np.stack(np.meshgrid(np.linspace(-1, 1, 40), np.linspace(-1, 1, 40)), -1).reshape(-1, 2)
    data.add_curves([2] * len(roots))
    points = np.concatenate([np.c_[roots, np.full(len(roots), z)][:, None] for z in (-2, -1.5)], 1)
    data.position_data.foreach_set("vector", points.ravel().astype(np.float32))
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(len(roots) * 2, 0.01, np.float32))
    data.materials.append(matte((0, 0, 0), "Black"))
    put("Lawn", data)
