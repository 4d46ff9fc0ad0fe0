"""Light written back to meshes."""

from math import pi

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import write_color_attribute
from photon_bake.addon.errors import BakeError
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


def test_taken_names_are_refused_before_anything_is_written():
    free, taken = scenes.add_cube("Free"), scenes.add_plane("Taken")
    receivers = receivers_for((free, "POINT"), (taken, "POINT"))
    assert_refused("'Taken'.*not a colour", receivers, "UVMap")
    taken.vertex_groups.new(name="Indirect")
    assert_refused("'Taken'.*vertex group", receivers)


def test_mesh_that_changed_meanwhile():
    obj = scenes.add_cube()
    receivers = receivers_for((obj, "POINT"))
    obj.data = scenes.add_plane().data
    assert_refused("'Cube' was changed", receivers)
    bpy.data.objects.remove(obj)
    assert_refused("'Cube' is gone", receivers)


def test_edit_mode():
    obj = scenes.add_cube()
    receivers = receivers_for((obj, "POINT"))
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(BakeError, match="'Cube' is in edit mode"):
        write_color_attribute(values(8), receivers, "Indirect")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "Indirect" not in obj.data.attributes
