"""Subsurface scattering as it is read: the bodies of Blender 5, and what it is to diffuse rays of 4.5."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.scene import Lobe, RayKind
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import read, shader, tree_of

walks = pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="diffuse rays see it as diffuse")


def body(method, **values):
    """The only closure of a Subsurface Scattering shader, and what is warned of."""
    material, tree, show = tree_of()
    node = shader(tree, "SubsurfaceScattering", Color=(0.8, 0.5, 0.2), Scale=0.5)
    node.falloff, node.inputs["Radius"].default_value = method, (1, 0.5, 0)
    for name, value in values.items():
        node.inputs[name].default_value = value
    show(node)
    return read(material, warnings := []), warnings


@walks
def test_a_random_walk():
    materials, warnings = body("RANDOM_WALK", Anisotropy=-0.5, Roughness=0.49, IOR=1.3)
    closures = materials.closures
    assert closures.kind.tolist() == [Lobe.DIFFUSE, Lobe.SUBSURFACE] and not warnings
    np.testing.assert_allclose(closures.weight.value, [[0, 0, 0.2], [0.8, 0.5, 0]], atol=1e-6)
    np.testing.assert_allclose(closures.f90.value[1], [0.5, 0.25, 0], atol=1e-6)
    np.testing.assert_allclose(closures.edge.value[1], [-0.5, 0, 0], atol=1e-6)
    assert closures.roughness.value[1, 0] == pytest.approx(0.7) and closures.ior[1] == pytest.approx(1.3)


@walks
@pytest.mark.parametrize(
    ("method", "spread", "scale"), [("RANDOM_WALK_LEGACY", 0, 0.25 / np.pi), ("RANDOM_WALK_SKIN", 0.5, 0)]
)
def test_older_random_walks(method, spread, scale):
    closures = body(method)[0].closures
    np.testing.assert_allclose(closures.edge.value[1], [0, spread, 1], atol=1e-6)
    if scale:
        np.testing.assert_allclose(closures.f90.value[1, 0], 0.5 * scale, rtol=1e-5)
    else:  # deeper where less is absorbed
        assert closures.f90.value[1, 0] / 0.5 < closures.f90.value[1, 1] / 0.25 < 2


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="diffuse rays see it, too")
def test_cameras_alone_see_walks():
    materials, warnings = body("RANDOM_WALK")
    closures, seen = materials.closures, materials.seen_as[0].reshape(-1, 2)[:, 0]
    assert not warnings and len(materials) == 2
    assert [kind for kind in RayKind if seen[kind] != seen[RayKind.DIFFUSE]] == [RayKind.CAMERA]
    assert closures.kind.tolist() == [Lobe.DIFFUSE, Lobe.DIFFUSE, Lobe.SUBSURFACE]
    np.testing.assert_allclose(closures.weight.value[0], [0.8, 0.5, 0.2], atol=1e-6)
    np.testing.assert_allclose(closures.f90.value[2], np.multiply([0.5, 0.25, 0], 0.25 / np.pi), rtol=1e-5)


def test_a_principled_shader_without_it_looks_the_same_to_all():
    material, _ = scenes.add_material("Plain")
    materials = read(material)
    assert len(materials) == 1 and not materials.subsurface.any()


def test_what_is_diffuse():
    materials, warnings = body("BURLEY")
    assert materials.closures.kind.tolist() == [Lobe.DIFFUSE] and not warnings
    np.testing.assert_allclose(scenes.weight_of(materials, Lobe.DIFFUSE)[0], [0.8, 0.5, 0.2], atol=1e-6)


@walks
def test_part_of_a_principled_base():
    material, surface = scenes.add_material("Skin")
    surface.subsurface_method = "RANDOM_WALK"
    given = {"Base Color": (0.5, 0.5, 0.5, 1), "Subsurface Weight": 0.4, "Specular IOR Level": 1.0, "Roughness": 0.3}
    for name, value in given.items():
        surface.inputs[name].default_value = value
    closures = read(material, warnings := []).closures
    k = int(np.flatnonzero(closures.kind == Lobe.SUBSURFACE)[0])
    assert not warnings and closures.kind[closures.layer[k]] == Lobe.GLOSSY
    np.testing.assert_allclose(closures.weight.value[k], 0.2, atol=1e-6)
    assert closures.ior[k] == pytest.approx((1 + 0.08**0.5) / (1 - 0.08**0.5), rel=1e-3)
    assert closures.roughness.value[k, 0] == pytest.approx(0.3)
