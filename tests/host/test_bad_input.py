"""Input that cannot be baked ends with one sentence that names it."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import bake_objects, receiver_meshes
from photon_bake.addon.core.errors import BakeError
from photon_bake.tests.host import scenes


def assert_refused(match, names=None):
    graph = scenes.depsgraph()
    with pytest.raises(BakeError, match=match) as error:
        receiver_meshes(bake_objects(graph, names), graph)
    assert "\n" not in str(error.value)
    assert str(error.value).endswith(".")


def test_no_meshes():
    scenes.add_lamp("POINT")
    assert_refused("Nothing to bake")


def test_no_mesh_that_can_be_baked():
    scenes.add_mesh("Hollow", [], [])
    assert_refused("Nothing to bake: .*'Hollow' has no faces")


def test_no_names():
    assert_refused("Nothing to bake", [])


def test_bad_name():
    scenes.add_cube()
    assert_refused("no object 'Kube'", ["Cube", "Kube"])


def test_not_a_mesh():
    scenes.add_lamp("POINT", "Lamp")
    assert_refused("'Lamp' is not a mesh", ["Lamp"])


def test_empty_mesh():
    scenes.add_mesh("Points", [(0, 0, 0)], [])
    assert_refused("'Points' has no faces", ["Points"])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_coordinates_that_are_not_finite(bad):
    scenes.spoil(scenes.add_cube("Broken"), bad)
    assert_refused("'Broken'.*finite", ["Broken"])
    scenes.add_cube("Whole")
    warnings, graph = [], scenes.depsgraph()
    meshes = receiver_meshes(bake_objects(graph), graph, warnings, all_of_them=False)
    assert [mesh.object_name for mesh in meshes] == ["Whole"]
    assert "Left out: Object 'Broken'" in warnings[0]


@pytest.mark.parametrize("scale", [(0, 1, 1), (0, 0, 0), (1, 1, 0)])
def test_zero_scale(scale):
    scenes.add_cube("Flat").scale = scale
    assert_refused("'Flat' has zero scale", ["Flat"])


def test_tiny_scale_is_not_zero():
    scenes.add_cube("Small").scale = (1e-4, 1e-4, 1e-4)
    graph = scenes.depsgraph()
    (mesh,) = receiver_meshes(bake_objects(graph), graph)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)


def test_linked_mesh(tmp_path):
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {scenes.add_cube("Linked").data})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=True) as (source, target):
        target.meshes = source.meshes
    obj = bpy.data.objects.new("Local", target.meshes[0])
    bpy.context.scene.collection.objects.link(obj)
    assert_refused("'Local' is linked", ["Local"])
    scenes.add_cube("Mine")
    warnings = []
    assert [obj.name for obj in scenes.in_graph(lambda graph: bake_objects(graph, None, warnings))] == ["Mine"]
    assert "'Local'" in warnings[0]


def test_hidden_in_the_viewport():
    scenes.add_cube("Hidden").hide_viewport = True
    assert_refused("'Hidden' is hidden", ["Hidden"])
