"""Where each object's light goes: its image, its place in it, and the UV map that is made where none is chosen."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain
from math import sqrt

import bpy
import numpy as np

from ...errors import Advice, BakeError
from ...lightmap_settings import LARGEST_SIZE, MADE_UV_MAP, LightmapSettings
from ...progress import Progress
from .charts import Faces, areas
from .packing import Packed, Piece, PiecesAt, fill, pack, whole_blocks
from .pieces import Pieces

ScaleOffset = tuple[float, float, float, float]

WHOLE: ScaleOffset = (1.0, 1.0, 0.0, 0.0)
"""Scale and offset of an object whose UV map lies in its image as it is."""

_FULL = 0.75  # share of an image that charts usually take
_FEW = 4  # objects of a material that have an image each where the choice is ours
_LEAST_DENSITY = 1e-3  # texels a metre: charts are as small as they get


@dataclass(frozen=True)
class Place:
    """Where the light of an object goes.

    Attributes
    ----------
    object_name, mesh_name : str
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


def lay_out(
    objects: "list[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    settings: LightmapSettings,
    warnings: list[str],
    progress: Progress,
) -> Layout:
    """Find images and places for the light of objects; changes no data-block.

    Raises
    ------
    BakeError
        If a mesh has no such UV map, or the charts do not fit into the images, saying which size would do.
    """
    if settings.uv_map:
        return _as_chosen(objects, depsgraph, settings, warnings)
    pieces = Pieces.of(objects, depsgraph, progress)
    shares = settings.atlas == "shared" or (settings.atlas == "auto" and share_materials(objects))
    return (_shared if shares else _per_object)(pieces, settings, warnings, progress)


def share_materials(objects: "Sequence[bpy.types.Object]") -> bool:
    """Whether more than `_FEW` objects have a material in common, which then would have to read as many images."""
    of_object = ({slot.material for slot in obj.material_slots} or {None} for obj in objects)
    return max(Counter(chain.from_iterable(of_object)).values(), default=0) > _FEW


def _as_chosen(
    objects: "list[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    settings: LightmapSettings,
    warnings: list[str],
) -> Layout:
    """The chosen UV maps as they lie, in an image each or all in one."""
    sides = [_side_of_image(obj, depsgraph, settings.uv_map) for obj in objects]
    images, names = list(range(len(objects))), [obj.name for obj in objects]
    if settings.atlas == "shared":
        sides, images, names = [max(sides)], [0] * len(objects), ["Atlas"]
    sizes = []
    for side, name in zip(sides, names, strict=True):
        size = settings.size or whole_blocks(settings.density * side)
        if not settings.size and size > settings.max_size:
            warnings.append(_limited(f"'{name}'", f"{size:,}", settings.max_size / side, settings))
            size = settings.max_size
        sizes.append((size, size))
    places = [Place(obj.name, obj.data.name, image) for obj, image in zip(objects, images, strict=True)]
    return Layout(tuple(sizes), tuple(names), tuple(places), settings.uv_map)


