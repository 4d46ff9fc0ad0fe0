"""Where each object's light goes: its image, its place in it, and the UV map that is made where none is chosen."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import sqrt

import numpy as np

from ...core.errors import Advice, BakeError
from ...receivers.uv_maps import Packed, Piece, PiecesAt, fill, pack, whole_blocks
from ...settings.lightmap import LARGEST_SIZE, MADE_UV_MAP, LightmapSettings
from .pieces import Pieces
from .subjects import LeftOut, Subject, Subjects

ScaleOffset = tuple[float, float, float, float]

WHOLE: ScaleOffset = (1.0, 1.0, 0.0, 0.0)
"""Scale and offset of an object whose UV map lies in its image as it is."""

_FULL = 0.75  # share of an image that charts usually take
_LEAST_DENSITY = 1e-3  # texels a metre: charts are as small as they get


@dataclass(frozen=True)
class Place:
    """Where the light of an object goes.

    Attributes
    ----------
    object_name, mesh_name : str
        The mesh is the object's own, or that of a copy.
    image : int
    scale_offset : (sx, sy, ox, oy)
        What its UV map has at (u, v) is in the image at (sx u + ox, sy v + oy).
    """

    object_name: str
    mesh_name: str
    image: int
    scale_offset: ScaleOffset = WHOLE


@dataclass(frozen=True)
class Layout:
    """The images of lightmaps, and the objects in them.

    Attributes
    ----------
    sizes : tuple of (height, width)
        Of the images, texels.
    names : tuple of str
        Of the images.
    places : tuple of Place
        One an object.
    uv_map : str
        Which the objects' meshes have, or get.
    made : dict of str to (c, 2) float32
        By mesh, the UV map that it gets; empty where one was chosen.
    """

    sizes: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    places: tuple[Place, ...]
    uv_map: str
    made: dict[str, np.ndarray] = field(default_factory=dict)

    def where(self, kept: Sequence[int]) -> "Layout":
        """The same with some of its places alone, and no image that is empty."""
        images = sorted({self.places[i].image for i in kept})
        number = {image: i for i, image in enumerate(images)}
        return replace(
            self,
            sizes=tuple(self.sizes[image] for image in images),
            names=tuple(self.names[image] for image in images),
            places=tuple(replace(self.places[i], image=number[self.places[i].image]) for i in kept),
        )


def lay_out(
    subjects: Subjects,
    pieces: Pieces,
    settings: LightmapSettings,
    share_materials: bool,
    warnings: list[str],
    out: LeftOut,
) -> tuple[Subjects, Layout]:
    """Images and places for surfaces whose UV maps are made, and which of them have one.

    Those whose charts do not fit into the largest image, whatever their density, are left out. Objects that share
    materials share images where the choice is ours: each material would have to read as many otherwise.
    """
    made = _shared if settings.atlas == "shared" or (settings.atlas == "auto" and share_materials) else _per_object
    chosen, layout = made(subjects, pieces, settings, warnings, out)
    return Subjects([subjects.all[i] for i in chosen], subjects.faces), layout


def lay_out_as_chosen(
    subjects: Sequence[Subject], sides: Sequence[float], settings: LightmapSettings, warnings: list[str]
) -> Layout:
    """The chosen UV maps as they lie, in an image each or all in one.

    Parameters
    ----------
    sides : sequence of float
        Of the image as it lies on each surface, m.
    """
    images, names = list(range(len(subjects))), [one.image_name for one in subjects]
    if settings.atlas == "shared":
        sides, images, names = [max(sides)], [0] * len(subjects), ["Atlas"]
    sizes = []
    for side, name in zip(sides, names, strict=True):
        size = settings.size or whole_blocks(settings.density * side)
        if not settings.size and size > settings.max_size:
            warnings.append(_limited(f"'{name}'", f"{size:,}", settings.max_size / side, settings))
            size = settings.max_size
        sizes.append((size, size))
    places = [Place(one.object_name, one.mesh_name, image) for one, image in zip(subjects, images, strict=True)]
    return Layout(tuple(sizes), tuple(names), tuple(places), settings.uv_map)


Laid = tuple[list[int], Layout]
"""Which of some surfaces have places, and the layout with these."""


def _per_object(
    subjects: Subjects, pieces: Pieces, settings: LightmapSettings, warnings: list[str], out: LeftOut
) -> Laid:
    """An image for each object; those that share a mesh have images of the same size."""
    packed: dict[str, Packed] = {}
    for mesh in subjects.faces:
        owner = next(one.object_name for one in subjects.all if one.mesh_name == mesh)
        try:
            packed[mesh] = _one_image(pieces, pieces.charts_of(mesh), settings, f"'{owner}'", warnings)
        except BakeError as error:
            out.add(str(error))
    chosen = [i for i, one in enumerate(subjects.all) if one.mesh_name in packed]
    placed = [subjects.all[i] for i in chosen]
    layout = Layout(
        sizes=tuple((packed[one.mesh_name].height, packed[one.mesh_name].width) for one in placed),
        names=tuple(one.image_name for one in placed),
        places=tuple(Place(one.object_name, one.mesh_name, i) for i, one in enumerate(placed)),
        uv_map=MADE_UV_MAP,
        made={mesh: of_mesh.uv[0] for mesh, of_mesh in packed.items()},
    )
    return chosen, layout


def _shared(subjects: Subjects, pieces: Pieces, settings: LightmapSettings, warnings: list[str], out: LeftOut) -> Laid:
    """As few images as needed for all objects, of which each lies in one."""
    todo, atlases = [list(range(len(subjects.all)))] if subjects.all else [], []
    while todo:
        pieces.check()
        chosen = todo.pop(0)
        pieces_at = pieces.at(chosen, settings.ring, _fixed_density(settings))
        packed = _as_asked(pieces, pieces_at, settings)
        if packed is None and len(chosen) > 1:
            todo = pieces.split(chosen) + todo
            continue
        name = subjects.all[chosen[0]].object_name
        try:
            atlases.append((chosen, packed or _smaller(pieces, pieces_at, settings, f"'{name}'", warnings)))
        except BakeError as error:
            out.add(str(error))
    return _of_atlases(subjects, pieces, atlases, settings)


def _fixed_density(settings: LightmapSettings) -> float:
    """Texels a metre, or 0 where they follow from the images' size."""
    return 0.0 if settings.size else settings.density


