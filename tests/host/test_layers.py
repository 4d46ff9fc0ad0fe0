"""Coats, sheen, diffuse roughness, toon and hair as closures of materials."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.scene import Lobe
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import principled, read, shader, tree_of


def closures_of(material, warnings=None):
    """By kind, the values of a material's closures."""
    closures = read(material, warnings).closures
    names = ("weight", "roughness", "f0", "f90")
    values = [{name: getattr(closures, name).value[k] for name in names} for k in range(len(closures))]
    for k, of_one in enumerate(values):
        of_one |= {"kind": Lobe(closures.kind[k]), "ior": closures.ior[k], "layer": closures.layer[k], "k": k}
    assert len({of_one["kind"] for of_one in values}) == len(values) or "GLOSSY" in str(values)
    return values


def of_kind(found, kind):
    return next(one for one in found if one["kind"] == kind)


def test_sheen_lies_over_a_coat_over_its_tint_over_gloss_over_the_base():
    coat = {"Coat_Weight": 0.5, "Coat_Roughness": 0.2, "Coat_IOR": 1.6, "Coat_Tint": (0.9, 0.5, 0.2)}
    found = closures_of(principled(Sheen_Weight=0.5, Sheen_Tint=(1, 0.5, 0), Roughness=0.7, **coat), warnings := [])
    assert not warnings
    sheen, tint, base = (of_kind(found, kind) for kind in (Lobe.SHEEN, Lobe.ABSORBING, Lobe.DIFFUSE))
    lacquer, gloss = sorted((one for one in found if one["kind"] == Lobe.GLOSSY), key=lambda one: one["roughness"][0])
    order = [one["layer"] for one in (sheen, lacquer, tint, gloss, base)]
    assert order == [-1, sheen["k"], lacquer["k"], tint["k"], gloss["k"]]
    np.testing.assert_allclose(sheen["f0"], [0.5, 0.25, 0], atol=1e-6)
    np.testing.assert_allclose(lacquer["f0"], 0.5 * (0.6 / 2.6) ** 2, atol=1e-6)
    np.testing.assert_allclose([lacquer["f90"][0], lacquer["ior"], lacquer["roughness"][0]], [0.5, 1.6, 0.2], atol=1e-6)
    np.testing.assert_allclose([*tint["f0"], tint["roughness"][0], tint["ior"]], [0.9, 0.5, 0.2, 0.5, 1.6], atol=1e-6)


def test_metal_and_glass_lie_under_the_coat():
    found = closures_of(principled(Metallic=0.5, Transmission_Weight=1.0, Coat_Weight=1.0, Roughness=0.5))
    coat = next(one for one in found if one["layer"] < 0)
    others = [one for one in found if one is not coat]
    assert {one["kind"] for one in others} == {Lobe.GLOSSY, Lobe.GLASS}
    assert [one["layer"] for one in others] == [coat["k"]] * 2


def test_what_has_no_weight_is_no_layer():
    found = closures_of(principled(Sheen_Weight=1.0, Sheen_Tint=(0, 0, 0), Coat_Weight=0.0, Specular_IOR_Level=0.0))
    assert [one["kind"] for one in found] == [Lobe.DIFFUSE] and found[0]["layer"] == -1


@pytest.mark.parametrize(("coat", "sheen"), [({"Coat_Weight": 1.0}, 0.0), ({}, 1.0)], ids=["coat", "sheen"])
def test_light_under_layers_is_dimmed(coat, sheen):
    light = {"Emission_Color": (1, 1, 1), "Emission_Strength": 2.0}
    bare = read(principled(**light)).emission.value[0]
    under = read(principled(**light, **coat, Sheen_Weight=sheen)).emission.value[-1]
    np.testing.assert_allclose(bare, 2)
    assert (under < 0.95 * bare).all() and (under > 0.8 * bare).all()


def test_rough_diffuse():
    rough = of_kind(closures_of(principled(Diffuse_Roughness=0.5, Base_Color=(0.6, 0.4, 0.2))), Lobe.ROUGH_DIFFUSE)
    np.testing.assert_allclose(rough["f0"], [0.6, 0.4, 0.2])
    assert rough["roughness"][0] == 0.5 and rough["layer"] >= 0


