"""What is said of materials that are not baked as they are."""

import pytest
from photon_bake.tests.host import scenes
from photon_bake.tests.host.shader_trees import read, shader, tree_of

SHORTCOMINGS = {
    "Subsurface Weight": "its subsurface scattering is baked as diffuse",
    "Anisotropic": "its anisotropy is not baked",
    "Thin Film Thickness": "its thin film is not baked",
}


@pytest.mark.parametrize(("socket", "what"), SHORTCOMINGS.items())
def test_says_what_is_not_baked(socket, what):
    material, surface = scenes.add_material("Skin")
    surface.inputs[socket].default_value = 0.5
    warnings = []
    read(material, warnings)
    assert warnings == [f"Material 'Skin': {what}."]


@pytest.mark.parametrize(("kind", "roughness", "n"), [("Glossy", 0.5, 1), ("Glossy", 0.0, 0), ("Refraction", 0.5, 1)])
def test_says_that_other_distributions_are_baked_as_ggx(kind, roughness, n):
    material, tree, show = tree_of()
    surface = shader(tree, f"Bsdf{kind}", Roughness=roughness)
    surface.distribution = "BECKMANN"
    show(surface)
    warnings = []
    read(material, warnings)
    assert warnings == ["Material 'Material': its Beckmann distribution is baked as GGX."] * n


def test_says_that_edge_tint_is_not_baked():
    material, surface = scenes.add_material("Rock")
    surface.inputs["Metallic"].default_value = 1
    surface.inputs["Specular Tint"].default_value = (1, 0.5, 0.5, 1)
    warnings = []
    read(material, warnings)
    assert warnings == ["Material 'Rock': its edge tint is not baked."]


@pytest.mark.parametrize("kind", ["ParticleInfo", "UVMap"])
def test_says_that_instancers_are_not_asked(kind):
    material, tree, show = tree_of()
    node, diffuse = tree.nodes.new(f"ShaderNode{kind}"), shader(tree, "BsdfDiffuse")
    if kind == "UVMap":
        node.from_instancer = True
    tree.links.new(node.outputs[0], diffuse.inputs["Color"])
    show(diffuse)
    warnings = []
    read(material, warnings)
    assert [one for one in warnings if "baked as zero" in one]
