"""Shader nodes as closures with facets: their distributions, Fresnel curves, films and tangents."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials.stretches import SOCKETS
from photon_bake.addon.scene import Distribution, FresnelCurve
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import expect, principled, read, shader, tree_of


@pytest.mark.parametrize(
    ("kind", "distribution", "what", "keeps_energy"),
    [
        ("Glossy", "MULTI_GGX", Distribution.GGX, True),
        ("Glossy", "GGX", Distribution.GGX, False),
        ("Glossy", "BECKMANN", Distribution.BECKMANN, False),
        ("Glossy", "ASHIKHMIN_SHIRLEY", Distribution.ASHIKHMIN_SHIRLEY, False),
        ("Glass", "BECKMANN", Distribution.BECKMANN, False),
        ("Refraction", "BECKMANN", Distribution.BECKMANN, False),
        ("Metallic", "BECKMANN", Distribution.BECKMANN, False),
        ("Metallic", "MULTI_GGX", Distribution.GGX, True),
    ],
)
def test_distributions(kind, distribution, what, keeps_energy):
    material, tree, show = tree_of()
    surface = shader(tree, f"Bsdf{kind}", Roughness=0.5)
    surface.distribution = distribution
    show(surface)
    warnings = []
    expect(read(material, warnings), distribution=what, preserves_energy=keeps_energy, roughness=0.5)
    assert not warnings


def test_edges_of_metals():
    tint = (1, 0.5, 0.2)
    values = {"f0": 0.5, "curve": FresnelCurve.F82, "edge": tint}
    metal = {"Base_Color": (0.5,) * 3, "Metallic": 1.0, "Specular_Tint": tint}
    expect(read(principled(**metal)), **values)
    material, tree, show = tree_of()
    show(shader(tree, "BsdfMetallic", Base_Color=(0.5,) * 3, Edge_Tint=tint))
    expect(read(material), **values)


def test_physical_conductors():
    material, tree, show = tree_of()
    surface = tree.nodes.new("ShaderNodeBsdfMetallic")
    surface.fresnel_type = "PHYSICAL_CONDUCTOR"
    surface.inputs["IOR"].default_value, surface.inputs["Extinction"].default_value = (0.2, 0.5, 1.5), (3, 2.5, 2)
    show(surface)
    f0 = ((0.8**2 + 9) / (1.2**2 + 9), (0.25 + 2.5**2) / (1.5**2 + 2.5**2), (0.25 + 4) / (2.5**2 + 4))
    expect(read(material), f0=f0, curve=FresnelCurve.CONDUCTOR, edge=(0.2, 0.5, 1.5))


@pytest.mark.parametrize(("thickness", "metallic"), [(400, 0), (0.1, 0), (400, 1)])
def test_thin_films(thickness, metallic):
    late = bpy.app.version >= (5, 0, 0)
    film = {"Thin_Film_Thickness": float(thickness), "Thin_Film_IOR": 1.5}
    there_is = thickness > 1 and (late or not metallic)
    expect(read(principled(Metallic=float(metallic), **film)), film=(thickness, 1.5, late) if there_is else 0)


@pytest.mark.parametrize(
    ("kind", "amount", "along"),
    [("Principled", 0.5, 0.55**-0.5), ("Metallic", 0.5, 0.55**-0.5), ("Glossy", 0.5, 0.5), ("Glossy", -0.5, 2)],
)
def test_stretched_facets(kind, amount, along):
    material, tree, show = tree_of()
    surface = shader(tree, f"Bsdf{kind}")
    for socket, value in zip(SOCKETS[surface.type], (amount, 0.25), strict=True):
        surface.inputs[socket].default_value = value
    show(surface)
    warnings = []
    expect(read(material, warnings), stretch=(along, 0.25, 0.25))
    assert not warnings


def test_tangents_around_an_axis_of_the_generated_coordinates():
    """On a plane around the origin those around X and Z are as (0, −z, y) and (−y, x, 0)."""
    material, tree, show = tree_of()
    surface, tangent = shader(tree, "BsdfPrincipled", Anisotropic=0.5), tree.nodes.new("ShaderNodeTangent")
    tree.links.new(tangent.outputs[0], surface.inputs["Tangent"])
    show(surface)
    scenes.add_plane(material=material)
    for axis, of in (("X", lambda x, y: (0 * x, 0 * x, y)), ("Z", lambda x, y: (-y, x, 0 * x))):
        tangent.axis = axis
        scene = scenes.extracted()
        corners = scene.vertices[scene.triangles]
        expected = np.stack(of(corners[..., 0], corners[..., 1]), axis=-1)
        found = scene.frames.corner_tangents[:, :, 2]
        np.testing.assert_allclose(np.cross(found, expected), 0, atol=1e-5)
        assert (np.sum(found * expected, axis=-1) > 0).all()
