"""Stored meshes that are refined: which can be, their triangles where objects show them, and splits carried out."""

from .reading import REFINES_OTHERWISE, check_refinable, placed
from .splitting import has_refined_copies, restore_meshes, split_meshes
from .wide_faces import WideFaces

__all__ = [
    "REFINES_OTHERWISE",
    "WideFaces",
    "check_refinable",
    "has_refined_copies",
    "placed",
    "restore_meshes",
    "split_meshes",
]