@pytest.mark.parametrize(
    ("kind", "values", "choices", "lobe"),
    [
        ("BsdfDiffuse", {"Roughness": 0.5}, {}, Lobe.ROUGH_DIFFUSE),
        ("BsdfDiffuse", {"Roughness": 0.0}, {}, Lobe.DIFFUSE),
        ("BsdfSheen", {"Roughness": 0.5}, {"distribution": "MICROFIBER"}, Lobe.SHEEN),
        ("BsdfSheen", {"Roughness": 0.5}, {"distribution": "ASHIKHMIN"}, Lobe.VELVET),
        ("BsdfToon", {"Size": 0.5, "Smooth": 0.1}, {"component": "DIFFUSE"}, Lobe.TOON),
        ("BsdfToon", {"Size": 0.5, "Smooth": 0.1}, {"component": "GLOSSY"}, Lobe.GLOSSY_TOON),
        ("BsdfHair", {}, {"component": "Reflection"}, Lobe.DIFFUSE),
        ("BsdfHair", {}, {"component": "Transmission"}, Lobe.TRANSLUCENT),
    ],
)
def test_shaders_and_their_lobes(kind, values, choices, lobe):
    material, tree, show = tree_of()
    node = shader(tree, kind, Color=(0.6, 0.4, 0.2), **values)
    for name, value in choices.items():
        setattr(node, name, value)
    show(node)
    (found,) = closures_of(material)
    assert found["kind"] == lobe
    color = found["f0"] if lobe == Lobe.SHEEN else found["weight"]
    np.testing.assert_allclose(color, [0.6, 0.4, 0.2], atol=1e-6)
    if "Smooth" in values:
        np.testing.assert_allclose([found["roughness"][0], found["f90"][0]], [0.5, 0.1], atol=1e-6)


@pytest.mark.parametrize("parametrization", ["ABSORPTION", "MELANIN", "COLOR"])
def test_hair_keeps_the_power_of_light(parametrization):
    material, tree, show = tree_of()
    clear = {"Color": (1, 1, 1), "Melanin": 0.0, "Absorption_Coefficient": (0, 0, 0)}
    node = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    node.parametrization = parametrization
    for name, value in clear.items():
        one = next(one for one in node.inputs if one.name == name.replace("_", " "))
        one.default_value = (*value, 1) if one.type == "RGBA" else value
    show(node)
    found = closures_of(material, warnings := [])
    total = of_kind(found, Lobe.DIFFUSE)["weight"] + of_kind(found, Lobe.TRANSLUCENT)["weight"]
    np.testing.assert_allclose(total, 1, atol=1e-3)
    assert len(warnings) == 1 and "without highlights" in warnings[0]


@pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="there is no Thin Wall")
def test_a_sheet_scatters_to_both_sides():
    material = principled(
        Base_Color=(0.5,) * 3, Subsurface_Weight=0.8, Subsurface_Anisotropy=0.5, Thin_Wall=True, Specular_IOR_Level=0.0
    )
    materials = read(material, warnings := [])
    np.testing.assert_allclose(scenes.weight_of(materials, Lobe.TRANSLUCENT)[0], 0.5 * 0.8 * 0.75, atol=1e-5)
    np.testing.assert_allclose(scenes.weight_of(materials, Lobe.DIFFUSE)[0], 0.5 * (0.2 + 0.8 * 0.25), atol=1e-5)
    assert not warnings


@pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="there is no Thin Wall")
def test_a_rough_pane_tints_by_the_way_through_it():
    material = principled(Base_Color=(0.6, 0.9, 0.7), Transmission_Weight=1.0, Roughness=0.6, Thin_Wall=True)
    found = closures_of(material)
    tint, pane = of_kind(found, Lobe.ABSORBING), of_kind(found, Lobe.PANE)
    np.testing.assert_allclose(tint["f0"], [0.6, 0.9, 0.7], atol=1e-6)
    assert pane["layer"] == tint["k"] and tint["ior"] == 1.5
    np.testing.assert_allclose(pane["roughness"][0] ** 2, 0.36 * (3.4 * 0.5 / 1.5**3) ** 0.5, rtol=1e-3)
    np.testing.assert_allclose(pane["weight"] + of_kind(found, Lobe.GLOSSY)["weight"], 1, atol=1e-6)
