"""Lightmaps of any number of objects behind one image node.

EEVEE has 32 samplers for all images of a material, and objects with images of their own may share one. So the images
of one format and one UV map are shown as the tiles of one tiled (UDIM) image, which takes two samplers whatever its
tiles. It is packed: its tiles are the images' files as they were.
"""

import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy

from ..lightmap.images import ENCODING, RANGE, lightmaps_by_file
from ..lightmap.writing import SCALE_OFFSET, UV_MAP
from ..paths import path_of
from ..read.materials.nodes import SHOWN
from .layers import Layer

SHEET, TILE = "photon_bake_sheet", "photon_bake_tile"
"""Custom properties of objects that show lightmaps: the number of their sheet, from 1 on; and of those in tiled ones
(column, row, half a texel's width, half its height) of their tile."""

_FIRST_TILE, _COLUMNS, _MOST_TILES = 1001, 10, 900

Images = tuple["bpy.types.Image | None", ...]


@dataclass(frozen=True)
class Sheet:
    """What one image node a layer shows.

    Attributes
    ----------
    uv_map : str
    images : tuple of bpy.types.Image or None
        One a layer.
    tiled : bool
        Whether they are tiled.
    """

    uv_map: str
    images: Images
    tiled: bool


def make_sheets(objects: "Iterable[bpy.types.Object]", layers: Sequence[Layer], warnings: list[str]) -> list[Sheet]:
    """The sheets of all objects with lightmaps, which get the custom properties; others are left as they are."""
    by_file = lightmaps_by_file()
    of_kind: dict[tuple, dict[Images, list[bpy.types.Object]]] = {}
    for obj in objects:
        if SCALE_OFFSET not in obj or UV_MAP not in obj or not obj.is_editable:
            continue
        files = [obj.get(layer.image_property) for layer in layers]
        images = tuple(by_file.get(name) if name else None for name in files)
        lost = [name for name, image in zip(files, images, strict=True) if name and not (image and _has_pixels(image))]
        if lost:
            warnings.append(f"The lightmap '{lost[0]}' of object '{obj.name}' is not there: bake it again.")
        elif any(images):
            kind = (obj[UV_MAP], *((one.get(ENCODING), one.get(RANGE)) if one else None for one in images))
            of_kind.setdefault(kind, {}).setdefault(images, []).append(obj)
    sheets: list[Sheet] = []
    for (uv_map, *_), of_images in of_kind.items():
        chosen = list(of_images)
        most = 1 if any(map(_is_sequence, chosen)) else _MOST_TILES
        for first in range(0, len(chosen), most):
            part = chosen[first : first + most]
            sheets.append(_sheet(uv_map, part, f"Photon Bake Sheet {len(sheets) + 1}"))
            for i, images in enumerate(part):
                _place(of_images[images], len(sheets), i if len(part) > 1 else None, images)
    return sheets


def drop_sheets() -> None:
    """Take tiled images and custom properties away again."""
    bpy.data.batch_remove([image for image in bpy.data.images if SHOWN in image])
    for obj in bpy.data.objects:
        for name in (SHEET, TILE, SHOWN):  # the last one is of earlier versions
            if name in obj:
                del obj[name]


def _sheet(uv_map: str, part: list[Images], name: str) -> Sheet:
    if len(part) == 1:
        return Sheet(uv_map, part[0], tiled=False)
    of_layer = zip(*part, strict=True)
    return Sheet(uv_map, tuple(_tiled(name, list(images)) if images[0] else None for images in of_layer), tiled=True)


def _place(objects: "list[bpy.types.Object]", sheet: int, tile: int | None, images: Images) -> None:
    width, height = next(image for image in images if image is not None).size
    for obj in objects:
        obj[SHEET] = sheet
        if tile is not None:
            obj[TILE] = (float(tile % _COLUMNS), float(tile // _COLUMNS), 0.5 / width, 0.5 / height)


def _is_sequence(images: Images) -> bool:
    """Whether images change over frames, as tiled ones cannot."""
    return any(image is not None and image.source == "SEQUENCE" for image in images)


def _has_pixels(image: "bpy.types.Image") -> bool:
    return image.packed_file is not None or path_of(image).is_file()


def _tiled(name: str, images: "list[bpy.types.Image]") -> "bpy.types.Image":
    """A packed image whose tiles are other images' files."""
    with TemporaryDirectory(prefix="photon_bake_") as folder:
        suffix = path_of(images[0]).suffix
        for i, image in enumerate(images):
            tile = Path(folder, f"{name}.{_FIRST_TILE + i}{suffix}")
            if image.packed_file is not None:
                tile.write_bytes(image.packed_file.data)
            else:
                shutil.copyfile(path_of(image), tile)
        tiled = bpy.data.images.load(str(Path(folder, f"{name}.{_FIRST_TILE}{suffix}")))
        tiled.name, tiled[SHOWN] = name, True
        tiled.source, tiled.filepath = "TILED", str(Path(folder, f"{name}.<UDIM>{suffix}"))
        for i in range(1, len(images)):
            tiled.tiles.new(_FIRST_TILE + i)
        tiled.colorspace_settings.name = images[0].colorspace_settings.name
        tiled.alpha_mode = images[0].alpha_mode
        tiled[ENCODING], tiled[RANGE] = images[0][ENCODING], images[0][RANGE]
        tiled.pack()
        tiled.filepath_raw = f"//{name}.<UDIM>{suffix}"  # the other property would look for files
    return tiled
