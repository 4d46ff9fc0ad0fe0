"""Light written back to meshes."""

from math import pi

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.as_read import AsRead, Placement, edit_mode_left
from photon_bake.addon.blender.write import color_attribute
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.receivers import AttributeTarget, Receivers
from photon_bake.tests.host import scenes


def receivers_for(*objects_and_domains, offset=0):
    """A receiver for each element of each object."""
    targets, n = [], offset
    for obj, domain in objects_and_domains:
        count = len(obj.data.vertices if domain == "POINT" else obj.data.loops)
        targets.append(AttributeTarget(obj.name, obj.data.name, domain, np.arange(n, n + count, dtype=np.int32)))
        n += count
    zeros = np.zeros((n, 3), np.float32)
    return Receivers(zeros, zeros, np.zeros(n, np.float32), tuple(targets))


def write_color_attribute(light, receivers, name, meanwhile=None):
    """Write to objects that nothing happened to, unless it is said what they were like."""
    return color_attribute.write_color_attribute(light, receivers, name, meanwhile or as_read(receivers))


def as_read(receivers):
    return [AsRead.of(bpy.data.objects[target.object_name]) for target in receivers.targets]


def values(n):
    return np.random.default_rng(2).uniform(0, 9, (n, 3)).astype(np.float32)


def read(obj, name="Indirect"):
    attribute = obj.data.color_attributes[name]
    rgba = np.empty(len(attribute.data) * 4, np.float32)
    attribute.data.foreach_get("color", rgba)
    return attribute, rgba.reshape(-1, 4)


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
def test_written_and_active(domain):
    obj = scenes.add_cube()
    obj.data.color_attributes.new("Other", "BYTE_COLOR", "CORNER")
    receivers = receivers_for((obj, domain))
    light = values(len(receivers))
    assert write_color_attribute(light, receivers, "Indirect") == []
    attribute, rgba = read(obj)
    assert (attribute.data_type, attribute.domain) == ("FLOAT_COLOR", domain)
    np.testing.assert_allclose(rgba[:, :3], light / pi, rtol=1e-6)
    np.testing.assert_array_equal(rgba[:, 3], 1)
    colors = obj.data.color_attributes
    assert colors.active_color.name == "Indirect"
    assert "Other" in colors


@pytest.mark.parametrize("there", ["", "Paint"])
def test_color_that_renders_fall_back_on_stays(there):
    obj = scenes.add_cube()
    if there:
        obj.data.color_attributes.new(there, "FLOAT_COLOR", "CORNER")
    for domain in ("POINT", "CORNER"):  # the second replaces the first's attribute
        receivers = receivers_for((obj, domain))
        write_color_attribute(values(len(receivers)), receivers, "Indirect")
        assert obj.data.attributes.default_color_name == there
        assert obj.data.color_attributes.active_color.name == "Indirect"


def test_element_without_receiver_is_black():
    obj = scenes.add_plane()
    target = AttributeTarget(obj.name, obj.data.name, "POINT", np.array([0, -1, 1, -1], np.int32))
    zeros = np.zeros((2, 3), np.float32)
    light = values(2)
    write_color_attribute(light, Receivers(zeros, zeros, np.zeros(2, np.float32), (target,)), "Indirect")
    _, rgba = read(obj)
    np.testing.assert_allclose(rgba[[0, 2], :3], light / pi, rtol=1e-6)
    np.testing.assert_array_equal(rgba[[1, 3]], [[0, 0, 0, 1]] * 2)


@pytest.mark.parametrize(("kind", "domain"), [("BYTE_COLOR", "CORNER"), ("FLOAT_COLOR", "POINT")])
def test_replaces_an_attribute_of_other_kind(kind, domain):
    obj = scenes.add_cube()
    obj.data.color_attributes.new("Indirect", kind, domain)
    receivers = receivers_for((obj, "CORNER"))
    for _ in range(2):
        write_color_attribute(values(24), receivers, "Indirect")
    assert [a.name for a in obj.data.color_attributes] == ["Indirect"]
    assert read(obj)[0].domain == "CORNER"


def shared_pair():
    one = scenes.add_cube("One")
    two = bpy.data.objects.new("Two", one.data)
    bpy.context.scene.collection.objects.link(two)
    return one, two


@pytest.mark.parametrize("domains", [("CORNER", "CORNER"), ("POINT", "POINT")])
def test_shared_mesh_gets_the_mean(domains):
    one, two = shared_pair()
    receivers = receivers_for((one, domains[0]), (two, domains[1]))
    light = values(len(receivers))
    (warning,) = write_color_attribute(light, receivers, "Indirect")
    assert "'One', 'Two'" in warning
    _, rgba = read(one)
    half = len(light) // 2
    np.testing.assert_allclose(rgba[:, :3], (light[:half] + light[half:]) / 2 / pi, rtol=1e-5)


def test_shared_mesh_of_both_domains_takes_corners():
    one, two = shared_pair()
    receivers = receivers_for((one, "POINT"), (two, "CORNER"))
    light = values(len(receivers))
    write_color_attribute(light, receivers, "Indirect")
    vertex = np.array(scenes.CUBE_FACES).ravel()
    np.testing.assert_allclose(read(one)[1][:, :3], (light[:8][vertex] + light[8:]) / 2 / pi, rtol=1e-5)


def assert_refused(match, receivers, name="Indirect", light=None):
    light = values(len(receivers)) if light is None else light
    before = {mesh.name: [(a.name, a.data_type) for a in mesh.attributes] for mesh in bpy.data.meshes}
    with pytest.raises(BakeError, match=match):
        write_color_attribute(light, receivers, name)
    assert {mesh.name: [(a.name, a.data_type) for a in mesh.attributes] for mesh in bpy.data.meshes} == before


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_value_that_is_not_finite_is_written(bad):
    receivers = receivers_for((scenes.add_cube(), "POINT"))
    light = values(8)
    light[5, 1] = bad
    assert_refused("not finite", receivers, light=light)