def _of_atlases(
    subjects: Subjects, pieces: Pieces, atlases: list[tuple[list[int], Packed]], settings: LightmapSettings
) -> Laid:
    places: dict[int, Place] = {}
    made = {}
    for image, (chosen, packed) in enumerate(atlases):
        for i, uv in zip(chosen, packed.uv, strict=True):
            one = subjects.all[i]
            scale_offset = WHOLE
            if pieces.is_shared(one.mesh_name):
                density = _fixed_density(settings) or packed.density
                made[one.mesh_name] = pieces.alone(one.mesh_name, density, settings.ring).uv[0]
                (left, bottom), (right, top) = uv[0].tolist(), uv[2].tolist()
                scale_offset = (right - left, top - bottom, left, bottom)
            else:
                made[one.mesh_name] = uv
            places[i] = Place(one.object_name, one.mesh_name, image, scale_offset)
    names = ("Atlas",) if len(atlases) == 1 else tuple(f"Atlas {i + 1}" for i in range(len(atlases)))
    sizes = tuple((packed.height, packed.width) for _, packed in atlases)
    chosen = sorted(places)
    return chosen, Layout(sizes, names, tuple(places[i] for i in chosen), MADE_UV_MAP, made)


def _one_image(
    pieces: Pieces, pieces_at: PiecesAt, settings: LightmapSettings, whose: str, warnings: list[str]
) -> Packed:
    """The image of pieces that must be in one."""
    return _as_asked(pieces, pieces_at, settings) or _smaller(pieces, pieces_at, settings, whose, warnings)


def _as_asked(pieces: Pieces, pieces_at: PiecesAt, settings: LightmapSettings) -> Packed | None:
    """The image of pieces at the density or of the size asked for; None if they do not fit."""
    if settings.size:
        return fill(pieces_at, settings.size, settings.ring, pieces.check)
    some = pieces_at(settings.density)
    if _side(some, settings.density) > settings.max_size:
        return None
    packed = pack(some, settings.density, settings.ring, 0, pieces.check)
    return packed if packed and max(packed.width, packed.height) <= settings.max_size else None


def _smaller(
    pieces: Pieces, pieces_at: PiecesAt, settings: LightmapSettings, whose: str, warnings: list[str]
) -> Packed:
    """The largest image there may be of pieces that would need a larger one.

    Raises
    ------
    BakeError
        If there are too many charts for it, whatever the density.
    """
    side, ring = settings.size or settings.max_size, settings.ring
    limited = None if settings.size else fill(pieces_at, side, ring, pieces.check)
    if limited is None:
        needed = _needed(pieces, pieces_at, _LEAST_DENSITY, ring)
        raise BakeError(
            f"The charts of {whose} do not fit into a lightmap of {side} × {side} texels: set "
            f"{'Size' if settings.size else 'Max Size'} to {needed} or more."
        )
    needed = _needed(pieces, pieces_at, settings.density, ring)
    warnings.append(_limited(whose, needed, limited.density, settings))
    return limited


def _needed(pieces: Pieces, pieces_at: PiecesAt, density: float, ring: int) -> str:
    """Sides of the image that pieces fit into, texels; estimated where it is huge."""
    some = pieces_at(density)
    packed = pack(some, density, ring, 0, pieces.check) if _side(some, density) <= LARGEST_SIZE else None
    side = max(packed.width, packed.height) if packed else whole_blocks(_side(some, density) / sqrt(_FULL))
    return f"{side:,}"


def _side(pieces: Sequence[Piece], density: float) -> float:
    """Side of the smallest image that could hold pieces, texels."""
    return density * sqrt(sum(piece.area for piece in pieces))


def _limited(whose: str, needed: str, density: float, settings: LightmapSettings) -> str:
    return Advice(
        f"The lightmap of {whose} has {density:.3g} texels a meter instead of {settings.density:g}, for which it would "
        f"have to be {needed} texels wide: raise Max Size, or lower Density."
    )
