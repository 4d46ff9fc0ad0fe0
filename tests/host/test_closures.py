"""Shader nodes as closures and channels of materials."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials.node_math import mean_fresnel
from photon_bake.addon.scene import Lobe, RayKind
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import F0, expect, mixed, read, shader, tree_of


def test_glossy():
    material, tree, show = tree_of()
    node = shader(tree, "BsdfGlossy", Color=(0.5, 0.6, 0.7), Roughness=0.4)
    node.distribution = "GGX"
    show(node)
    materials = read(material)
    expect(materials, f0=(0.5, 0.6, 0.7), f90=(0.5, 0.6, 0.7), ior=0, layer_f0=0, diffuse=0)
    expect(materials, roughness=0.4, preserves_energy=False)


def test_glass_and_refraction():
    material, tree, show = tree_of()
    show(shader(tree, "BsdfGlass", Color=(0.9, 0.8, 0.7), Roughness=0.1, IOR=1.6))
    expect(read(material), glass_reflection=(0.9, 0.8, 0.7), glass_transmission=(0.9, 0.8, 0.7), ior=1.6)
    material, tree, show = tree_of()
    show(shader(tree, "BsdfRefraction", Color=(0.9, 0.8, 0.7), IOR=1.2))
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Plane"])
    expect(read(material), glass_reflection=0, glass_transmission=(0.9, 0.8, 0.7), ior=1.2, fresnel=False)


def test_translucent():
    material, tree, show = tree_of()
    show(shader(tree, "BsdfTranslucent", Color=(0.3, 0.2, 0.1)))
    expect(read(material), translucent=(0.3, 0.2, 0.1), diffuse=0)


def test_transparent():
    material, tree, show = tree_of()
    show(shader(tree, "BsdfTransparent", Color=(0.8, 0.4, 0.2)))
    materials = read(material)
    expect(materials, coverage=0.2, tint=(1, 0.5, 0.25), diffuse=0)
    np.testing.assert_allclose((1 - materials.coverage.value) * materials.tint.value, [[0.8, 0.4, 0.2]], atol=1e-6)


def test_metallic():
    material, tree, show = tree_of()
    node = shader(tree, "BsdfMetallic", Base_Color=(0.9, 0.6, 0.3), Roughness=0.3)
    show(node)
    expect(read(material), f0=(0.9, 0.6, 0.3), f90=1, ior=0)


def test_holdout_is_black():
    material, tree, show = tree_of()
    show(tree.nodes.new("ShaderNodeHoldout"))
    expect(read(material), diffuse=0, coverage=1)


def test_mix():
    material, tree, show = tree_of()
    diffuse, translucent = (
        shader(tree, "BsdfDiffuse", Color=(0.8,) * 3),
        shader(tree, "BsdfTranslucent", Color=(0.4,) * 3),
    )
    show(mixed(tree, diffuse, translucent, 0.25))
    expect(read(material), diffuse=0.6, translucent=0.1)


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_mix_of_all_or_nothing_leaves_out_the_other(factor):
    material, tree, show = tree_of()
    unreadable = shader(tree, "BsdfDiffuse")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], unreadable.inputs["Color"])
    plain = shader(tree, "BsdfDiffuse", Color=(0.5,) * 3)
    show(mixed(tree, *((plain, unreadable) if factor == 0 else (unreadable, plain)), factor))
    materials = read(material)
    expect(materials, diffuse=0.5)
    assert not materials.closures.weight.textured


def test_negative_emission():
    material, tree, show = tree_of()
    show(shader(tree, "Emission", Color=(1.0, 0.5, 0.25), Strength=-2.0))
    expect(read(material), emission=(-2, -1, -0.5), diffuse=0)


@pytest.mark.parametrize("kind", ["RGB", "Value", "Background"])
def test_colour_in_the_place_of_a_shader_is_light(kind):
    material, tree, show = tree_of()
    node = shader(tree, kind)
    if kind == "Background":
        node.inputs["Color"].default_value, node.inputs["Strength"].default_value = (0.5, 0.25, 1, 1), 2
    else:
        node.outputs[0].default_value = (1, 0.5, 2, 1) if kind == "RGB" else 2
    show(node)
    warnings = []
    expect(read(material, warnings), emission=2 if kind == "Value" else (1, 0.5, 2), diffuse=0)
    assert not warnings


@pytest.mark.parametrize("kind", ["TexImage", "TexNoise"])
@pytest.mark.parametrize("in_group", [False, True])
def test_picture_in_the_place_of_a_shader_is_light(kind, in_group):
    """As Cycles' bake of what it emits says, a share of it mixed with a shader."""
    material, tree, show = tree_of()
    if in_group:
        group, outer = tree.nodes.new("ShaderNodeGroup"), tree
        group.node_tree = tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    node = shader(tree, kind)
    if kind == "TexImage":
        node.image = scenes.new_image(np.random.default_rng(5).uniform(0, 1, (4, 4, 4)))
    if in_group:
        tree.links.new(node.outputs["Color"], tree.nodes.new("NodeGroupOutput").inputs[0])
        tree, node = outer, group
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(node.outputs["Color" if not in_group else 0], mix.inputs[1])
    tree.links.new(shader(tree, "BsdfDiffuse").outputs[0], mix.inputs[2])
    show(mix)
    obj = scenes.add_plane(material=material)
    scene = scenes.extracted()
    rng = np.random.default_rng(1)
    u, v = rng.uniform(0, 1, (2, 4000)).astype(np.float32)
    place = rng.integers(0, 2, 4000), np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    ours = scene.look_up(scene.materials.emission, *place).mean(axis=0)
    np.testing.assert_allclose(scene.albedo(*place), 0.4, atol=1e-6)
    np.testing.assert_allclose(ours, scenes.cycles_picture(obj, "EMIT").mean(axis=(0, 1)), rtol=0.04)


