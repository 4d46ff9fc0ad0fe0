"""What of a material is not baked as Cycles renders it."""

from collections.abc import Iterator

import bpy

from .materials.closures import ADDERS, Closure
from .materials.nodes import TAKEN_FOR_ONE, all_nodes, is_used
from .materials.shaders.hair import HAIR
from .materials.stretches import tangent_sources
from .media.volume_shaders import volume_differences, volume_shortcomings


def shortcomings(material: "bpy.types.Material", closures: list[Closure], on_fibres: bool = False) -> Iterator[str]:
    """Half sentences about what cannot be baked as it is, on meshes or on hair."""
    yield from volume_shortcomings(material)
    yield from volume_differences(material)
    if any(node.type == "PARTICLE_INFO" for node in all_nodes(material.node_tree)):
        yield "what it reads of particles is baked as zero"
    if any(getattr(node, "from_instancer", False) for node in all_nodes(material.node_tree)):
        yield "its texture coordinates from instancers are baked as zero"
    if any(is_used(material.node_tree, "LIGHT_PATH", output) for output in TAKEN_FOR_ONE):
        yield "what it mixes by rays' lengths and depths is baked as of rays of 1 m and of two bounces at most"
    if on_fibres and any(is_used(material.node_tree, "HAIR_INFO", size) for size in ("Length", "Thickness")):
        yield "the length and thickness that it reads of strands are baked as their means"
    tangents = tangent_sources(closure.shader for closure in closures)
    if None in tangents:
        yield "the tangents that nodes compute for its anisotropy are baked as those around Z"
    if len(tangents) > 1:
        yield "all of its anisotropic shaders are baked with the tangents of the first"
    for closure in closures:
        yield from _of_closure(closure, on_fibres)


def _of_closure(closure: Closure, on_fibres: bool) -> Iterator[str]:
    node = closure.node
    if on_fibres and node.type == "BSDF_HAIR_PRINCIPLED" and node.model == "HUANG":
        yield "its Principled Hair BSDF of Huang's model is baked by Chiang's"
    elif node.type in HAIR and not on_fibres:
        yield f"its {node.bl_label} is baked without highlights, as a diffuse and a translucent surface"
    elif closure.kind not in ADDERS:
        yield f"its {node.bl_label} is baked as diffuse"
