"""Blender's volumes as media: coefficients by Cycles' formulas, what is not baked by name, and the world's."""

import bpy
import numpy as np
import pytest
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import mixed, tree_of


def filled(kind, **values):
    """A cube of a material of one volume shader, and the node."""
    material, tree, _ = tree_of()
    node = volume(tree, kind, **values)
    fill(tree, node)
    scenes.add_cube(material=material)
    return tree, node


def volume(tree, kind, **values):
    node = tree.nodes.new("ShaderNodeVolume" + kind)
    for name, value in values.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return node


def fill(tree, node):
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])


def medium():
    """The only medium of the scene, and what was said."""
    said = []
    media = scenes.extracted(said).media
    found = [one for one in media.of_material if one is not None]
    return (found[0] if found else None), said


def check(absorption, scattering, g=0.0):
    found, said = medium()
    assert said == []
    assert found.absorption == pytest.approx(np.broadcast_to(absorption, 3), rel=1e-5, abs=1e-6)
    assert found.scattering == pytest.approx(np.broadcast_to(scattering, 3), rel=1e-5, abs=1e-6)
    assert found.anisotropy == pytest.approx(g)


def test_volume_absorption():
    filled("Absorption", Color=(0.2, 0.5, 1, 1), Density=3)
    check((2.4, 1.5, 0), 0)


def test_volume_scatter():
    filled("Scatter", Color=(0.2, 0.5, 1, 1), Density=3, Anisotropy=0.4)
    check(0, (0.6, 1.5, 3), 0.4)


def test_principled_volume():
    """σs = color · density; σa = (1 − color)(1 − √(absorption color)) · density."""
    filled("Principled", Color=(0.2, 0.5, 1, 1), Density=2, Anisotropy=-0.3, Absorption_Color=(0.25, 0, 1, 1))
    check((2 * 0.8 * 0.5, 2 * 0.5, 0), (0.4, 1, 2), -0.3)


def test_volume_coefficients():
    filled("Coefficients", Absorption_Coefficients=(1, 2, 3), Scatter_Coefficients=(0.1, 0.2, 0.3), Anisotropy=0.5)
    check((1, 2, 3), (0.1, 0.2, 0.3), 0.5)


def test_mixed_and_added():
    """Shares of Mix Shaders count; the mean cosine is that of both by what they scatter."""
    material, tree, _ = tree_of()
    one = volume(tree, "Scatter", Color=(1, 1, 1, 1), Density=3, Anisotropy=0.8)
    other = volume(tree, "Scatter", Color=(1, 1, 1, 1), Density=1, Anisotropy=0)
    fill(tree, mixed(tree, one, other, 0.25))
    scenes.add_cube(material=material)
    check(0, 2.5, 0.8 * 2.25 / 2.5)


def test_nothing_is_no_medium():
    filled("Scatter", Density=0)
    assert medium() == (None, [])


def test_what_is_not_baked_is_named():
    tree, node = filled("Scatter")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], node.inputs["Density"])
    assert medium() == (None, ["Material 'Material': its volume is not baked, as it differs from place to place."])


def test_other_phase_functions_are_named():
    _, node = filled("Scatter")
    node.phase = "MIE"
    because = "its volume is not baked, as its phase function is not Henyey and Greenstein's"
    assert medium() == (None, [f"Material 'Material': {because}."])


def test_emission_is_named():
    filled("Principled", Emission_Strength=1)
    found, said = medium()
    assert found is not None and said == ["Material 'Material': the light that its volume emits is not baked."]


def test_open_meshes_are_named():
    filled("Scatter")
    mesh = bpy.context.scene.objects[0].data
    mesh.clear_geometry()
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
    _, said = medium()
    assert len(said) == 1 and "are not closed ('Cube')" in said[0] and said[0].endswith("close their meshes.")


def test_the_world_s_medium_keeps_suns_and_sky_away():
    scenes.add_plane("Floor")
    scenes.add_lamp("SUN", "Sun", energy=3)
    scenes.add_lamp("POINT", "Point", energy=3)
    scenes.set_world((1, 1, 1))
    tree = bpy.context.scene.world.node_tree
    fill(tree, volume(tree, "Scatter", Density=0.1))
    scene = scenes.extracted()
    assert scene.media.of_world.scattering == pytest.approx([0.08] * 3) and scene.world.black
    emission = dict(zip(scene.lights.names, scene.lights.emission.max(axis=1), strict=True))
    assert emission["Sun"] == 0 and emission["Point"] > 0