def test_cut_out():
    material, tree, show = tree_of()
    leaf = shader(tree, "BsdfDiffuse", Color=(0.2, 0.6, 0.1))
    show(mixed(tree, tree.nodes.new("ShaderNodeBsdfTransparent"), leaf, 0.4))
    expect(read(material), coverage=0.4, tint=1, diffuse=(0.2, 0.6, 0.1))


def test_flames():
    """Emission added to full transparency loses neither."""
    material, tree, show = tree_of()
    glow = shader(tree, "Emission", Color=(1.0, 0.5, 0.1), Strength=3.0)
    show(mixed(tree, tree.nodes.new("ShaderNodeBsdfTransparent"), glow, kind="AddShader"))
    materials = read(material)
    expect(materials, coverage=0.5, tint=2, emission=(6, 3, 0.6))


def test_add():
    material, tree, show = tree_of()
    first, second = shader(tree, "BsdfDiffuse", Color=(0.3,) * 3), shader(tree, "BsdfGlossy", Color=(0.2,) * 3)
    show(mixed(tree, first, second, kind="AddShader"))
    expect(read(material), diffuse=0.3, f0=0.2, f90=0.2, layer_f0=0)


@pytest.mark.parametrize(("kind", "name"), [("BsdfGlossy", "f0"), ("BsdfGlass", "glass_transmission")])
def test_what_is_added_to_transparency_loses_nothing(kind, name):
    """Half of the light passes, and a shader of that colour scatters the other half: all of what does not pass."""
    material, tree, show = tree_of()
    clear, other = shader(tree, "BsdfTransparent", Color=(0.5,) * 3), shader(tree, kind, Color=(0.5,) * 3)
    show(mixed(tree, clear, other, kind="AddShader"))
    expect(read(material), coverage=0.5, tint=1, **{name: 1})


def test_gloss_that_is_added_to_itself_is_twice_as_bright():
    material, tree, show = tree_of()
    show(mixed(tree, *(shader(tree, "BsdfGlossy", Color=(0.3,) * 3) for _ in range(2)), kind="AddShader"))
    expect(read(material), f0=0.6, f90=0.6)


@pytest.mark.parametrize("kind", ["Fresnel", "LayerWeight"])
def test_gloss_over_diffuse_by_fresnel(kind):
    material, tree, show = tree_of()
    diffuse, glossy = shader(tree, "BsdfDiffuse", Color=(0.8,) * 3), shader(tree, "BsdfGlossy", Color=(0.9,) * 3)
    angle = tree.nodes.new(f"ShaderNode{kind}")
    angle.inputs[0].default_value = 1.5 if kind == "Fresnel" else 1 / 3
    show(mixed(tree, diffuse, glossy, angle.outputs[0]))
    expect(read(material), diffuse=0.8, f0=0.9 * F0, f90=0.9, ior=1.5, layer_f0=F0)