@pytest.mark.parametrize("name", ["", ".hidden", "x" * 80, "position", "sharp_face"])
def test_names_that_cannot_be(name):
    assert_refused("name", receivers_for((scenes.add_cube(), "POINT")), name)


def test_taken_names_are_refused():
    free, taken = scenes.add_cube("Free"), scenes.add_plane("Taken")
    receivers = receivers_for((taken, "POINT"))
    assert_refused("'Taken'.*not a color", receivers, "UVMap")
    taken.vertex_groups.new(name="Indirect")
    assert_refused("'Taken'.*vertex group", receivers)
    (warning,) = write_color_attribute(values(12), receivers_for((free, "POINT"), (taken, "POINT")), "Indirect")
    assert "Left out" in warning and "'Taken'" in warning and "Indirect" in free.data.attributes


def light_after(change):
    """Warnings, when `change(obj)` happens to the first of two cubes between reading and writing; and both."""
    one, two = scenes.add_cube("One"), scenes.add_cube("Two")
    receivers = receivers_for((one, "POINT"), (two, "POINT"))
    meanwhile = as_read(receivers)
    change(one)
    return write_color_attribute(values(16), receivers, "Indirect", meanwhile), two


def other_mesh(obj):
    obj.data = scenes.add_plane().data


def other_faces(obj):
    obj.data.flip_normals()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (other_mesh, "its mesh was changed"),
        (other_faces, "its mesh was changed"),
        (lambda obj: obj.data.vertices.add(1), "its mesh was changed"),
        (lambda obj: bpy.data.objects.remove(obj), "it was deleted"),
    ],
)
def test_a_mesh_that_changed_meanwhile_is_left_out_alone(change, says):
    (warning,), two = light_after(change)
    assert f"'One' got no light, since {says}" in warning and warning.endswith(".")
    assert "Indirect" in two.data.attributes
    assert not any("Indirect" in mesh.attributes for mesh in bpy.data.meshes if mesh != two.data)


def test_nothing_left_to_write_is_an_error():
    obj = scenes.add_cube()
    receivers = receivers_for((obj, "POINT"))
    meanwhile = as_read(receivers)
    bpy.data.objects.remove(obj)
    with pytest.raises(BakeError, match="'Cube' got no light, since it was deleted"):
        write_color_attribute(values(8), receivers, "Indirect", meanwhile)


def rename(obj):
    obj.name, obj.data.name = "Another", "Mesh of another"


def test_renaming_is_harmless():
    warnings, _ = light_after(rename)
    assert warnings == [] and read(bpy.data.objects["Another"])[1][:, :3].max() > 0


def test_names_that_were_exchanged_keep_their_light():
    one, two = scenes.add_cube("One"), scenes.add_cube("Two")
    receivers = receivers_for((one, "POINT"), (two, "POINT"))
    meanwhile, light = as_read(receivers), values(16)
    one.name, two.name = "Third", "One"
    write_color_attribute(light, receivers, "Indirect", meanwhile)
    np.testing.assert_allclose(read(one)[1][:, :3], light[:8] / pi, rtol=1e-6)
    np.testing.assert_allclose(read(two)[1][:, :3], light[8:] / pi, rtol=1e-6)


def move_vertex(obj):
    obj.data.vertices[0].co.x += 0.1


def test_light_of_moved_vertices_comes_with_a_notice():
    (warning,), _ = light_after(move_vertex)
    assert "Vertices of object 'One' were moved" in warning
    assert read(bpy.data.objects["One"])[1][:, :3].max() > 0


def edit(*objects):
    bpy.ops.object.select_all(action="DESELECT")
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.mode_set(mode="EDIT")


@pytest.mark.parametrize("n", [1, 2])
def test_edit_mode_is_left_and_come_back_to(n):
    objects = [scenes.add_cube(name) for name in ("One", "Two", "Three")]
    receivers = receivers_for(*((obj, "CORNER") for obj in objects))
    meanwhile, light = as_read(receivers), values(len(receivers))
    edit(*objects[:n])
    objects[2].select_set(True)
    with edit_mode_left():
        assert write_color_attribute(light, receivers, "Indirect", meanwhile) == []
    assert [obj.mode for obj in objects] == ["EDIT"] * n + ["OBJECT"] * (3 - n)
    assert [obj.select_get() for obj in objects] == [True, n == 2, True]
    bpy.ops.object.mode_set(mode="OBJECT")
    for i, obj in enumerate(objects):
        np.testing.assert_allclose(read(obj)[1][:, :3], light[24 * i : 24 * (i + 1)] / pi, rtol=1e-6)


def test_what_was_edited_meanwhile_is_left_out():
    obj, other = scenes.add_cube("One"), scenes.add_cube("Two")
    receivers = receivers_for((obj, "POINT"), (other, "POINT"))
    meanwhile = as_read(receivers)
    edit(obj)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    with edit_mode_left():
        (warning,) = write_color_attribute(values(16), receivers, "Indirect", meanwhile)
    assert "'One' got no light" in warning and obj.mode == "EDIT" and "Indirect" in other.data.attributes


def test_objects_that_stand_elsewhere_are_named():
    scenes.add_cube("One"), scenes.add_cube("Two")
    bpy.context.view_layer.update()
    placement = Placement(bpy.context.view_layer)
    assert placement.moved(bpy.context.view_layer) == []
    bpy.data.objects["Two"].location.x = 0.01
    bpy.data.objects["One"].name = "Renamed"
    bpy.context.view_layer.update()
    assert placement.moved(bpy.context.view_layer) == ["Two"]
