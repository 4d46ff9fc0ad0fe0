"""Files that what is shown wants and that are not there: a render goes on without them, and so does a bake."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from .....core.errors import Advice, Missing
from ....warn import Warnings
from ..nodes import reached_nodes, uses_nodes

EFFECTS = {
    "IMAGE": "renders show magenta in its place",
    "FONT": "Blender's own font takes its place",
    "LIBRARY": "what is linked from it is not there",
    "VOLUME": "nothing of it is shown",
}
"""What is shown in place of a file, by the `id_type` of the data-block that wants it."""

_NO_EFFECT = "renders go on without it"
_REMEDY = "restore the file, or point Blender to it (File > External Data > Find Missing Files)"
_IGNORED = {"SOUND", "MOVIECLIP", "TEXT", "SCENE", "IMAGE", "LIBRARY"}
_FILES_OF_THEIR_OWN = {"OBJECT", "MATERIAL", "WORLD", "LIGHT", "NODETREE"}
_NOT_FOLLOWED = {"SCENE", "WINDOWMANAGER", "WORKSPACE", "SCREEN"}
_SHADERS = (bpy.types.Material, bpy.types.World, bpy.types.Light, bpy.types.ShaderNodeTree)
_CACHES = {".mdd", ".pc2"}
_TILE = re.compile("<(UDIM|UVTILE)>")


@dataclass
class _File:
    """A missing file: what is said of it, and who wants it, each once."""

    label: str
    effect: str
    problem: str
    users: set[str] = field(default_factory=set)

    def sentence(self, path: str) -> str:
        names = sorted(self.users)
        of = f" of {', '.join(names[:3])}{', …' if len(names) > 3 else ''}" if names else ""
        return f"{self.label}{of} {self.problem} ('{path}'): {self.effect}; {_REMEDY}."


def warn_of_missing_files(depsgraph: "bpy.types.Depsgraph", readable: Mapping[int, bool], warnings: Warnings) -> None:
    """Name each missing file once, with those who want it.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        What it shows counts.
    readable : dict of int to bool
        By `session_uid` of images that were read already, whether they could be. Others are read where their file is
        there, unless they are in memory.
    warnings : Warnings
    """
    view_layer, frame = depsgraph.view_layer, depsgraph.scene.frame_current
    roots = [obj.original for obj in depsgraph.objects]
    worlds = [getattr(view_layer, "world_override", None) or depsgraph.scene.original.world]
    shown = _Shown.of([*roots, *worlds, view_layer.material_override])
    files: dict[str, _File] = {}
    for block, path, problem in (*_images(shown, frame, readable), *_others(shown)):
        label = "A file" if block.id_type in _FILES_OF_THEIR_OWN else f"{block.bl_rna.name} '{block.name}'"
        file = files.setdefault(path, _File(label, shown.effect_of_loss(block), problem))
        file.users |= shown.users(block)
    for path, file in sorted(files.items()):
        warnings.add(Missing(file.sentence(path)))
    for user in sorted({_named(block) for block in shown.blocks for node in _image_nodes(block) if not node.image}):
        warnings.add(Advice(f"{user[0].upper()}{user[1:]} has an image node without an image: it is magenta."))


@dataclass
class _Shown:
    """The data-blocks that shown ones depend on, and those of them that use each."""

    blocks: "set[bpy.types.ID]"
    users_of: "Mapping[bpy.types.ID, set[bpy.types.ID]]"

    @staticmethod
    def of(roots: "Iterable[bpy.types.ID | None]") -> "_Shown":
        users_of = bpy.data.user_map()
        uses: defaultdict[bpy.types.ID, list[bpy.types.ID]] = defaultdict(list)
        for block, users in users_of.items():
            for user in users:
                uses[user].append(block)
        found, todo = set[bpy.types.ID](), list(roots)
        while todo:
            block = todo.pop()
            if block is not None and block not in found and block.id_type not in _NOT_FOLLOWED:
                found.add(block)
                todo += uses[block]
        return _Shown(found, users_of)

    def effect_of_loss(self, block: "bpy.types.ID") -> str:
        """What is shown in place of the file of a data-block."""
        if block.id_type == "IMAGE" and not any(isinstance(user, _SHADERS) for user in self.users_of[block]):
            return _NO_EFFECT  # a modifier reads it
        return EFFECTS.get(block.id_type, _NO_EFFECT)

    def users(self, block: "bpy.types.ID") -> set[str]:
        """Names of the materials, worlds and objects that a shown data-block is for."""
        if block.id_type == "LIBRARY":
            return {_named(one) for one in self.blocks if one.is_missing and one.library == block}
        named, seen, todo = set(), {block}, [block]
        while todo:
            one = todo.pop()
            if isinstance(one, (bpy.types.Material, bpy.types.World, bpy.types.Object)):
                named.add(_named(one))
                continue
            more = (self.users_of.get(one, set()) & self.blocks) - seen
            seen |= more
            todo += more
        return named


def _others(shown: _Shown) -> "Iterator[tuple[bpy.types.ID, str, str]]":
    """Missing fonts, caches, volumes, profiles and libraries: the data-block, its path, what is wrong."""
    for block, paths in bpy.data.file_path_map(subset=shown.blocks).items():
        if block.id_type in _IGNORED or getattr(block, "packed_file", None):
            continue
        for path in sorted(paths):
            absolute = bpy.path.abspath(path, library=block.library)
            # An object's other paths are folders of simulations, which are there once they are baked
            wanted = Path(path).suffix.lower() in _CACHES if block.id_type == "OBJECT" else not path.startswith("<")
            if wanted and not Path(absolute).exists():
                yield block, absolute, "is missing"
    for library in {block.library for block in shown.blocks if block.is_missing and block.library}:
        path = bpy.path.abspath(library.filepath)
        yield library, path, "lacks what is linked from it" if Path(path).is_file() else "is missing"


def _images(shown: _Shown, frame: int, readable: Mapping[int, bool]) -> "Iterator[tuple[bpy.types.Image, str, str]]":
    """Images that cannot be read: the data-block, its path, what is wrong. Of nodes those that light depends on."""
    wanted: dict[bpy.types.Image, list] = {}
    for block in shown.blocks:
        for node in _image_nodes(block):
            if node.image is not None:
                wanted.setdefault(node.image, []).append(node.image_user)
    for image in shown.blocks:
        if image.id_type == "IMAGE" and not all(isinstance(user, _SHADERS) for user in shown.users_of.get(image, ())):
            wanted.setdefault(image, [])
    for image, users in wanted.items():
        if image.source == "GENERATED" or image.type in {"RENDER_RESULT", "COMPOSITING"}:
            continue
        if not image.packed_files:
            gone = [path for path in _paths(image, users, frame) if not Path(path).is_file()]
            yield from ((image, path, "is missing") for path in gone)
            if gone or image.source != "FILE":
                continue
        if not readable.get(image.session_uid, image.has_data) and not _loads(image):
            yield image, bpy.path.abspath(image.filepath) or "packed", "cannot be read"


def _loads(image: "bpy.types.Image") -> bool:
    """Whether an image that is not in memory can be read; it is not in memory afterwards."""
    found = bool(image.size[0])
    if image.source == "FILE":
        image.buffers_free()
    return found


def _image_nodes(block: "bpy.types.ID") -> "Iterator[bpy.types.Node]":
    """The image nodes of a material, world or lamp that what it shows depends on."""
    if isinstance(block, (bpy.types.Material, bpy.types.World, bpy.types.Light)) and uses_nodes(block):
        yield from (node for node in reached_nodes(block) if node.type in {"TEX_IMAGE", "TEX_ENVIRONMENT"})


def _paths(image: "bpy.types.Image", users: list, frame: int) -> Iterator[str]:
    """The absolute paths that an image is read from, in a frame of the scene."""
    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.source == "TILED":
        for tile in image.tiles:
            number = tile.number - 1001
            yield _TILE.sub(lambda found: _tile(found[1], number), path)  # noqa: B023 (used at once)
    elif image.source == "SEQUENCE":
        yield from {_of_frame(path, sequence_frame(user, frame)) for user in users}
    else:
        yield path


def _tile(token: str, number: int) -> str:
    return str(1001 + number) if token == "UDIM" else f"u{number % 10 + 1}_v{number // 10 + 1}"


def sequence_frame(user: "bpy.types.ImageUser", frame: int) -> int:
    """The number of the file of a sequence that is shown in a frame of the scene, as Blender finds it."""
    at, n = frame - user.frame_start + 1, user.frame_duration
    if user.use_cyclic and n:
        at = at % n or n
    return min(max(at, 0), n) + user.frame_offset


def _of_frame(path: str, number: int) -> str:
    """A sequence's path with the last number of the file's name replaced."""
    folder, name = str(Path(path).parent), Path(path).name
    runs = list(re.finditer(r"\d+", name))
    if not runs:
        return path
    start, end = runs[-1].span()
    return str(Path(folder, f"{name[:start]}{number:0{end - start}d}{name[end:]}"))


def _named(block: "bpy.types.ID") -> str:
    return f"{block.bl_rna.name.lower()} '{block.name}'"
