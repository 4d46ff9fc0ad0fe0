"""What live light is told of changes of Blender's data, with a stand-in for the engine."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from photon_bake.addon.blender.viewport.session import LiveSession
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.settings.live import LiveSettings

from .live_stand_ins import Engine
from .scenes import add_cube, add_lamp, add_plane


@pytest.fixture
def session(empty_scene, monkeypatch):
    """A cube and a floor under a lamp, live."""
    for obj, z in ((add_plane("Floor", size=8.0), 0.0), (add_cube("Box"), 1.0)):
        obj.location.z = z
        obj.data.materials.append(matte(obj.name))
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    bpy.context.view_layer.update()
    yield from started(monkeypatch)


def started(monkeypatch):
    monkeypatch.setattr(LiveSession, "_started", lambda self: Engine(self._stages[-1].surfaces))
    one = LiveSession(
        bpy.context.scene, bpy.context.view_layer, LiveSettings(n_vertices=200), lambda: "colored", pytest.fail
    )
    handlers = bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post
    for listed in handlers:
        listed.append(one.note)
    yield one
    for listed in handlers:
        listed.remove(one.note)
    one.end()


def matte(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    return material


def told(session):
    """What the engine is told once Blender has evaluated what was changed."""
    bpy.context.view_layer.update()
    session._ready = 0.0
    session.tick()
    assert not session.changes
    return session.live.told()


def test_a_lamp_that_moves_or_shines_otherwise_is_read_alone(session):
    lamp = next(obj for obj in bpy.data.objects if obj.type == "LIGHT")
    lamp.location.x = 3
    assert told(session) == ["LampsChanged"]
    assert session.scenery().transforms == pytest.approx(np.eye(4)[None].repeat(2, 0))
    assert session._reading.scene.lights.position[0, 0] == 3
    lamp.data.energy = 500
    assert told(session) == ["LampsChanged"]
    lamp.data.use_shadow = False
    assert told(session) == ["LampsChanged"] and not session._reading.scene.lights.blocked_by.any()
    lamp.data.energy = 500
    assert told(session) == []


def test_lamps_are_added_and_removed(session):
    lamp = add_lamp("AREA", location=(0, 0, 3), energy=10)
    assert told(session) == ["LampsChanged"] and len(session._reading.scene.lights) == 2
    bpy.data.objects.remove(lamp)
    assert told(session) == ["LampsChanged"] and len(session._reading.scene.lights) == 1


def test_an_object_that_moves_tells_its_matrix(session):
    box = bpy.data.objects["Box"]
    box.location.x, box.rotation_euler.z = 2, 1
    before = session._reading.scene
    assert told(session) == ["ObjectMoved"]
    number = before.objects.names.index("Box")
    transform = session.scenery().transforms[number]
    assert transform == pytest.approx(np.array(box.matrix_world @ Matrix.Translation((0, 0, -1))), abs=1e-6)
    assert session._reading.scene is before
    box.scale = (0, 0, 0)
    assert told(session) == ["SceneReplaced"] and session._reading.scene.objects.names == ("Floor",)


def test_children_and_instances_move_with_what_moves_them(session):
    child = add_cube("Child")
    child.parent = bpy.data.objects["Box"]
    holder = bpy.data.objects.new("Holder", None)
    bpy.context.scene.collection.objects.link(holder)
    shown = bpy.data.collections.new("Shown")
    shown.objects.link(add_cube("Instanced"))
    holder.instance_type, holder.instance_collection = "COLLECTION", shown
    assert told(session) == ["SceneReplaced"]
    bpy.data.objects["Box"].location.y = 1
    assert told(session) == ["ObjectMoved", "ObjectMoved"]
    holder.location.y = 3
    assert told(session) == ["ObjectMoved"]
    moved = session.scenery().transforms[:, 1, 3]
    assert sorted(moved.tolist()) == [0, 0, 1, 1, 3]


def test_a_materials_colour_is_read_alone(session):
    node = bpy.data.materials["Box"].node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = (1, 0, 0, 1)
    assert told(session) == ["MaterialsChanged"]
    looks = session.scenery().looks.materials.reshape(-1, 3, 4)
    assert (looks[:, 0, 0] > 0.9).sum() == 1
    node.inputs["Base Color"].default_value = (1, 0, 0, 1)
    assert told(session) == []


def test_a_materials_image_that_appears_has_all_read_anew(session):
    tree = bpy.data.materials["Box"].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Checker", 8, 8)
    node.image.pixels.foreach_set(np.random.default_rng(0).random(8 * 8 * 4).astype(np.float32))
    tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    assert told(session) == ["SceneReplaced"]
    pixels = session.scenery().looks.pixels
    assert len(pixels) == 128**2 * 4 // 3  # with its halved copies
    tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.3
    assert told(session) == ["MaterialsChanged"] and session.scenery().looks.pixels is pixels
    tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    assert told(session) == ["MaterialsChanged"] and session.scenery().looks.pixels is not pixels


def test_the_world_is_read_alone(session):
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    told(session)
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0, 0, 1)
    assert told(session) == ["WorldChanged"] and session.scenery().world.color == pytest.approx((0.5, 0, 0))


def test_an_object_of_another_shape_is_read_alone(session, monkeypatch):
    box = bpy.data.objects["Box"]
    box.location.x = 1
    assert told(session) == ["ObjectMoved"]
    monkeypatch.setattr(session, "_read", pytest.fail)
    before = session.scenery().light.surfaces
    box.data.vertices[0].co.x += 0.1
    box.data.update()
    assert told(session) == ["ObjectReshaped"]
    assert session.scenery().light.surfaces is not before and (session.scenery().transforms == np.eye(4)).all()
    number = session._reading.scene.objects.names.index("Box")
    places = np.concatenate([mesh.position for mesh in session._stages[-1].surfaces.meshes if mesh.object == number])
    corners = np.array([box.matrix_world @ vertex.co for vertex in box.data.vertices])
    assert np.abs(places[:, None] - corners).max(axis=2).min(axis=0) == pytest.approx(0, abs=1e-5)
    box.location.x = 2
    assert told(session) == ["ObjectMoved"]
    assert session.scenery().transforms[number, :3, 3] == pytest.approx((1, 0, 0))


def test_shape_keys_and_modifiers_that_leave_faces_reshape(session):
    box = bpy.data.objects["Box"]
    taper = box.modifiers.new("Taper", "SIMPLE_DEFORM")
    taper.deform_method, taper.deform_axis, taper.factor = "TAPER", "Z", 0.8
    assert told(session) == ["ObjectReshaped"]
    box.shape_key_add(name="Basis")
    box.shape_key_add(name="Wide").data[0].co.x += 1
    told(session)
    box.data.shape_keys.key_blocks["Wide"].value = 0.5
    assert told(session) == ["ObjectReshaped"]
    box.data.update()
    assert told(session) == []


def test_an_object_that_is_hidden_removed_or_brought_back(session, monkeypatch):
    monkeypatch.setattr(session, "_read", pytest.fail)
    box = bpy.data.objects["Box"]
    box.hide_set(True)
    assert told(session) == ["ObjectShown"] and not session.scenery().shown_in(Space()).all()
    box.hide_set(False)
    assert told(session) == ["ObjectShown"] and session.scenery().shown_in(Space()).all()
    box.hide_set(True)
    told(session)
    box.location.x = 3
    told(session)
    box.hide_set(False)
    assert set(told(session)) == {"ObjectShown", "ObjectReshaped"}
    bpy.context.collection.objects.unlink(box)
    assert told(session) == ["ObjectShown"]
    bpy.context.collection.objects.link(box)
    assert told(session) == ["ObjectShown"]


def test_other_changes_read_everything(session):
    box = bpy.data.objects["Box"]
    add_cube("Other").location.x = 3
    assert told(session) == ["SceneReplaced"] and len(session._reading.scene.objects.names) == 3
    bevel = box.modifiers.new("Bevel", "BEVEL")
    assert told(session) == ["SceneReplaced"]
    bevel.width = 0.2
    assert told(session) == ["ObjectReshaped"]
    box.data.materials[0] = matte("Another")
    assert told(session) == ["SceneReplaced"]


def test_what_makes_no_light_is_not_followed(session):
    bpy.data.objects["Box"].select_set(True)
    bpy.context.scene.view_settings.exposure = 1.0
    bpy.data.scenes.remove(bpy.data.scenes.new("Other"))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.view_layer.update()
    camera.location.x = 3
    assert told(session) in ([], ["LampsChanged"]) and session._shown_as.exposure == 2.0


def test_the_same_scene_read_anew_leaves_its_light(session):
    bpy.data.objects["Box"].location.x = 2
    assert told(session) == ["ObjectMoved"]
    bpy.data.objects["Box"].location.x = 0
    bpy.context.view_layer.update()
    session.changes.everything = True
    lamp = next(obj for obj in bpy.data.objects if obj.type == "LIGHT")
    lamp.location.x = 3
    assert told(session) == ["LampsChanged", "ObjectMoved"]
    assert (session.scenery().transforms == np.eye(4)).all()


def test_a_mesh_that_is_edited_holds_still(session):
    box = bpy.data.objects["Box"]
    bpy.context.view_layer.objects.active = box
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    assert told(session) == [] and session.scenery().shown_in(Space()).all()
    bpy.ops.transform.translate(value=(0.5, 0, 0))
    assert told(session) == [] and session.changes.held
    assert not session.scenery().shown_in(Space()).all() and not session.scenery().complete
    next(obj for obj in bpy.data.objects if obj.type == "LIGHT").location.x = 3
    assert told(session) == ["LampsChanged"]
    bpy.ops.object.mode_set(mode="OBJECT")
    assert told(session) == ["ObjectReshaped"] and not session.changes.held
    assert session.scenery().shown_in(Space()).all() and session.scenery().complete


def test_a_mesh_that_edit_mode_leaves_as_it_was_is_drawn_again(session):
    box = bpy.data.objects["Box"]
    bpy.context.view_layer.objects.active = box
    bpy.ops.object.mode_set(mode="EDIT")
    for x in (0.5, -0.5):
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.transform.translate(value=(x, 0, 0))
        told(session)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert told(session) == [] and session.scenery().shown_in(Space()).all()


def test_what_solid_shading_draws_no_surfaces_of_is_not_drawn(session):
    box, space = bpy.data.objects["Box"], Space()
    for display in ("WIRE", "BOUNDS", "SOLID"):
        box.display_type = display
        told(session)
        assert session.scenery().shown_in(space).sum() == (2 if display == "SOLID" else 1)


def test_types_of_display_are_looked_up_once_after_an_update(session, monkeypatch):
    shown = session.scenery().shown_in(Space())
    with monkeypatch.context() as patch:
        patch.setattr("photon_bake.addon.blender.viewport.stage.objects_of", pytest.fail)
        assert (session.scenery().shown_in(Space()) == shown).all()
    bpy.data.objects["Box"].display_type = "WIRE"
    bpy.context.view_layer.update()
    assert session.scenery().shown_in(Space()).sum() == shown.sum() - 1


def test_frames_are_followed(session):
    box = bpy.data.objects["Box"]
    box.keyframe_insert("location", frame=1)
    box.location.x = 4
    box.keyframe_insert("location", frame=11)
    bpy.context.scene.frame_set(1)
    told(session)
    for frame in (5, 7, 11):
        bpy.context.scene.frame_set(frame)
    assert told(session) == ["ObjectMoved"] and session.scenery().transforms[:, 0, 3].max() == pytest.approx(4)


def test_until_there_is_light_on_new_surfaces_the_old_ones_are_drawn(session):
    before = session.scenery()
    light, session.live.edit = session.live.light, lambda *edits: None
    add_cube("Other").location.x = 3
    told(session)
    assert session.scenery().light is light and not session.scenery().complete
    assert len(session.scenery().transforms) == len(before.transforms) == 2
    session.live.light = type(light)(**{**vars(light), "surfaces": session._stages[-1].surfaces})
    assert len(session.scenery().transforms) == 3 and session.scenery().complete


class Space:
    """A view that shows all that the scene does."""

    local_view, use_local_collections = None, False

    def __getattr__(self, name):
        return name.startswith("show_object_viewport_")


def test_light_is_behind_as_long_as_a_change_is_not_read(session):
    assert session.behind is None
    bpy.data.objects["Box"].modifiers.new("Bevel", "BEVEL")
    bpy.context.view_layer.update()
    session._ready = np.inf  # not to be read again so soon
    session.tick()
    assert session.live.told() == [] and session.behind > 0 and not session.scenery().complete


def test_without_light_it_stays_off(empty_scene, monkeypatch):
    add_plane("Floor", size=8.0)
    with pytest.raises(BakeError, match="Nothing in the scene gives light"):
        next(started(monkeypatch))


def test_what_ends_the_engine_is_told(session):
    session.live.failure = BakeError("There is too little memory.")
    with pytest.raises(BakeError, match="too little memory"):
        session.tick()
