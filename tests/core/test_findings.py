"""Warnings of a kind are one line, whatever they name."""

import copy

import pytest
from photon_bake.addon.core.errors import Advice, Missing, TooCoarse
from photon_bake.addon.core.findings import counted, grouped


@pytest.mark.parametrize(
    ("sentence", "line", "remedy"),
    [
        (
            "Mesh '{}' is shared by 'A', 'B' and got the mean of their light: make it …",
            "12 meshes: shared mesh",
            "single_user",
        ),
        ("Left out: Object '{}' has no faces to bake to: give it some.", "12 objects: no faces", None),
        ("Left out: Object '{}' has zero scale along an axis: give it …", "12 objects: no scale along an axis", None),
        (
            "Object '{}': 12% of its surface shows no light, as its modifier 'M' makes …",
            "12 objects: faces without light",
            "bake_copies",
        ),
        ("Object '{}' turns its back to the light, and its front …", "12 objects: back to the light", "flip_normals"),
        ("Object '{}' is inside out: its normals point …", "12 objects: inside out", "recalculate_outside"),
        (
            "Object '{}' has too few vertices for its size to show light: subdivide it.",
            "12 objects: too few vertices",
            "refine",
        ),
        (
            "Object '{}' got no light, since it was deleted during the bake: bake again.",
            "12 objects: changed during the bake",
            "bake",
        ),
        ("Material '{}': its coat is not baked.", "12 materials: coat is not baked", None),
        (
            "The lightmap of '{}' has 8 texels a meter instead of 16, for …",
            "12 lightmaps: larger than Max Size",
            "max_size",
        ),
        (
            "Light '{}': it has no area, so it gives no light; give it a size.",
            "12 lights: it has no area, so it gives no light",
            None,
        ),
    ],
)
def test_many_of_a_kind_are_one_line(sentence, line, remedy):
    sentences = [sentence.format(f"Thing {i}") for i in range(12)]
    (finding,) = grouped(sentences)
    assert finding.line == line
    assert finding.sentences == tuple(sentences) and len(finding.names) >= 12 and "Thing 7" in finding.names
    assert (finding.remedies or (None,))[0] == remedy


def test_one_is_said_by_its_name():
    (finding,) = grouped(["Left out: Object 'Box' has no faces to bake to: give it some."])
    assert finding.line == "Box: no faces" and finding.names == ("Box",)
    (odd,) = grouped(["Something that nobody knows."])
    assert odd.line == odd.sentences[0] and not odd.names


def test_a_list_in_a_sentence_is_counted():
    (finding,) = grouped(["3 object(s) are not meshes and got no light ('A', 'B', 'C'): turn on Bake Copies, or …"])
    assert finding.line == "3 objects: not a mesh" and finding.names == ("A", "B", "C")


def test_meshes_too_coarse_are_all_named():
    """Their sentence has five names, their button refines all."""
    (finding,) = grouped([TooCoarse(f"Wall {i}" for i in range(12))])
    assert finding.line == "12 objects: too few vertices" and finding.remedies == ("refine",)
    assert finding.names == tuple(f"Wall {i}" for i in range(12))
    (finding,) = grouped([TooCoarse(["Wall"])])
    assert finding.line == "Wall: too few vertices" and finding.names == ("Wall",)


def test_kinds_stay_apart_and_in_order():
    one, two = "Material 'A': its coat is not baked.", "Material 'B': its coat is not baked."
    found = grouped([Missing("Image 'x' is missing."), one, Advice(two)])
    assert [finding.kind for finding in found] == ["missing", "difference", "advice"]


def test_plurals():
    assert [counted(n, noun) for n, noun in ((1, "mesh"), (2, "mesh"), (1200, "object"))] == [
        "1 mesh",
        "2 meshes",
        "1,200 objects",
    ]


def test_advice_on_coarse_meshes_can_be_copied():
    advice = TooCoarse(["Wall", "Floor"])
    assert copy.deepcopy(advice) == advice and copy.deepcopy(advice).names == advice.names
