"""What is said of materials that are not baked as they are."""

import pytest
from photon_bake.tests.host.shader_trees import read, shader, tree_of


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


def test_says_what_tangents_are_not_known():
    material, tree, show = tree_of()
    surface, other = shader(tree, "BsdfPrincipled", Anisotropic=0.5), tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(other.outputs["Object"], surface.inputs["Tangent"])
    show(surface)
    warnings = []
    read(material, warnings)
    assert warnings == [
        "Material 'Material': the tangents that nodes compute for its anisotropy are baked as those around Z."
    ]
