"""Meshes, instances and visibility as they come out of Blender."""

import bpy
import numpy as np
import pytest
from photon_bake.tests.host import scenes


def extract():
    return scenes.extracted()


def outward(scene):
    """Whether all geometric and shading normals point away from the scene's middle."""
    middle = scene.bounds.mean(0)
    away = scene.vertices[scene.triangles].mean(1) - middle
    geometric = np.einsum("ij,ij->i", away, scene.normals)
    shading = np.einsum("ij,ikj->ik", away, scene.corner_normals)
    return (geometric > 0).all() and (shading > 0).all()


def test_empty_scene():
    scene = extract()
    assert scene.n_triangles == 0
    assert len(scene.lights) == 0
    assert not scene.world.color.any()


def test_cube():
    scenes.add_cube()
    scene = extract()
    assert scene.vertices.shape == (8, 3)
    assert scene.vertices.dtype == np.float32
    assert scene.triangles.dtype == np.int32
    assert scene.n_triangles == 12
    assert scene.areas.sum() == pytest.approx(24)
    assert outward(scene)
    assert scene.objects.names == ("Cube",)
    np.testing.assert_allclose(scenes.albedo_of(scene.materials), [[0.8, 0.8, 0.8]])


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-1, -2, 1), (-3, -2, -0.5), (1, 0.1, 5)])
def test_normals_point_where_blender_shows_them(scale):
    obj = scenes.add_cube()
    obj.scale, obj.rotation_euler, obj.location = scale, (0.3, 0.7, 1.1), (5, 6, 7)
    scene = extract()
    assert outward(scene)
    np.testing.assert_allclose(np.linalg.norm(scene.corner_normals, axis=2), 1, atol=1e-5)
    # A cube's faces are flat under any transform: the corners' normals are the face's.
    np.testing.assert_allclose(scene.corner_normals, scene.normals[:, None].repeat(3, 1), atol=1e-4)


def test_modifiers_are_applied():
    obj = scenes.add_cube()
    obj.modifiers.new("Array", "ARRAY").count = 3
    assert extract().n_triangles == 36


def test_linked_duplicates_and_collection_instances_share_one_reading(monkeypatch):
    from photon_bake.addon.blender.read import scene_contents as module

    calls = []
    read = module.read_mesh
    monkeypatch.setattr(module, "read_mesh", lambda mesh: calls.append(mesh.name) or read(mesh))
    cube = scenes.add_cube()
    twin = bpy.data.objects.new("Twin", cube.data)
    twin.location = (10, 0, 0)
    bpy.context.scene.collection.objects.link(twin)
    kit = bpy.data.collections.new("Kit")
    kit.objects.link(cube)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", kit, (0, 10, 0)
    bpy.context.scene.collection.objects.link(empty)
    scene = extract()
    assert len(calls) == 1
    assert scene.n_triangles == 36
    np.testing.assert_allclose(scene.bounds, [[-1, -1, -1], [11, 11, 1]])


def test_curves_texts_surfaces_and_metaballs():
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.object.text_add()
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.ops.object.metaball_add()
    scene = extract()
    assert len(scene.objects.names) == 4
    assert scene.n_triangles > 500


def test_hidden_from_renders():
    scenes.add_cube("Seen")
    scenes.add_cube("Object").hide_render = True
    hidden = bpy.data.collections.new("Hidden")
    hidden.hide_render = True
    bpy.context.scene.collection.children.link(hidden)
    inside = scenes.add_cube("Inside")
    bpy.context.scene.collection.objects.unlink(inside)
    hidden.objects.link(inside)
    scenes.add_lamp("POINT").hide_render = True
    scene = extract()
    assert scene.objects.names == ("Seen",)
    assert len(scene.lights) == 0


def test_ray_visibility():
    rays = ("diffuse", "shadow", "glossy", "transmission")
    seen = {"All": (1, 1, 1, 1), "Gather": (1, 0, 0, 0), "Shadow": (0, 1, 0, 0), "Gloss": (0, 0, 1, 0)}
    seen |= {"Glass": (0, 0, 0, 1), "Receiver": (0, 0, 0, 0)}
    for name, flags in seen.items():
        obj = scenes.add_cube(name)
        for ray, flag in zip(rays, flags, strict=True):
            setattr(obj, f"visible_{ray}", bool(flag))
    objects = extract().objects
    columns = (objects.scatters, objects.casts_shadow, objects.seen_in_gloss, objects.seen_through_glass)
    found = dict(zip(objects.names, zip(*columns, strict=True), strict=True))
    del seen["Receiver"]
    assert found == seen


def test_degenerate_triangles_and_loose_vertices_are_dropped():
    vertices = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.5, 0, 0), (1e-25, 0, 0), (0, 1e-25, 0), (99, 99, 99)]
    scenes.add_mesh("Mixed", vertices, [(0, 1, 2), (0, 3, 1), (0, 4, 5)])
    scene = extract()
    assert scene.n_triangles == 1
    assert np.isfinite(scene.normals).all()
    assert scene.bounds[1].max() <= 1


