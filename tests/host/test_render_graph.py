"""The graph that renders see: what is in it, and that asking for it leaves no trace."""

import bmesh
import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.render_graph import _Reader
from photon_bake.tests.host import scenes


def n_vertices(name):
    """Of an object's mesh, as renders have it."""
    return scenes.in_graph(lambda graph: len(bpy.data.objects[name].evaluated_get(graph).data.vertices))


def data_blocks():
    return sorted(block.name_full for kind in ("scenes", "objects", "meshes") for block in getattr(bpy.data, kind))


def test_what_only_the_viewport_hides_is_there():
    scenes.add_cube("Seen")
    scenes.add_cube("Monitor").hide_viewport = True
    eye = scenes.add_cube("Eye")
    bpy.context.view_layer.update()
    eye.hide_set(True)
    warnings = []
    assert sorted(scenes.extracted(warnings).objects.names) == ["Eye", "Monitor", "Seen"]
    assert warnings == []
    assert eye.hide_get()


def test_excluded_collections_are_not():
    scenes.add_cube("Seen")
    collection = bpy.data.collections.new("Excluded")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("Object", scenes.add_cube("Other").data))
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    assert sorted(scenes.extracted().objects.names) == ["Other", "Seen"]


def test_the_camera_does_not_see_what_is_indirect_only():
    scenes.add_cube("Seen")
    collection = bpy.data.collections.new("Indirect")
    bpy.context.scene.collection.children.link(collection)
    mesh = scenes.add_plane("Other").data
    bpy.data.objects.remove(bpy.data.objects["Other"])
    collection.objects.link(bpy.data.objects.new("Object", mesh))
    bpy.context.view_layer.layer_collection.children["Indirect"].indirect_only = True
    objects = scenes.extracted(for_camera=True).objects
    assert dict(zip(objects.names, objects.seen_by_camera, strict=True)) == {"Seen": True, "Object": False}
    assert objects.scatters.all()


def test_the_background_set_is_part_of_the_scene():
    scenes.add_cube("Seen")
    background = bpy.data.scenes.new("Set")
    background.collection.objects.link(bpy.data.objects.new("Wall", bpy.data.objects["Seen"].data))
    background.collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
    bpy.context.scene.background_set = background
    scene = scenes.extracted()
    assert sorted(scene.objects.names) == ["Seen", "Wall"]
    assert len(scene.lights) == 1


def test_modifiers_are_as_in_renders():
    modifiers = scenes.add_cube("Cube").modifiers
    subdivision = modifiers.new("Subdivision", "SUBSURF")
    subdivision.subdivision_type, subdivision.levels, subdivision.render_levels = "SIMPLE", 0, 1
    assert n_vertices("Cube") == 26
    modifiers.new("In renders", "ARRAY").show_viewport = False
    modifiers.new("In the viewport", "ARRAY").show_render = False
    assert n_vertices("Cube") == 52
    render = bpy.context.scene.render
    render.use_simplify, render.simplify_subdivision_render = True, 0
    assert n_vertices("Cube") == 16


def test_particles_are_as_many_as_in_renders():
    leaf = scenes.add_plane("Leaf")
    tree = scenes.add_cube("Tree")
    tree.modifiers.new("Leaves", "PARTICLE_SYSTEM")
    particles = tree.particle_systems[0].settings
    particles.type, particles.render_type, particles.count = "HAIR", "OBJECT", 20
    particles.instance_object, particles.display_percentage = leaf, 10
    assert scenes.extracted().objects.names.count("Leaf") == 21


def test_rigid_bodies_are_where_they_fell_to():
    ball = scenes.add_cube("Ball")
    ball.location.z = 10
    ball.select_set(True)
    bpy.context.view_layer.objects.active = ball
    bpy.ops.rigidbody.world_add()
    bpy.ops.rigidbody.object_add()
    for frame in range(1, 11):
        bpy.context.scene.frame_set(frame)
    height = ball.matrix_world.translation.z
    assert height < 9.7
    np.testing.assert_allclose(scenes.extracted().vertices[:, 2].mean(), height, atol=1e-5)
    assert [obj.name for obj in bpy.context.scene.objects] == ["Ball"]
    assert [obj.name for obj in bpy.context.view_layer.objects] == ["Ball"]
    engine = bpy.context.scene.render.engine
    assert scenes.in_graph(lambda graph: bpy.context.scene.render.engine) == engine


def into_mode(mode):
    cube = scenes.add_cube("Cube")
    cube.modifiers.new("Array", "ARRAY").show_in_editmode = False
    bpy.context.view_layer.objects.active = cube
    bpy.ops.object.mode_set(mode=mode)
    return cube


def test_edit_mode_is_read_as_if_left():
    cube = into_mode("EDIT")
    edited = bmesh.from_edit_mesh(cube.data)
    for vertex in edited.verts:
        vertex.co.z += 5
    bmesh.update_edit_mesh(cube.data)
    scene = scenes.extracted()
    assert scene.n_triangles == 24
    np.testing.assert_allclose(scene.vertices[:, 2].mean(), 5)
    assert cube.mode == "EDIT"


@pytest.mark.parametrize("mode", ["SCULPT", "VERTEX_PAINT", "WEIGHT_PAINT", "TEXTURE_PAINT"])
def test_other_modes(mode):
    cube = into_mode(mode)
    assert scenes.extracted().n_triangles == 24
    assert cube.mode == mode


def test_no_trace_is_left():
    scenes.add_cube("Cube").select_set(True)
    scene, before = bpy.context.scene, data_blocks()
    engine = scene.render.engine
    with pytest.raises(ZeroDivisionError):
        scenes.in_graph(lambda graph: 1 / 0)
    assert scenes.in_graph(lambda graph: graph.mode) == "RENDER"
    assert data_blocks() == before
    assert (bpy.context.scene, scene.render.engine) == (scene, engine)
    assert [obj.name for obj in bpy.context.selected_objects] == ["Cube"]
    assert not _Reader.is_registered


def test_the_graph_of_another_scene_within():
    other = bpy.data.scenes.new("Other")
    scenes.add_cube("Cube")

    def names(graph):
        return [one.object.name for one in graph.object_instances]

    def both(graph):
        return names(graph), scenes.in_render_graph(other, other.view_layers[0], names), names(graph)

    outer, inner, again = scenes.in_graph(both)
    assert len(outer) == 2
    assert len(inner) == 1
    assert again == outer
