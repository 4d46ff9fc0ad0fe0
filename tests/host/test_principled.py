"""Principled shaders as closures of materials."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials.material_reader import DEFAULT_GREY
from photon_bake.addon.scene import Lobe
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import F0, expect, principled, read


def test_principled_dielectric():
    material = principled(Base_Color=(0.6, 0.4, 0.2), Roughness=0.3, IOR=1.5)
    expect(
        read(material),
        diffuse=(0.6, 0.4, 0.2),
        f0=F0,
        f90=1,
        ior=1.5,
        layer_f0=F0,
        roughness=0.3,
        coverage=1,
        tint=1,
        emission=0,
        glass_transmission=0,
        preserves_energy=True,
    )


def test_principled_specular_level_and_tint():
    material = principled(Specular_IOR_Level=1.0, Specular_Tint=(1, 0.5, 0))
    root = (2 * F0) ** 0.5
    ior = (1 + root) / (1 - root)
    expect(read(material), f0=(2 * F0, F0, 0), f90=1, ior=ior, layer_f0=2 * F0)


def test_principled_without_specular():
    expect(read(principled(Specular_IOR_Level=0.0)), f0=0, f90=0, layer_f0=0, diffuse=DEFAULT_GREY)


def test_principled_metal():
    materials = read(principled(Base_Color=(0.9, 0.6, 0.3), Metallic=1.0, Roughness=0.2))
    expect(materials, diffuse=0, f0=(0.9, 0.6, 0.3), f90=1, ior=0, layer_f0=0, roughness=0.2)


def test_principled_half_metal():
    materials = read(principled(Base_Color=(0.8, 0.4, 0.2), Metallic=0.25))
    f0 = 0.25 * np.array([0.8, 0.4, 0.2]) + 0.75 * F0
    expect(materials, diffuse=(0.6, 0.3, 0.15), f0=f0, f90=1, layer_f0=F0)


def test_principled_glass():
    materials = read(principled(Base_Color=(0.81, 0.64, 0.25), Transmission_Weight=1.0, IOR=1.33, Roughness=0.0))
    expect(
        materials,
        diffuse=0,
        f0=0,
        f90=0,
        glass_reflection=1,
        glass_transmission=(0.9, 0.8, 0.5),
        ior=1.33,
        fresnel=True,
        roughness=0,
        layer_f0=0,
    )


@pytest.mark.skipif(bpy.app.version < (5, 2, 0), reason="there is no Thin Wall")
def test_thin_wall():
    """Cycles lets 0.844 of a sky's light through a white pane, and 0.175 through one of a quarter."""
    for z, base in enumerate((1.0, 0.25)):
        material = principled(Base_Color=(base,) * 3, Transmission_Weight=1.0, Roughness=0.0, Thin_Wall=True)
        scenes.add_plane(material=material).location.z = z
    materials = scenes.extracted().materials
    passing = (1 - materials.coverage.value) * materials.tint.value
    np.testing.assert_allclose(passing[:, 0], [0.844, 0.175], atol=3e-3)
    np.testing.assert_allclose(
        (materials.coverage.value * scenes.weight_of(materials, Lobe.GLOSSY, "f0"))[:, 0], 0.156, atol=3e-3
    )


def test_principled_alpha_and_emission():
    materials = read(
        principled(Base_Color=(0.6, 0.6, 0.6), Alpha=0.25, Emission_Color=(1, 0.5, 0.25), Emission_Strength=8.0)
    )
    # Channels are of the light that does not pass straight through.
    expect(materials, coverage=0.25, tint=1, diffuse=0.6, emission=(8, 4, 2), f0=F0)


def test_principled_of_everything_is_a_sum_of_shares():
    material = principled(Metallic=0.5, Transmission_Weight=0.5, Alpha=0.5, Base_Color=(1.0, 1.0, 1.0))
    expect(
        read(material),
        coverage=0.5,
        diffuse=0.25,
        glass_reflection=0.25,
        glass_transmission=0.25,
        f0=0.5 + 0.25 * F0,
        f90=0.75,
    )


def test_channels_never_give_more_than_they_get():
    """Metal, glass and transparency in any proportion share one unit of light."""
    rng = np.random.default_rng(3)
    for i in range(20):
        values = {
            name: float(v)
            for name, v in zip(("Metallic", "Transmission_Weight", "Alpha"), rng.uniform(0, 1, 3), strict=True)
        }
        scenes.add_plane(material=principled(Base_Color=(1.0, 1.0, 1.0), **values)).location.z = i
    materials = scenes.extracted().materials
    diffuse, glass = scenes.weight_of(materials, Lobe.DIFFUSE), scenes.weight_of(materials, Lobe.GLASS, "f90")
    gloss = scenes.weight_of(materials, Lobe.GLOSSY, "f90")
    np.testing.assert_array_less(diffuse + glass + gloss, 2)
    metal = gloss - diffuse
    np.testing.assert_allclose(diffuse + glass + metal, 1, atol=1e-4)
