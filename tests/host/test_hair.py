"""Hair and points as read: how much of them there is, what they are made of, and what is wrong with them."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.scene import FibreModel, Lobe
from photon_bake.addon.scene.fibres.strands import MOST_STRANDS, MOST_TRIANGLES
from photon_bake.tests.host import scenes
from photon_bake.tests.host.cases.shapes.hair import made_by_nodes


def put(name, data):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def curves(sizes, positions, radii=None, name="Hair"):
    """A hair curves object of strands with so many points."""
    data = bpy.data.hair_curves.new(name)
    data.add_curves(sizes)
    data.position_data.foreach_set("vector", np.asarray(positions, np.float32).ravel())
    if radii is not None:
        values = np.broadcast_to(np.asarray(radii, np.float32), len(data.points)).copy()
        data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", values)
    return put(name, data)


def fur(obj, **settings):
    """A particle system of hair; returns its settings."""
    obj.modifiers.new("Fur", "PARTICLE_SYSTEM")
    particles = obj.particle_systems[0].settings
    particles.type, particles.count, particles.hair_length = "HAIR", 10, 1.0
    particles.use_close_tip = False
    for key, value in settings.items():
        setattr(particles, key, value)
    return particles


def area(scene, name="Hair"):
    """Surface of the objects of a name, m²."""
    named = np.array([one == name for one in scene.objects.names])
    return scene.areas[named[scene.object_of_triangle]].sum()


def of_tubes(length, radius):
    return pytest.approx(2 * np.pi * radius * length, rel=0.01)


def test_hair_curves_are_tubes_of_their_radius():
    curves([2, 2], [(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 3)], 0.02)
    scene = scenes.extracted(warnings := [])
    assert area(scene) == of_tubes(4, 0.02)
    assert scene.objects.fibrous.all() and scene.materials.one_sided[scene.material_of_triangle].all()
    assert warnings == []


def test_hair_curves_without_a_radius_are_a_centimetre_thick():
    curves([2], [(0, 0, 0), (0, 0, 1)])
    assert area(scenes.extracted()) == of_tubes(1, 0.005)


@pytest.mark.parametrize("radii", [0.02, np.nan, 0.0, -1.0])
def test_what_is_no_strand_is_left_out(radii):
    curves([1, 2, 2, 2], [(0, 0, 0), (0, 0, 0), (np.nan, 0, 1), (5, 5, 5), (5, 5, 5), (0, 0, 0), (0, 0, 1)], radii)
    scene = scenes.extracted(warnings := [])
    assert warnings == ["Object 'Hair' has hair that is not finite: those strands are left out."]
    if radii == 0.02:
        assert area(scene) == of_tubes(1, 0.02)
    assert np.isfinite(scene.vertices).all()


def test_no_hair_is_nothing():
    put("Hair", bpy.data.hair_curves.new("Hair"))
    put("Points", bpy.data.pointclouds.new("Points"))
    assert scenes.extracted(warnings := []).n_triangles == 0
    assert warnings == []


def test_a_million_strands_become_fewer_and_thicker():
    n = 1_000_000
    positions = np.zeros((n, 2, 3), np.float32)
    positions[:, :, 0], positions[:, 1, 2] = np.arange(n)[:, None] / 1000, 0.5
    curves([2] * n, positions, 0.001)
    scene = scenes.extracted(warnings := [])
    assert scene.n_triangles <= MOST_TRIANGLES
    assert area(scene) == of_tubes(n * 0.5, 0.001)
    assert warnings == [
        f"Object 'Hair' has 1,000,000 strands, of which {MOST_STRANDS:,} are baked, as much thicker as stand for the "
        "others."
    ]


@pytest.mark.parametrize(("children", "n"), [("NONE", 10), ("SIMPLE", 70)])
def test_particle_hair_has_as_many_strands_as_renders_show(children, n):
    obj = scenes.add_plane("Hair")
    bpy.context.view_layer.update()
    without = area(scenes.extracted())
    shape = {"radius_scale": 0.02, "tip_radius": 1.0, "display_percentage": 10}
    fur(obj, child_type=children, rendered_child_count=7, child_percent=1, **shape)
    assert area(scenes.extracted()) - without == of_tubes(n, 0.01)


def test_hair_is_shown_where_its_skin_is_not():
    obj = scenes.add_plane("Hair")
    fur(obj, radius_scale=0.02, tip_radius=1.0)
    obj.show_instancer_for_render = False
    assert area(scenes.extracted()) == of_tubes(10, 0.01)


def test_hair_that_renders_do_not_show():
    fur(scenes.add_plane("Bald"), render_type="NONE")
    fur(scenes.add_plane("Shaved"))
    bpy.data.objects["Shaved"].modifiers[0].show_render = False
    assert scenes.extracted().n_triangles == 4


def test_hair_has_the_material_of_its_system():
    obj = scenes.add_plane("Hair")
    for name in ("Skin", "Fur"):
        obj.data.materials.append(bpy.data.materials.new(name))
    fur(obj, material=2)
    scene = scenes.extracted()
    names = [scene.materials.names[i] for i in scene.material_of_triangle]
    assert (names.count("Skin"), set(names)) == (2, {"Skin", "Fur"})


def test_points_are_balls_of_their_radius():
    obj = put("Hair", bpy.data.meshes.new("Holder"))
    grid = ("MeshGrid", "", {"Vertices X": 3, "Vertices Y": 3}, {})
    made_by_nodes(obj, grid, ("MeshToPoints", "Mesh", {"Radius": 0.1}, {}))
    scene = scenes.extracted()
    assert area(scene) == pytest.approx(9 * 4 * np.pi * 0.01, rel=1e-4)
    assert scene.objects.fibrous.all()


def test_cycles_is_not_asked_what_hair_looks_like():
    obj = curves([2], [(0, 0, 0), (0, 0, 1)], 0.02)
    material, shader = scenes.add_material("Noisy")
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs["Color"], shader.inputs["Base Color"])
    obj.data.materials.append(material)
    scenes.extracted(warnings := [])
    assert len(warnings) == 1 and "the fields of its sockets are baked instead" in warnings[0]


@pytest.mark.parametrize(
    ("node", "values", "model"),
    [
        ("BsdfHairPrincipled", {}, FibreModel.CHIANG),
        ("BsdfHair", {"component": "Reflection"}, FibreModel.REFLECTION),
        ("BsdfHair", {"component": "Transmission"}, FibreModel.TRANSMISSION),
        ("BsdfTranslucent", {}, FibreModel.TRANSLUCENT),
    ],
)
def test_shaders_are_fibres_on_hair(node, values, model):
    obj = curves([2], [(0, 0, 0), (0, 0, 1)], 0.02)
    material, shader = scenes.add_material("Fur", "ShaderNode" + node)
    for key, value in values.items():
        setattr(shader, key, value)
    obj.data.materials.append(material)
    scene = scenes.extracted(warnings := [])
    assert (scene.materials.closures.kind == Lobe.FIBRE).all() and warnings == []
    assert scene.materials.closures.distribution.tolist() == [model]
    if model != FibreModel.TRANSLUCENT:
        tangents = scene.frames.corner_tangents[:, :, 2]
        np.testing.assert_allclose(tangents, np.broadcast_to((0, 0, 1), tangents.shape), atol=1e-5)


def info_material(output):
    """A matte material of what a Hair Info node says."""
    material = bpy.data.materials.new("Info")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, info = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeHairInfo")
    tree.links.new(info.outputs[output], shader.inputs["Color"])
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


@pytest.mark.parametrize(("output", "value"), [("Is Strand", 1), ("Length", 0.5), ("Thickness", 0.04)])
def test_hair_info_is_of_the_object(output, value):
    hair = curves([2, 2], [(0, 0, 0), (0, 0, 0.4), (1, 0, 0), (1, 0, 0.6)], 0.02)
    hair.data.materials.append(info_material(output))
    weight = scenes.extracted().materials.closures.weight
    assert weight.value[0] == pytest.approx([value] * 3, rel=0.02) and weight.texture[0] < 0


def test_intercept_is_the_share_of_the_length():
    hair = curves([2, 3], [(0, 0, 0), (0, 0, 1), (1, 0, 0), (1, 0, 0.5), (1, 0, 2)], 0.02)
    hair.data.materials.append(info_material("Intercept"))
    scene = scenes.extracted(warnings := [])
    texture = scene.materials.closures.weight.texture[0]
    assert texture >= 0 and warnings == []
    at = scene.arrays.corner_uvs[..., 1]
    height = scene.corners(np.arange(scene.n_triangles))[..., 2]
    first = scene.corners(np.arange(scene.n_triangles))[..., 0] < 0.5
    assert at[first] == pytest.approx(height[first], abs=0.02)
    assert at[~first] == pytest.approx(height[~first] / 2, abs=0.02)


def test_random_numbers_of_strands_are_in_the_other_coordinate():
    places = [(x, y, z) for x in range(20) for y in range(20) for z in (0.0, 0.5)]
    hair = curves([2] * 400, np.multiply(places, (0.1, 0.1, 1)), 0.01)
    hair.data.materials.append(info_material("Random"))
    random = scenes.extracted().arrays.corner_uvs[..., 0]
    assert random.mean() == pytest.approx(0.5, abs=0.05) and random.std() == pytest.approx(12**-0.5, abs=0.03)
