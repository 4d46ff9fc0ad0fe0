"""Volume objects: their grids in the world, and what their materials make of them."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.media import clouds, smoke
from photon_bake.tests.host import scenes
from photon_bake.tests.host.cases.stage import cloud
from photon_bake.tests.host.shader_trees import tree_of
from photon_bake.tests.host.test_media import fill, in_cells, volume


def only_cloud(said=None):
    (found,) = scenes.extracted(said).media.clouds
    return found


def shown(kind="Principled", **values):
    """A cloud whose density is x + 2 of its own frame, from −1 to 1, and its material's tree and shader."""
    material, tree, _ = tree_of()
    node = volume(tree, kind, **values)
    fill(tree, node)
    return cloud("Cloud", material, lambda tree, x, y, z: tree.add("Math", {0: x, 1: 2}), n=24), tree, node


def check_ramp(found, in_world, factor):
    """Where the cloud is, its density is that of its own x."""
    at, scattering = in_cells(found)
    own = at @ np.linalg.inv(in_world)[:3, :3].T + np.linalg.inv(in_world)[:3, 3]
    inside = (np.abs(own) < 0.85).all(axis=-1)
    assert inside.sum() > 5000
    # Blender 4.5 moves what Volume Cube makes by less than a voxel
    assert scattering[inside][:, 0] / factor == pytest.approx(own[inside][:, 0] + 2, abs=0.09)
    assert (scattering[(np.abs(own) > 1.2).any(axis=-1)] == 0).all()


def test_a_principled_volume_takes_the_density():
    obj, _, _ = shown(Color=(0.5, 1, 1, 1), Density=3, Anisotropy=0.3)
    obj.location, obj.rotation_euler, obj.scale = (3, 1, 2), (0.3, 0.2, 0.5), (1, 0.5, 2)
    bpy.context.view_layer.update()
    said = []
    found = only_cloud(said)
    assert said == [] and found.anisotropy == pytest.approx(0.3)
    check_ramp(found, np.array(obj.matrix_world), 1.5)


def test_an_attribute_by_nodes():
    _, tree, node = shown("Scatter", Color=(1, 1, 1, 1))
    attribute, twice = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeMath")
    attribute.attribute_name, twice.operation, twice.inputs[1].default_value = "density", "MULTIPLY", 2
    tree.links.new(attribute.outputs["Fac"], twice.inputs[0])
    tree.links.new(twice.outputs[0], node.inputs["Density"])
    check_ramp(only_cloud(), np.eye(4), 2)


def test_volume_info():
    _, tree, node = shown("Scatter", Color=(1, 1, 1, 1))
    tree.links.new(tree.nodes.new("ShaderNodeVolumeInfo").outputs["Density"], node.inputs["Density"])
    check_ramp(only_cloud(), np.eye(4), 1)


def test_instances_are_clouds_of_their_own():
    obj, _, _ = shown()
    other = bpy.data.objects.new("Other", obj.data)
    bpy.context.scene.collection.objects.link(other)
    other.location.x = 5
    assert len(scenes.extracted().media.clouds) == 1  # the modifier that makes the grid is the first one's
    other.modifiers.new("Made", "NODES").node_group = obj.modifiers[0].node_group
    other.data.materials.append(obj.data.materials[0])
    lows = sorted(found.density.bounds[0][0] for found in scenes.extracted().media.clouds)
    assert lows[1] - lows[0] == pytest.approx(5, abs=1e-3)


def test_large_grids_are_baked_in_cells_of_some_voxels(monkeypatch):
    shown()
    monkeypatch.setattr(clouds, "MOST_CELLS", 3000)
    said = []
    found = only_cloud(said)
    assert found.density.values.size <= 3000
    assert said == ["Volume 'Cloud' has many voxels: it is baked in cells of 2 × 2 × 2."]


def test_textures_on_clouds_are_named():
    _, tree, node = shown("Scatter")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], node.inputs["Density"])
    said = []
    assert scenes.extracted(said).media.clouds == ()
    assert said == [
        "Material 'Material': its volume is not baked on 'Cloud', as its Noise Texture is not of the grids."
    ]


def test_a_volume_without_material_or_grids_is_nothing():
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke")))
    said = []
    assert scenes.extracted(said).media.clouds == () and said == []


def test_nothing_is_left_in_the_file():
    shown()
    kinds = ("meshes", "objects", "node_groups", "scenes", "volumes")
    before = [len(getattr(bpy.data, kind)) for kind in kinds]
    only_cloud()
    assert before == [len(getattr(bpy.data, kind)) for kind in kinds]


def test_smoke_of_a_domain(monkeypatch):
    """Its cells are over its mesh, x fastest, and its material says how dense they are."""
    material, tree, _ = tree_of()
    fill(tree, volume(tree, "Principled", Color=(1, 1, 1, 1), Density=2))
    obj = scenes.add_cube(material=material)
    obj.scale = (1, 1.5, 2)
    bpy.context.view_layer.update()
    values = np.arange(24, dtype=np.float32)
    settings = SimpleNamespace(density_grid=values, flame_grid=(), temperature_grid=(), domain_resolution=(2, 3, 4))
    monkeypatch.setattr(smoke, "_domain", lambda _: settings)
    (found,) = scenes.extracted().media.of_object.values()
    at, scattering = in_cells(found)
    i, j, k = np.indices((2, 3, 4))
    assert scattering[..., 0] == pytest.approx(2 * (i + 2 * j + 6 * k), abs=1e-4)
    assert at == pytest.approx(np.stack([i - 0.5, j - 1, k - 1.5], axis=-1), abs=1e-5)


def test_a_domain_without_smoke_is_nothing():
    material, tree, _ = tree_of()
    fill(tree, volume(tree, "Principled"))
    obj = scenes.add_cube(material=material)
    obj.modifiers.new("Smoke", "FLUID").fluid_type = "DOMAIN"
    assert set(scenes.extracted().media.of_object.values()) == {None}


def test_a_file_of_grids(tmp_path):
    obj, _, _ = shown()
    graph, path = bpy.context.evaluated_depsgraph_get(), str(tmp_path / "cloud.vdb")
    assert obj.evaluated_get(graph).data.grids.save(path)
    made = only_cloud()
    file = bpy.data.volumes.new("File")
    file.filepath = path
    file.materials.append(obj.data.materials[0])
    bpy.data.objects.remove(obj)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("File", file))
    said = []
    found = only_cloud(said)
    assert said == [] and found.density.values == pytest.approx(made.density.values, abs=1e-5)
    assert found.density.grid_from_world == pytest.approx(made.density.grid_from_world, abs=1e-4)
    file.filepath = "/nowhere/cloud.vdb"
    assert scenes.extracted(said).media.clouds == () and "is missing" in said[0]