def _side_of_image(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph", uv_map: str) -> float:
    """Side that an image has in space where it lies on an object by a UV map, m: how many times UV is enlarged."""
    layer = obj.data.uv_layers.get(uv_map)
    if layer is None:
        there_are = ", ".join(f"'{one.name}'" for one in obj.data.uv_layers) or "none"
        raise BakeError(
            f"Object '{obj.name}' has no UV map '{uv_map}' (there are: {there_are}): add one of that name, or choose "
            "none and have it made."
        )
    faces = Faces.of(obj.data, np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)[:3, :3])
    uv = np.empty((len(obj.data.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uv.reshape(-1))
    flat = float(areas(uv[faces.triangles]).sum())
    if not flat > 0:
        raise BakeError(
            f"The UV map '{uv_map}' of object '{obj.name}' has no area: unwrap the mesh, or choose no UV map and have "
            "one made."
        )
    return sqrt(faces.area / flat)


def _per_object(pieces: Pieces, settings: LightmapSettings, warnings: list[str], progress: Progress) -> Layout:
    """An image for each object; those that share a mesh have images of the same size."""
    packed = {}
    for mesh in pieces.of_mesh:
        progress.check()
        owner = next(name for name, of in pieces.objects if of == mesh)
        packed[mesh] = _one_image(pieces.charts_of(mesh), settings, f"'{owner}'", warnings)
    return Layout(
        sizes=tuple((packed[mesh].height, packed[mesh].width) for _, mesh in pieces.objects),
        names=tuple(name for name, _ in pieces.objects),
        places=tuple(Place(name, mesh, i) for i, (name, mesh) in enumerate(pieces.objects)),
        uv_map=MADE_UV_MAP,
        made={mesh: of_mesh.uv[0] for mesh, of_mesh in packed.items()},
    )


def _shared(pieces: Pieces, settings: LightmapSettings, warnings: list[str], progress: Progress) -> Layout:
    """As few images as needed for all objects, of which each lies in one."""
    todo, atlases = [list(range(len(pieces.objects)))], []
    while todo:
        progress.check()
        chosen = todo.pop(0)
        pieces_at, turns = pieces.at(chosen, settings.ring, _fixed_density(settings)), not pieces.any_shared(chosen)
        packed = _as_asked(pieces_at, settings, turns)
        if packed is None and len(chosen) > 1 and not settings.size:
            todo = pieces.split(chosen) + todo
            continue
        whose = f"'{pieces.objects[chosen[0]][0]}'" if len(chosen) == 1 else "all objects"
        atlases.append((chosen, packed or _smaller(pieces_at, settings, whose, warnings, turns)))
    return _of_atlases(pieces, atlases, settings)


def _fixed_density(settings: LightmapSettings) -> float:
    """Texels a metre, or 0 where they follow from the images' size."""
    return 0.0 if settings.size else settings.density


def _of_atlases(pieces: Pieces, atlases: list[tuple[list[int], Packed]], settings: LightmapSettings) -> Layout:
    places: dict[int, Place] = {}
    made = {}
    for image, (chosen, packed) in enumerate(atlases):
        for i, uv in zip(chosen, packed.uv, strict=True):
            name, mesh = pieces.objects[i]
            scale_offset = WHOLE
            if pieces.is_shared(mesh):
                made[mesh] = pieces.alone(mesh, _fixed_density(settings) or packed.density, settings.ring).uv[0]
                (left, bottom), (right, top) = uv[0].tolist(), uv[2].tolist()
                scale_offset = (right - left, top - bottom, left, bottom)
            else:
                made[mesh] = uv
            places[i] = Place(name, mesh, image, scale_offset)
    names = ("Atlas",) if len(atlases) == 1 else tuple(f"Atlas {i + 1}" for i in range(len(atlases)))
    sizes = tuple((packed.height, packed.width) for _, packed in atlases)
    return Layout(sizes, names, tuple(places[i] for i in range(len(places))), MADE_UV_MAP, made)


def _one_image(pieces_at: PiecesAt, settings: LightmapSettings, whose: str, warnings: list[str]) -> Packed:
    """The image of pieces that must be in one."""
    return _as_asked(pieces_at, settings) or _smaller(pieces_at, settings, whose, warnings)


def _as_asked(pieces_at: PiecesAt, settings: LightmapSettings, turns: bool = True) -> Packed | None:
    """The image of pieces at the density or of the size asked for; None if they do not fit."""
    if settings.size:
        return fill(pieces_at, settings.size, settings.ring, turns)
    pieces = pieces_at(settings.density)
    if _side(pieces, settings.density) > settings.max_size:
        return None
    packed = pack(pieces, settings.density, settings.ring, 0, turns)
    return packed if packed and max(packed.width, packed.height) <= settings.max_size else None


def _smaller(
    pieces_at: PiecesAt, settings: LightmapSettings, whose: str, warnings: list[str], turns: bool = True
) -> Packed:
    """The largest image there may be of pieces that would need a larger one.

    Raises
    ------
    BakeError
        If there are too many charts for it, whatever the density.
    """
    side, ring = settings.size or settings.max_size, settings.ring
    limited = None if settings.size else fill(pieces_at, side, ring, turns)
    if limited is None:
        needed = _needed(pieces_at, _LEAST_DENSITY, ring, turns)
        raise BakeError(
            f"The charts of {whose} do not fit into a lightmap of {side} × {side} texels: set "
            f"{'Size' if settings.size else 'Max Size'} to {needed} or more."
        )
    needed = _needed(pieces_at, settings.density, ring, turns)
    warnings.append(_limited(whose, needed, limited.density, settings))
    return limited


def _needed(pieces_at: PiecesAt, density: float, ring: int, turns: bool) -> str:
    """Sides of the image that pieces fit into, texels; estimated where it is huge."""
    pieces = pieces_at(density)
    packed = pack(pieces, density, ring, 0, turns) if _side(pieces, density) <= LARGEST_SIZE else None
    side = max(packed.width, packed.height) if packed else whole_blocks(_side(pieces, density) / sqrt(_FULL))
    return f"{side:,}"


def _side(pieces: Sequence[Piece], density: float) -> float:
    """Side of the smallest image that could hold pieces, texels."""
    return density * sqrt(sum(piece.area for piece in pieces))


def _limited(whose: str, needed: str, density: float, settings: LightmapSettings) -> str:
    return Advice(
        f"The lightmap of {whose} has {density:.3g} texels a metre instead of {settings.density:g}, for which it would "
        f"have to be {needed} texels wide: raise Max Size, or lower Density."
    )