def test_zero_scale_occludes_nothing_unless_it_is_flat():
    scenes.add_cube("Gone").scale = (0, 0, 0)
    scenes.add_cube("Line").scale = (1, 0, 0)
    scenes.add_plane("Flat").scale = (1, 1, 0)
    scene = extract()
    assert scene.objects.names == ("Flat",)
    assert scene.areas.sum() == pytest.approx(4)
    np.testing.assert_allclose(scene.corner_normals, np.broadcast_to([0, 0, 1], (2, 3, 3)), atol=1e-6)


def test_mesh_without_faces():
    scenes.add_mesh("Nothing", [], [])
    scenes.add_mesh("Points", [(0, 0, 0), (1, 0, 0)], [])
    assert extract().n_triangles == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, 3e38])
def test_coordinates_that_are_not_finite(bad):
    """As in Cycles, faces at such a vertex are not there; the others are."""
    scenes.spoil(scenes.add_cube("Broken"), bad)
    scenes.add_plane()
    warnings = []
    scene = scenes.extracted(warnings)
    assert 2 + 6 <= scene.n_triangles <= 2 + 9  # of the three faces there a triangle each may be left
    assert np.isfinite(scene.vertices).all() and np.abs(scene.vertices).max() <= 1
    assert [warning for warning in warnings if "'Broken'" in warning and "finite" in warning]


def test_smooth_normals():
    scenes.add_cube(smooth=True)
    scene = extract()
    corners = scene.vertices[scene.triangles]
    np.testing.assert_allclose(scene.corner_normals, corners / np.sqrt(3), atol=1e-4)


def test_nothing_in_the_file_changes():
    scenes.add_cube(material=scenes.add_material()[0])
    scenes.add_lamp("AREA")
    scenes.set_world((1, 1, 1))

    def count():
        kinds = ("objects", "meshes", "materials", "lights", "worlds", "images", "node_groups", "collections")
        return {kind: [block.name for block in getattr(bpy.data, kind)] for kind in kinds}

    before = count()
    extract()
    assert count() == before


def instances_on_parts(instanced, kind="VERTS"):
    """A square that shows an object at each of its corners or faces, and is itself not shown in renders."""
    plane = scenes.add_plane("Points", 100)
    instanced.parent = plane
    plane.instance_type, plane.show_instancer_for_render = kind, False
    return plane


@pytest.mark.parametrize(("kind", "n", "reach"), [("VERTS", 4, 51), ("FACES", 1, 1)])
def test_instances_on_parts(kind, n, reach):
    """Renders show the instances, and not the original child."""
    instances_on_parts(scenes.add_cube(), kind)
    scenes.add_lamp("POINT").parent = bpy.data.objects["Points"]
    scene = extract()
    assert scene.objects.names == ("Cube",) * n
    assert len(scene.lights) == n
    np.testing.assert_allclose(scene.bounds[:, :2], [[-reach] * 2, [reach] * 2])


def test_grandchildren_are_shown_besides_their_instances():
    child = scenes.add_cube()
    scenes.add_plane("Grandchild").parent = child
    instances_on_parts(child, "FACES")
    assert sorted(extract().objects.names) == ["Cube", "Grandchild", "Grandchild"]


def test_instances_on_parts_in_a_collection():
    """An instance of the collection hides the original child as the scene does."""
    kit = bpy.data.collections.new("Kit")
    child = scenes.add_cube()
    for obj in (child, instances_on_parts(child)):
        bpy.context.scene.collection.objects.unlink(obj)
        kit.objects.link(obj)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", kit
    bpy.context.scene.collection.objects.link(empty)
    assert extract().objects.names == ("Cube",) * 4


def test_instances_of_what_is_hidden_in_a_collection():
    kit = bpy.data.collections.new("Kit")
    for name in ("Seen", "Hidden"):
        obj = scenes.add_cube(name)
        bpy.context.scene.collection.objects.unlink(obj)
        kit.objects.link(obj)
    obj.hide_render = True
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", kit
    bpy.context.scene.collection.objects.link(empty)
    assert extract().objects.names == ("Seen",)
    empty.hide_render = True
    assert extract().n_triangles == 0


def test_instances_inherit_the_instancer_s_ray_visibility():
    kit = bpy.data.collections.new("Kit")
    obj = scenes.add_cube()
    bpy.context.scene.collection.objects.unlink(obj)
    kit.objects.link(obj)
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection, empty.visible_shadow = "COLLECTION", kit, False
    bpy.context.scene.collection.objects.link(empty)
    objects = extract().objects
    assert list(objects.scatters) == [True]
    assert list(objects.casts_shadow) == [False]
