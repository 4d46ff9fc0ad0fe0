"""What the check says of a scene before its bake, and what its buttons do."""

import bpy
import pytest
from photon_bake.addon.blender.preflight import check, setting_rules
from photon_bake.addon.ui.checks import asked_of, checks
from photon_bake.addon.ui.remedies import REMEDIES
from photon_bake.operators.remedy import _DO

from .scenes import add_cube, add_lamp, add_material, add_plane, set_world


@pytest.fixture
def settings(empty_scene):
    """Three cubes in a lamp's light."""
    white, _ = add_material("White")
    for i in range(3):
        add_cube(f"Cube {i}", material=white).location.x = 3 * i
        bpy.data.objects[f"Cube {i}"].modifiers.new("Smooth", "SMOOTH")  # which is no large face
    add_lamp("POINT", energy=100)
    return empty_scene.photon_bake


def found():
    bpy.context.view_layer.update()
    return check(asked_of(bpy.context.scene, bpy.context.view_layer))


def lines():
    return [finding.line for finding in found().findings]


def cube(i=0):
    return bpy.data.objects[f"Cube {i}"]


def test_all_is_well(settings):
    result = found()
    assert result.line == "3 objects will get light" and not result.findings and not result.blocked
    assert result.seconds < 0.1


def test_a_missing_library_is_said_before_a_bake(settings, monkeypatch):
    monkeypatch.setattr(setting_rules, "missing_library", lambda: "numba cannot be imported.")
    result = found()
    assert result.blocked and result.findings[0].sentences == ("numba cannot be imported.",)


def no_faces():
    cube().data.clear_geometry()
    cube().modifiers.clear()


def no_scale():
    cube().scale.z = 0


def text():
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT")))


def bare_path():
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Path", bpy.data.curves.new("Path", "CURVE")))


def shared():
    cube(1).data = cube(0).data


def mirror():
    for i in range(3):
        cube(i).modifiers.new("M", "MIRROR")


def remesh():
    cube().modifiers.new("R", "REMESH")


def instances():
    group = bpy.data.collections.new("Group")
    group.objects.link(cube())
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    bpy.context.scene.collection.objects.link(empty)


def hidden():
    cube().hide_render = True


def coarse():
    add_plane("Ground", size=50, material=bpy.data.materials["White"])


def grouped_name():
    cube().vertex_groups.new(name="Indirect")


def no_material():
    cube().data.materials.clear()


def dark():
    bpy.data.objects["Lamp"].hide_render = True


def no_target():
    bpy.context.scene.photon_bake.targets = set()


def camera():
    bpy.context.scene.photon_bake.targets = {"camera"}


def photon_volumes():
    bpy.context.scene.photon_bake.gather = "photon_volumes"


def nothing_selected():
    bpy.context.scene.photon_bake.selected_only = True


def light_group():
    bpy.context.scene.photon_bake.light_group = "Gone"


def no_uv_map():
    bpy.context.scene.photon_bake.targets = {"lightmap"}
    bpy.context.scene.photon_bake.lightmap.uv_map = "Mine"


def missing_image():
    image = bpy.data.images.new("Gone", 2, 2)
    image.source, image.filepath = "FILE", "//gone.png"
    bpy.data.materials["White"].node_tree.nodes.new("ShaderNodeTexImage").image = image


SITUATIONS = [
    (no_faces, "Cube 0: no faces", 1, False),
    (no_scale, "Cube 0: no scale along an axis", 1, False),
    (text, "Text: not a mesh", 1, False),
    (bare_path, None, 0, False),
    (shared, "2 objects: shared meshes", 0, False),
    (mirror, "3 objects: Mirror", 0, False),
    (remesh, "Cube 0: Remesh", 1, False),
    (instances, "Empty: instances", 0, False),
    (hidden, "Cube 0: hidden in renders", 1, False),
    (coarse, "Ground: few vertices", 0, False),
    (grouped_name, "Cube 0: name is taken", 0, True),
    (no_material, "Cube 0: no material", 0, False),
    (dark, "Nothing gives light", 0, False),
    (no_target, "Nothing to bake to", 0, True),
    (camera, "No camera", 0, True),
    (photon_volumes, "Gather is for Camera alone", 0, True),
    (nothing_selected, "No mesh is selected", 0, True),
    (light_group, "No such light group", 0, True),
    (no_uv_map, "3 objects: no UV map 'Mine'", 0, True),
    (missing_image, "1 image file is missing", 0, False),
]


@pytest.mark.parametrize(
    ("make", "line", "n_unlit", "blocks"), SITUATIONS, ids=lambda one: getattr(one, "__name__", "")
)
def test_a_situation_is_said_in_a_line(settings, make, line, n_unlit, blocks):
    make()
    result = found()
    assert lines() == ([line] if line else [])
    assert result.n_unlit == n_unlit and result.blocked == blocks
    assert all(remedy in REMEDIES for finding in result.findings for remedy in finding.remedies)


@pytest.mark.parametrize(
    ("make", "remedy"),
    [
        (text, "bake_copies"),
        (text, "convert"),
        (shared, "single_user"),
        (shared, "bake_copies"),
        (mirror, "bake_copies"),
        (remesh, "bake_copies"),
        (instances, "bake_copies"),
        (hidden, "show_in_renders"),
        (coarse, "to_lightmaps"),
        (no_material, "add_material"),
        (dark, "add_light"),
        (camera, "add_camera"),
        (photon_volumes, "final_gather"),
        (nothing_selected, "selected_off"),
        (light_group, "all_lights"),
        (no_uv_map, "make_uv_map"),
    ],
)
def test_a_remedy_is_one(settings, make, remedy):
    """After it the line is gone."""
    make()
    bpy.context.view_layer.update()
    assert bpy.ops.photon_bake.check() == {"FINISHED"}
    (finding,) = checks.of(bpy.context.scene).preflight.findings
    assert remedy in finding.remedies
    assert bpy.ops.photon_bake.remedy(remedy=remedy, source="check", index=0) == {"FINISHED"}
    assert finding.line not in lines()


def test_what_is_found_is_selected(settings):
    shared()
    bpy.ops.photon_bake.check()
    assert bpy.ops.photon_bake.select_found(source="check", index=0) == {"FINISHED"}
    assert {obj.name for obj in bpy.context.selected_objects} == {"Cube 0", "Cube 1"}


def test_every_remedy_can_be_done():
    assert set(_DO) == set(REMEDIES)


def test_a_world_or_a_glow_is_light(settings):
    dark()
    set_world((0.1, 0.1, 0.1))
    assert lines() == []
    set_world((0, 0, 0))
    assert lines() == ["Nothing gives light"]
    glow, _ = add_material("Glow", "ShaderNodeEmission")
    cube().data.materials[0] = glow
    assert lines() == []


def test_copies_count_as_lit(settings):
    text()
    settings.bake_copies = True
    assert found().line == "4 objects will get light"


def test_a_check_knows_when_it_is_old(settings):
    scene = bpy.context.scene
    bpy.ops.photon_bake.check()
    assert checks.is_current(scene)
    settings.bake_copies = True
    assert not checks.is_current(scene)
    bpy.ops.photon_bake.check()
    cube().location.x += 1
    bpy.context.view_layer.update()
    assert not checks.is_current(scene)
