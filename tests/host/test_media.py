"""Blender's volumes as media: coefficients by Cycles' formulas, what is not baked by name, and the world's."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.bsdf.phase.functions import draine, fournier_forand, mie, rayleigh, rings_of
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import mixed, tree_of


def filled(kind, phase="HENYEY_GREENSTEIN", **values):
    """A cube of a material of one volume shader, and the node."""
    material, tree, _ = tree_of()
    node = volume(tree, kind, phase, **values)
    fill(tree, node)
    scenes.add_cube(material=material)
    return tree, node


def volume(tree, kind, phase="HENYEY_GREENSTEIN", **values):
    node = tree.nodes.new("ShaderNodeVolume" + kind)
    if hasattr(node, "phase"):
        node.phase = phase
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
    """Shares of Mix Shaders count; the phase function is that of both by what they scatter."""
    material, tree, _ = tree_of()
    one = volume(tree, "Scatter", Color=(1, 1, 1, 1), Density=3, Anisotropy=0.8)
    other = volume(tree, "Scatter", Color=(1, 1, 1, 1), Density=1, Anisotropy=0)
    fill(tree, mixed(tree, one, other, 0.25))
    scenes.add_cube(material=material)
    found, said = medium()
    assert said == [] and found.scattering == pytest.approx([2.5] * 3)
    assert found.anisotropy == pytest.approx(0.8 * 2.25 / 2.5, abs=2e-3)
    assert found.rings == pytest.approx(rings_of(lambda v: 0.9 * draine(0.8)(v) + 0.1 * draine(0)(v)))


def test_nothing_is_no_medium():
    filled("Scatter", Density=0)
    assert medium() == (None, [])


def in_cells(found):
    """The middles of a medium's cells in the world, and the coefficients there, (x, y, z, 3) each."""
    grid = found.density
    world_from_grid = np.linalg.inv(np.vstack([grid.grid_from_world, (0, 0, 0, 1)]))
    cells = np.moveaxis(np.indices(grid.values.shape), 0, -1) + 0.5
    return cells @ world_from_grid[:3, :3].T + world_from_grid[:3, 3], grid.values[..., None] * found.scattering


def of_object(said=None):
    """The only medium that differs from place to place."""
    (found,) = scenes.extracted(said).media.of_object.values()
    return found


def ramp(tree, socket, output="Position"):
    """Wire x of the position, or of other coordinates, to a number."""
    kind = "ShaderNodeNewGeometry" if output == "Position" else "ShaderNodeTexCoord"
    apart = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new(kind).outputs[output], apart.inputs[0])
    tree.links.new(apart.outputs["X"], socket)


def test_density_by_position_in_the_world():
    """In cells as large along each axis, of an object that is moved, turned and scaled."""
    tree, node = filled("Scatter", Color=(1, 0.5, 0.25, 1))
    ramp(tree, node.inputs["Density"])
    cube = bpy.context.scene.objects[0]
    cube.location, cube.rotation_euler, cube.scale = (3, 1, 2), (0.3, 0.2, 0.5), (1, 0.5, 0.25)
    said = []
    found = of_object(said)
    assert said == [] and sorted(found.density.values.shape) == [16, 32, 64]
    at, scattering = in_cells(found)
    assert scattering == pytest.approx(at[..., :1] * [1, 0.5, 0.25], abs=1e-4)


def test_density_by_generated_coordinates():
    """From 0 to 1 over the object's bounds."""
    tree, node = filled("Scatter", Color=(1, 1, 1, 1))
    ramp(tree, node.inputs["Density"], "Generated")
    at, scattering = in_cells(of_object())
    assert scattering[..., 0] == pytest.approx((at[..., 0] + 1) / 2, abs=1e-4)


def test_each_object_has_a_density_of_its_own():
    tree, node = filled("Scatter", Color=(1, 1, 1, 1))
    ramp(tree, node.inputs["Density"])
    cube = bpy.context.scene.objects[0]
    other = bpy.data.objects.new("Other", cube.data)
    bpy.context.scene.collection.objects.link(other)
    cube.location.x, other.location.x = 2, 5
    peaks = [found.scattering[0] for found in scenes.extracted().media.of_object.values()]
    assert sorted(peaks) == pytest.approx([3, 6], rel=0.02)


def test_a_texture_as_cycles_evaluates_it():
    """A noise gives about as much of it as the texture's mean, and differs all over."""
    tree, node = filled("Scatter", Color=(1, 1, 1, 1))
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], node.inputs["Density"])
    _, scattering = in_cells(of_object())
    assert scattering.mean() == pytest.approx(0.5, abs=0.05) and 0.02 < scattering.std() < 0.3


def test_density_in_a_flat_box():
    tree, node = filled("Scatter", Color=(1, 1, 1, 1))
    ramp(tree, node.inputs["Density"], "Generated")
    bpy.context.scene.objects[0].scale = (1, 0.01, 0.01)
    found = of_object()
    assert found.density.values.shape == (64, 1, 1)
    assert in_cells(found)[1][..., 0].ravel() == pytest.approx((np.arange(64) + 0.5) / 64, abs=1e-4)


def test_no_density_anywhere_is_no_medium():
    tree, node = filled("Scatter")
    ramp(tree, node.inputs["Density"])
    bpy.context.scene.objects[0].location.x = -5
    assert of_object() is None


def test_colors_that_differ_are_named():
    tree, node = filled("Scatter")
    ramp(tree, node.inputs["Density"], "Generated")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], node.inputs["Color"])
    said = []
    assert of_object(said) is not None
    assert said == ["Material 'Material': the color of its volume differs from place to place, and its mean is baked."]


def test_nothing_is_left_in_the_file():
    tree, node = filled("Scatter")
    ramp(tree, node.inputs["Density"])
    before = [len(bpy.data.meshes), len(bpy.data.objects), len(bpy.data.materials), len(bpy.data.scenes)]
    of_object()
    assert before == [len(bpy.data.meshes), len(bpy.data.objects), len(bpy.data.materials), len(bpy.data.scenes)]


def test_a_world_that_differs_from_place_to_place_is_named():
    scenes.add_plane("Floor")
    scenes.set_world((1, 1, 1))
    world = bpy.context.scene.world
    node = volume(world.node_tree, "Scatter")
    ramp(world.node_tree, node.inputs["Density"])
    fill(world.node_tree, node)
    said = []
    assert scenes.extracted(said).media.of_world is None
    assert said == [f"World '{world.name}': its volume is not baked, as it differs from place to place."]


@pytest.mark.parametrize(
    "kind, values, function",
    [
        ("RAYLEIGH", {}, rayleigh()),
        ("MIE", {"Diameter": 8}, mie(8)),
        ("DRAINE", {"Anisotropy": 0.4, "Alpha": 3}, draine(0.4, 3)),
        ("FOURNIER_FORAND", {"IOR": 1.2, "Backscatter": 0.05}, fournier_forand(1.2, 0.05)),
    ],
)
@pytest.mark.parametrize("shader", ["Scatter", "Coefficients"])
def test_phase_functions(shader, kind, values, function):
    filled(shader, kind, **values)
    found, said = medium()
    assert said == [] and found.rings == pytest.approx(rings_of(function), rel=1e-4, abs=1e-7)


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
