"""Bake Copies: what cannot hold its light itself gets a copy that can, and its original comes back untouched."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.meshes import shown_meshes
from photon_bake.addon.blender.write import baked_copies
from photon_bake.addon.blender.write.baked_copies import write_light
from photon_bake.addon.core.errors import BakeError, TooCoarse
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.receivers import vertex_receivers
from photon_bake.addon.ui.state import bake_state
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.vertices import VertexRequest
from photon_bake.tests.host import scenes
from photon_bake.tests.host.test_receiver_mesh_modifiers import geometry_nodes
from photon_bake.tests.host.test_shown_light import light_at

KINDS = ("objects", "meshes", "curves", "collections", "scenes", "materials")


@pytest.fixture
def room(empty_scene):
    """A floor with a light of one color all over, and the smallest bake there is."""
    scenes.set_world((1, 1, 1))
    scenes.add_plane("Floor", size=3.0, smooth=True).visible_diffuse = False
    properties = bpy.context.scene.photon_bake
    properties.n_photons, properties.n_gather_rays = 2000, 16
    properties.n_cache_elements, properties.n_cache_rays = 50, 4
    return properties


def add_text(name="Text"):
    text = bpy.data.curves.new(name, "FONT")
    text.body, text.extrude = "I", 0.1
    obj = bpy.data.objects.new(name, text)
    obj.location, obj.rotation_euler, obj.scale = (1, 2, 3), (0.1, 0.2, 0.3), (1, 2, 0.5)
    obj.data.materials.append(scenes.add_material("Ink")[0])
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_sharers():
    one = scenes.add_cube("One", smooth=True)
    other = bpy.data.objects.new("Other", one.data)
    bpy.context.scene.collection.objects.link(other)
    one.location, other.location = (2, 0, 1), (-2, 0, 1)
    return one, other


def add_remeshed():
    obj = scenes.add_cube("Remeshed")
    obj.modifiers.new("Remesh", "REMESH").mode = "BLOCKS"
    return obj


def add_instancers(n=2, with_lamp=False):
    """Empties that show a collection of one cube, which is not in the scene itself."""
    collection = bpy.data.collections.new("Kit")
    cube = scenes.add_cube("Inner")
    things = [cube] + ([scenes.add_lamp("POINT")] if with_lamp else [])
    for thing in things:
        bpy.context.scene.collection.objects.unlink(thing)
        collection.objects.link(thing)
    empties = []
    for i in range(n):
        empty = bpy.data.objects.new(f"Kit {i}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", collection, (3 * i, 0, 1)
        bpy.context.scene.collection.objects.link(empty)
        empties.append(empty)
    return empties


def bake(copies=True):
    assert bpy.ops.photon_bake.bake_indirect(copies=copies) == {"FINISHED"}
    return [warning for warning in bake_state.warnings if not isinstance(warning, TooCoarse)]


def state():
    """All names, and what can be seen of objects."""
    names = {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in KINDS}
    return names, {obj.name: (obj.hide_render, sorted(obj.keys())) for obj in bpy.data.objects}


def copy_of(obj):
    return bpy.data.objects[f"{obj.name} (Baked)"]


def light(obj):
    values = np.empty(len(obj.data.attributes["Indirect"].data) * 4, np.float32)
    obj.data.attributes["Indirect"].data.foreach_get("color", values)
    return values.reshape(-1, 4)


def test_copies_take_the_place_of_what_cannot_hold_light(room):
    originals = [add_text(), *add_sharers(), add_remeshed(), *add_instancers()]
    arrayed = scenes.add_cube("Arrayed")
    arrayed.modifiers.new("Array", "ARRAY")
    bevelled = scenes.add_cube("Bevelled")
    bevelled.modifiers.new("Bevel", "BEVEL").limit_method = "NONE"
    before = state()
    assert bake() == []
    for obj in [*originals, arrayed]:
        copy = copy_of(obj)
        assert obj.hide_render and not copy.hide_render
        assert copy.type == "MESH" and copy.data.users == 1 and not copy.modifiers
        assert copy.users_collection[0].name == "Photon Bake"
        np.testing.assert_allclose(copy.matrix_basis, obj.matrix_world, atol=1e-5)
        assert np.isfinite(light(copy)).all() and light(copy)[:, :3].max() > 0
    assert [material.name for material in copy_of(originals[0]).data.materials] == ["Ink"]
    assert "Bevelled (Baked)" not in bpy.data.objects and light(bevelled).max() > 0
    assert not bevelled.hide_render
    assert bpy.ops.photon_bake.remove_copies() == {"FINISHED"}
    assert state() == before
    assert not bpy.ops.photon_bake.remove_copies.poll()


def test_without_copies_a_warning_offers_them(room):
    add_text()
    add_sharers()
    add_remeshed()
    add_instancers()
    scenes.add_cube("Arrayed").modifiers.new("Array", "ARRAY")
    warnings = bake(copies=False)
    for name, why in {
        "'Text'": "not meshes",
        "'One', 'Other'": "mean of their light",
        "'Remeshed'": "shows no attribute",
        "'Kit 0', 'Kit 1'": "instances",
        "'Arrayed'": "several places",
    }.items():
        (warning,) = [warning for warning in warnings if name in warning]
        assert why in warning and "Bake Copies" in warning
    assert len(warnings) == 5
    assert not baked_copies.has_copies()


def test_baking_again_replaces_copies_and_reads_the_originals(room):
    text = add_text()
    hidden = scenes.add_cube("Hidden")
    hidden.hide_render = True
    bake()
    first = copy_of(text)
    n_vertices = len(first.data.vertices)
    text.data.body = "II"
    meshes = len(bpy.data.meshes)
    bake()
    assert len(copy_of(text).data.vertices) == 2 * n_vertices
    assert len(bpy.data.meshes) == meshes
    assert [obj.name for obj in bpy.data.objects if obj.name.endswith("(Baked)")] == ["Text (Baked)"]
    bpy.ops.photon_bake.remove_copies()
    assert not text.hide_render and hidden.hide_render
    bake()
    bpy.data.objects.remove(text)
    bpy.ops.photon_bake.remove_copies()
    assert not baked_copies.has_copies()


def test_what_was_changed_meanwhile_gets_no_copy(room):
    text = add_text()
    before = state()
    job = BakeJob.prepare(bpy.context, [VertexRequest("Indirect", copies=True)], Progress())
    assert state() == before
    solved = job.solve(room.settings(), Progress())
    assert state() == before
    text.data.body = "Other"
    written = job.write(solved, Progress())
    assert ["'Text' got no light, since its mesh was changed" in one for one in written.warnings] == [True]
    assert not baked_copies.has_copies() and not text.hide_render
    assert "Indirect" in bpy.data.objects["Floor"].data.color_attributes
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    with pytest.raises(BakeError, match="'Floor' got no light, since it was deleted"):
        job.write(solved, Progress())


def test_a_linked_mesh_gets_a_copy(room, tmp_path):
    path = str(tmp_path / "library.blend")
    mesh = scenes.add_cube("Box").data
    bpy.data.libraries.write(path, {mesh})
    bpy.data.batch_remove([bpy.data.objects["Box"], mesh])
    with bpy.data.libraries.load(path, link=True) as (source, target):
        target.meshes = source.meshes
    box = bpy.data.objects.new("Box", target.meshes[0])
    bpy.context.scene.collection.objects.link(box)
    assert bake() == []
    assert "Indirect" in copy_of(box).data.color_attributes and copy_of(box).data.library is None


def test_sheared_objects_keep_their_shape(room):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    text = add_text()
    text.parent, parent.scale = text.parent or parent, (1, 3, 1)
    bpy.context.view_layer.update()
    bake()
    copy = copy_of(text)
    wanted = bpy.data.meshes.new_from_object(text.evaluated_get(scenes.depsgraph()))
    wanted.transform(text.matrix_world)
    copy.data.transform(copy.matrix_world)
    (first, second) = (np.array([vertex.co for vertex in mesh.vertices]) for mesh in (wanted, copy.data))
    np.testing.assert_allclose(second, first, atol=1e-4)


def test_copies_look_like_their_originals(room):
    text = add_text()
    text.visible_glossy, text.pass_index, text["tint"] = False, 7, 0.25
    text.color = (1, 0, 0, 1)
    bake()
    copy = copy_of(text)
    assert (copy.visible_glossy, copy.pass_index, copy["tint"], tuple(copy.color)) == (False, 7, 0.25, (1, 0, 0, 1))


def test_what_nodes_instance(room):
    """Points with cubes on them, beside their own face; and a cube that is but an instance of itself."""
    scenes.add_cube("Itself")
    geometry_nodes(bpy.data.objects["Itself"], "GeometryNodeGeometryToInstance")
    seed = scenes.add_cube("Seed")
    seed.hide_render = True
    points = scenes.add_plane("Points")
    geometry_nodes(points, "GeometryNodeInstanceOnPoints")
    tree = points.modifiers["Nodes"].node_group
    on_points = next(node for node in tree.nodes if node.bl_idname == "GeometryNodeInstanceOnPoints")
    info, join = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeJoinGeometry")
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = seed, True
    tree.links.new(info.outputs["Geometry"], on_points.inputs["Instance"])
    last = next(node for node in tree.nodes if node.bl_idname == "NodeGroupOutput")
    for output in (on_points.outputs[0], tree.nodes["Group Input"].outputs[0]):
        tree.links.new(output, join.inputs[0])
    tree.links.new(join.outputs[0], last.inputs[0])
    assert bake() == []
    copies = [obj for obj in bpy.data.objects if "(Baked)" in obj.name]
    assert sorted(len(obj.data.vertices) for obj in copies) == [4, 8, 8, 8, 8, 8]
    assert {tuple(round(x) for x in obj.location) for obj in copies} >= {(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0)}
    assert all("Indirect" in obj.data.attributes for obj in copies)


def test_what_copies_cannot_show_is_named(room, monkeypatch):
    add_instancers(1, with_lamp=True)
    warnings = bake()
    assert any("'Kit 0' shows more than meshes" in warning for warning in warnings)
    assert not baked_copies.has_copies()


def test_too_many_instances(room, monkeypatch):
    monkeypatch.setattr(shown_meshes, "MAX_COPIES", 1)
    empties = add_instancers(2)
    bpy.data.objects["Inner"].users_collection[0].objects.link(scenes.add_cube("Second"))
    assert any("'Kit 1' shows 2 instances, too many" in warning for warning in bake())
    assert not empties[0].hide_render


def test_objects_by_name(room):
    add_text()
    one, _ = add_sharers()
    job = BakeJob.prepare(bpy.context, [VertexRequest("Indirect", copies=True)], Progress(), ["Text", "One"])
    assert job.object_names == ["One", "Text"]  # one alone shares its mesh with none that is baked
    with pytest.raises(BakeError, match=r"'Text' is not a mesh.*Bake Copies"):
        BakeJob.prepare(bpy.context, [VertexRequest()], Progress(), ["Text"])
    assert one.data.users == 2


def test_a_shared_mesh_that_is_not_finite_is_left_out(room):
    add_text()
    scenes.spoil(add_sharers()[0], np.nan)
    wanted = [VertexRequest("Indirect", copies=True)]
    job = BakeJob.prepare(bpy.context, wanted, Progress())
    assert job.object_names == ["Floor", "Text"]
    assert {f"Left out: Object '{name}'" for name in ("One", "Other")} <= {
        one.split(" has ")[0] for one in job.warnings
    }
    with pytest.raises(BakeError, match=r"'One'.*finite"):
        BakeJob.prepare(bpy.context, wanted, Progress(), ["One", "Other"])


def test_only_texts(empty_scene):
    add_text()
    with pytest.raises(BakeError, match="Nothing to bake"):
        BakeJob.prepare(bpy.context, [VertexRequest()], Progress())
    assert BakeJob.prepare(bpy.context, [VertexRequest("Indirect", copies=True)], Progress()).object_names == ["Text"]


def test_nothing_at_all(empty_scene):
    with pytest.raises(BakeError, match="Nothing to bake"):
        BakeJob.prepare(bpy.context, [VertexRequest("Indirect", copies=True)], Progress())


def test_copies_show_light_where_it_is(room):
    """Of a light that changes evenly, each corner of each copy has its own place's."""
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    owners = [add_text(), *add_sharers(), *add_instancers()]
    job = BakeJob.prepare(bpy.context, [VertexRequest("Indirect", copies=True)], Progress())
    receivers = vertex_receivers([copy.mesh for copy in job.targets[0].copies])
    write_light(light_at(receivers.position) * np.pi, receivers, job.targets[0].copies, "Indirect", [])
    for copy in map(copy_of, owners):
        vertex = np.array([loop.vertex_index for loop in copy.data.loops])
        places = np.array([copy.matrix_basis @ copy.data.vertices[i].co for i in vertex])
        shown = light(copy) if len(light(copy)) == len(vertex) else light(copy)[vertex]
        np.testing.assert_allclose(shown[:, :3], light_at(places), atol=0.03)


def test_copies_of_a_mesh_in_edit_mode(room):
    """What edit mode evaluates often has no arrays to read."""
    one, other = add_sharers()
    bpy.context.view_layer.objects.active = one
    one.select_set(True)
    assert bake() == []
    before = [light(copy_of(obj)) for obj in (one, other)]
    bpy.ops.photon_bake.remove_copies()
    bpy.ops.object.mode_set(mode="EDIT")
    assert bake() == [] and one.mode == "EDIT"
    for obj, values in zip((one, other), before, strict=True):
        np.testing.assert_allclose(light(copy_of(obj)), values, rtol=1e-6)