def test_glass_by_fresnel():
    material, tree, show = tree_of()
    inside, outside = (
        shader(tree, "BsdfRefraction", Color=(0.8,) * 3, IOR=1.4),
        shader(tree, "BsdfGlossy", Color=(1.0,) * 3),
    )
    fresnel = shader(tree, "Fresnel", IOR=1.4)
    show(mixed(tree, inside, outside, fresnel.outputs[0]))
    expect(read(material), f0=0, f90=0, glass_reflection=1, glass_transmission=0.8, ior=1.4, fresnel=True)


def test_window_pane_by_fresnel_is_its_mean():
    material, tree, show = tree_of()
    fresnel = shader(tree, "Fresnel", IOR=1.5)
    pane = shader(tree, "BsdfGlossy", Color=(1.0,) * 3, Roughness=0.0)
    show(mixed(tree, tree.nodes.new("ShaderNodeBsdfTransparent"), pane, fresnel.outputs[0]))
    mean = mean_fresnel(1.5)
    assert mean == pytest.approx(0.0918, abs=2e-4)
    expect(read(material), coverage=mean, f0=1, f90=1, tint=1)


@pytest.mark.parametrize(
    ("output", "sees_first"), [("Is Shadow Ray", True), ("Is Camera Ray", True), ("Is Diffuse Ray", False)]
)
def test_light_path(output, sees_first):
    material, tree, show = tree_of()
    first, second = shader(tree, "BsdfDiffuse", Color=(0.1,) * 3), shader(tree, "BsdfDiffuse", Color=(0.9,) * 3)
    path = tree.nodes.new("ShaderNodeLightPath")
    show(mixed(tree, first, second, path.outputs[output]))
    expect(read(material), diffuse=0.1 if sees_first else 0.9)


def test_sides_are_rows_of_their_own():
    material, tree, show = tree_of()
    front, back = shader(tree, "BsdfDiffuse", Color=(0.1,) * 3), shader(tree, "Emission", Strength=3.0)
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    show(mixed(tree, front, back, geometry.outputs["Backfacing"]))
    warnings = []
    materials = read(material, warnings)
    assert materials.seen_as.tolist() == [[0, 1] * 6, [1] * 12] and warnings == []
    np.testing.assert_allclose(scenes.albedo_of(materials), [[0.1] * 3, [0] * 3], atol=1e-6)
    np.testing.assert_allclose(materials.emission.value, [[0] * 3, [3] * 3], atol=1e-6)


def test_what_shadow_rays_see_is_a_row_of_its_own():
    material, tree, show = tree_of()
    path = tree.nodes.new("ShaderNodeLightPath")
    glass, nothing = tree.nodes.new("ShaderNodeBsdfGlass"), tree.nodes.new("ShaderNodeBsdfTransparent")
    show(mixed(tree, glass, nothing, path.outputs["Is Shadow Ray"]))
    warnings = []
    materials = read(material, warnings)
    expect(materials, coverage=1, glass_transmission=1)
    in_shadow = int(materials.seen_as[0, 2 * RayKind.SHADOW])
    assert set(materials.seen_as[0]) == {0, in_shadow} and materials.differs_in_shadow and warnings == []
    assert materials.coverage.value[in_shadow, 0] == 0 and not materials.differs_by_lobe


def test_says_that_rays_lengths_are_not_known():
    material, tree, show = tree_of()
    path, emission = tree.nodes.new("ShaderNodeLightPath"), shader(tree, "Emission")
    tree.links.new(path.outputs["Ray Length"], emission.inputs["Strength"])
    show(emission)
    warnings = []
    read(material, warnings)
    assert len(warnings) == 1 and "rays' lengths" in warnings[0]


