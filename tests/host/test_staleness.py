"""What is said of a bake is out of date once something that it speaks of has changed, and not before."""

import bpy
import pytest
from photon_bake.addon.ui.staleness import own_changes
from photon_bake.addon.ui.state import bake_state

from .scenes import add_cube, add_lamp, add_material, add_plane, set_world


@pytest.fixture
def baked(empty_scene):
    """A scene that was just baked."""
    white, _ = add_material("White")
    add_plane("Floor", material=white)
    add_cube("Box", material=white)
    add_lamp("POINT")
    set_world((0.1, 0.1, 0.1))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    empty_scene.collection.objects.link(camera)
    empty_scene.camera = camera
    properties = empty_scene.photon_bake
    properties.n_photons, properties.n_gather_rays, properties.n_cache_elements = 1000, 4, 100
    bpy.ops.photon_bake.bake_indirect()
    return empty_scene


def is_stale():
    bpy.context.view_layer.update()
    return bake_state.outcome_of(bpy.context.scene.session_uid).stale


def move():
    bpy.data.objects["Box"].location.x += 1


def paint():
    node = bpy.data.materials["White"].node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = (1, 0, 0, 1)


def dim():
    bpy.data.lights["Lamp"].energy = 1


def darken():
    bpy.data.worlds["World"].node_tree.nodes["Background"].inputs["Strength"].default_value = 0.5


def delete():
    bpy.data.objects.remove(bpy.data.objects["Box"])


def hide():
    bpy.data.objects["Box"].hide_render = True


def add():
    add_cube("Another")


def edit():
    bpy.data.objects["Box"].data.vertices[0].co.x += 1
    bpy.data.objects["Box"].data.update()


def modify():
    bpy.data.objects["Box"].modifiers.new("Bevel", "BEVEL")


@pytest.mark.parametrize("change", [move, paint, dim, darken, delete, hide, add, edit, modify])
def test_a_change_of_light_makes_it_stale(baked, change):
    assert not is_stale()
    change()
    assert is_stale()


def select():
    bpy.data.objects["Box"].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects["Floor"]


def hide_in_viewport():
    bpy.data.objects["Box"].hide_viewport = True


def move_camera():
    bpy.data.objects["Camera"].location.x += 1


def set_output():
    bpy.context.scene.render.resolution_x = 100


def set_sampling():
    bpy.context.scene.photon_bake.n_photons = 2000


def show():
    assert bpy.ops.photon_bake.use_baked_light() == {"FINISHED"}


def leave():
    bpy.ops.photon_bake.use_baked_light()
    bpy.ops.photon_bake.leave_baked_light()


def slide():
    bpy.ops.photon_bake.use_baked_light()
    bpy.context.scene.photon_bake.shown.strength = 0.5


@pytest.mark.parametrize(
    "change", [select, hide_in_viewport, move_camera, set_output, set_sampling, show, leave, slide]
)
def test_what_leaves_light_alone_does_not(baked, change):
    change()
    assert not is_stale()


def test_a_camera_counts_for_its_own_picture(baked):
    baked.photon_bake.targets = {"vertex", "camera"}
    move_camera()
    assert is_stale()


def test_own_changes_are_told_apart(baked):
    with own_changes():
        move()
    assert not is_stale()
    move()
    assert is_stale()


def test_a_new_bake_is_fresh(baked):
    move()
    assert is_stale()
    bpy.ops.photon_bake.bake_indirect()
    assert not is_stale()