def test_two_roughnesses_stay_two_closures():
    material, tree, show = tree_of()
    sharp, dull = (shader(tree, "BsdfGlossy", Color=(c,) * 3, Roughness=r) for c, r in ((0.9, 0.1), (0.3, 0.5)))
    show(mixed(tree, sharp, dull))
    warnings = []
    closures = read(material, warnings).closures
    np.testing.assert_allclose(closures.weight.value[:, 0], 0.5, atol=1e-6)
    np.testing.assert_allclose(closures.f0.value[:, 0], [0.9, 0.3], atol=1e-6)
    np.testing.assert_allclose(closures.roughness.value[:, 0], [0.1, 0.5], atol=1e-6)
    assert closures.kind.tolist() == [Lobe.GLOSSY] * 2 and not warnings


def test_nested_mixes_multiply_and_what_is_alike_adds_up():
    material, tree, show = tree_of()
    first, second, third = (
        shader(tree, "BsdfPrincipled", Base_Color=(c,) * 3, Roughness=r)
        for c, r in ((0.8, 0.3), (0.4, 0.6), (0.2, 0.3))
    )
    show(mixed(tree, mixed(tree, first, second, 0.25), third, 0.4))
    closures = read(material).closures
    order = np.lexsort((closures.weight.value[:, 0], closures.kind))
    weights = closures.weight.value[order, 0]
    np.testing.assert_allclose(weights, [0.15 * 0.4, 0.45 * 0.8 + 0.4 * 0.2, 0.15, 0.45 + 0.4], atol=1e-5)
    over = closures.roughness.value[closures.layer[order[:2]], 0]
    np.testing.assert_allclose(over, [0.6, 0.3], atol=1e-6)
    assert closures.kind[order].tolist() == [Lobe.DIFFUSE] * 2 + [Lobe.GLOSSY] * 2
    assert closures.layer[order[2:]].tolist() == [-1, -1]


def test_shader_in_a_group_with_a_muted_node():
    group_tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group_tree.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketColor")
    group_tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end = group_tree.nodes.new("NodeGroupInput"), group_tree.nodes.new("NodeGroupOutput")
    diffuse = group_tree.nodes.new("ShaderNodeBsdfDiffuse")
    mix = mixed(group_tree, diffuse, shader(group_tree, "BsdfGlossy"))
    mix.mute = True
    group_tree.links.new(start.outputs[0], diffuse.inputs["Color"])
    group_tree.links.new(mix.outputs[0], end.inputs[0])
    material, tree, show = tree_of()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = group_tree
    group.inputs["Paint"].default_value = (0.4, 0.3, 0.2, 1)
    show(group)
    expect(read(material), diffuse=(0.4, 0.3, 0.2), f0=0)


def test_empty_group_is_black():
    material, tree, show = tree_of()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    group.node_tree.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketShader")
    show(group)
    expect(read(material), diffuse=0, coverage=1)


def test_volume_alone_is_seen_through():
    material, tree, _ = tree_of()
    volume = tree.nodes.new("ShaderNodeVolumePrincipled")
    tree.links.new(volume.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    warnings = []
    expect(read(material, warnings), coverage=0, tint=1)
    assert len(warnings) == 1 and "not closed" in warnings[0]


def test_textured_factor():
    material, tree, show = tree_of()
    first, second = shader(tree, "BsdfDiffuse", Color=(0.2,) * 3), shader(tree, "BsdfGlossy", Color=(0.8,) * 3)
    mix = mixed(tree, first, second)
    pixels = np.ones((1, 2, 4))
    pixels[0, 0, :3] = 0.25
    scenes.add_image_node(material, mix.inputs[0], pixels, byte=False).image.colorspace_settings.name = "Non-Color"
    show(mix)
    materials = read(material)
    textures = materials.textures

    closures = materials.closures

    def texels(kind):
        (k,) = np.flatnonzero(closures.kind == kind)
        pixels = textures.pixels[textures.offset[closures.weight.texture[k]] :][:2, 0]
        return pixels * closures.weight.value[k, 0] * closures.f0.value[k, 0] ** (kind == Lobe.GLOSSY)

    np.testing.assert_allclose(texels(Lobe.DIFFUSE), [0.15, 0], atol=1e-4)
    np.testing.assert_allclose(texels(Lobe.GLOSSY), [0.2, 0.8], atol=1e-4)
    assert not closures.roughness.textured
