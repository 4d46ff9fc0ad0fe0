"""Objects that get lightmaps, out of a dependency graph: their surfaces, images and places.

Where no UV map is chosen, one is made for each stored mesh and taken through the object's modifiers. An object whose
modifiers copy faces (Array, Mirror, Solidify) or lose UV maps shows texels in several places then, or none: it gets its
light on a copy with the evaluated mesh, for which a UV map is made, or where copies are not wanted none. Each object
that can have no lightmap is left out by name, as long as others are left.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from math import sqrt
from typing import Any

import bpy
import numpy as np

from ...core.errors import BakeError
from ...core.progress import Progress
from ...receivers import LightmapMesh
from ...receivers.uv_maps import areas, pack
from ...settings.lightmap import LightmapSettings
from ..read.as_read import AsRead
from ..read.bake_objects import bake_objects
from ..read.meshes.modifiers import active_modifiers
from ..read.meshes.shown_meshes import Shown, check_copied, copyable, shown_meshes, warn_of_shared_light
from ..warn import Warnings, listed
from .charts import faces_of
from .checks import OVERLAP, overlap_share, uv_problems
from .layout import Layout, lay_out, lay_out_as_chosen
from .meshes import check_lightmap_object, read_uv_map, through_modifiers
from .pieces import Pieces
from .subjects import LeftOut, Subject, Subjects, copied_subjects, own_subjects

_PACKING = "Packing"
_FEW = 4  # objects of a material that have an image each where the choice is ours
_SLACK = 4  # texels of an object that may lie twice, since its UV map was tried with more texels before
_THIN = 0.01  # of the area that a triangle has in the UV map on average
_WITHOUT_TEXELS = 0.05  # share of an object's surface that may have such triangles
_TRIAL_SIDES = 64, 1024  # texels of the image in which modifiers are tried on a UV map, at least and at most


@dataclass(frozen=True)
class LightmapObjects:
    """Objects that get lightmaps.

    Attributes
    ----------
    subjects : list of Subject
    layout : Layout
        With a place for each.
    meshes : list of LightmapMesh
        Theirs.
    meanwhile : list of AsRead
        Of those objects that get no copy.
    """

    subjects: list[Subject]
    layout: Layout
    meshes: list[LightmapMesh]
    meanwhile: list[AsRead]


@dataclass
class LightmapReading:
    """How lightmaps are read out of a graph.

    Attributes
    ----------
    depsgraph : bpy.types.Depsgraph
    settings : LightmapSettings
    copies : bool
        Whether objects whose mesh cannot hold their light get copies.
    density_of : mapping
        Factors of texels a metre, by objects' names; 1 for others.
    warnings : list of str
        Grows.
    progress : Progress
    """

    depsgraph: Any
    settings: LightmapSettings
    copies: bool = False
    density_of: Mapping[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    progress: Progress = field(default_factory=Progress)

    def __post_init__(self) -> None:
        self._out = LeftOut(self.warnings)

    def objects(self, names: list[str] | None) -> LightmapObjects:
        """What is baked to, of objects of some names or of all.

        Raises
        ------
        BakeError
            If there is nothing, naming an object and what to do.
        """
        warn, shown = Warnings(self.warnings), shown_meshes(self.depsgraph)
        copied = set(copyable(shown, names, warn, shared=False)) if self.copies and not self.settings.uv_map else set()
        may_have_one = partial(check_lightmap_object, uv_map=self.settings.uv_map)

        def check(obj: Any, graph: Any) -> None:
            check_copied(obj, graph) if obj in copied else may_have_one(obj, graph)

        candidates = [obj for obj in shown if obj in copied or obj.type == "MESH"] if copied else None
        objects = bake_objects(self.depsgraph, names, self.warnings, check, candidates)
        if names is None and not self.copies:
            warn_of_shared_light(shown, warn)
        own = [obj for obj in objects if obj not in copied]
        if self.settings.uv_map:
            return self._with_chosen_maps(own)
        return self._with_made_maps(own, [obj for obj in objects if obj in copied], shown)

    def again(self, layout: Layout) -> LightmapObjects:
        """What is baked to in another frame than the one whose layout is given.

        Raises
        ------
        BakeError
            If an object has no lightmap any more, or another mesh, naming it.
        """
        names = list(dict.fromkeys(place.object_name for place in layout.places))
        check = partial(check_lightmap_object, uv_map=self.settings.uv_map)
        objects = bake_objects(self.depsgraph, names, self.warnings, check)
        by_name = {obj.name: obj for obj in objects}
        read = own_subjects(objects, self.depsgraph, self.density_of, self._out, self.progress).all
        of_object = {(one.object_name, one.mesh_name): one for one in read}
        subjects = [_still(of_object.get((one.object_name, one.mesh_name)), one.object_name) for one in layout.places]
        changed = [by_name[one.object_name] for one in subjects if one.changed and layout.made]
        moved = {obj.name: uv for obj, uv in through_modifiers(changed, layout.made).items()}
        meshes = []
        for one, place in zip(subjects, layout.places, strict=True):
            graph_mesh = by_name[one.object_name].evaluated_get(self.depsgraph).data
            uv = self._uv_of(one, layout, moved) if layout.made else read_uv_map(graph_mesh, layout.uv_map)
            if uv is None or len(uv) != one.n_corners:
                raise BakeError(_other_than_before(one.object_name))
            scale, offset = np.array(place.scale_offset, np.float32).reshape(2, 2)
            meshes.append(one.mesh(place.image, uv * scale + offset))
        return LightmapObjects(subjects, layout, meshes, [AsRead.of(by_name[one.object_name]) for one in subjects])

    def _with_made_maps(self, own: list[Any], copied: list[Any], shown: dict[Any, Shown]) -> LightmapObjects:
        by_name = {obj.name: obj for obj in own}
        stored = own_subjects(own, self.depsgraph, self.density_of, self._out, self.progress)
        flat = {one.object_name for one in stored.all if one.changed and not stored.faces[one.mesh_name].area > 0}
        solid = stored.where(lambda one: one.object_name not in flat)
        pieces = Pieces.of(solid, self._out, self.progress)
        stored = solid.where(lambda one: one.mesh_name in pieces.of_mesh)
        spoilt = [by_name[name] for name in flat] + self._spoilt(stored, pieces, by_name)
        replaced = [obj for obj in spoilt if self.copies and _can_be_replaced(obj, shown)]
        for obj in spoilt:
            if obj not in replaced:
                self._out.add(_repeats_faces(obj, self.depsgraph, self.copies))
        stored = stored.where(lambda one: by_name[one.object_name] not in spoilt)
        copies = copied_subjects([*copied, *replaced], self.depsgraph, self.density_of, self._out, self.progress)
        of_copies = Pieces.of(copies, self._out, self.progress)
        pieces.of_mesh |= of_copies.of_mesh
        subjects = stored + copies.where(lambda one: one.mesh_name in of_copies.of_mesh)
        self.progress.update(_PACKING, 0)
        alike = share_materials([*own, *copied])
        laid = pieces.of_subjects(subjects), self.settings, alike, self.warnings, self._out
        subjects, layout = lay_out(subjects, *laid)
        self._out.end(subjects.all)
        self.progress.update(_PACKING, 1)
        changed = [by_name[one.object_name] for one in subjects.all if one.changed and not one.copy]
        moved = {obj.name: uv for obj, uv in through_modifiers(changed, layout.made).items()}
        uv_of = [self._uv_of(one, layout, moved) for one in subjects.all]
        return self._checked(subjects.all, layout, uv_of, by_name)

    def _uv_of(self, one: Subject, layout: Layout, moved: dict[str, np.ndarray]) -> np.ndarray:
        """Texture coordinates (c, 2) of a surface's evaluated mesh; NaN where modifiers do not bring them through."""
        uv = moved.get(one.object_name) if one.changed and not one.copy else layout.made[one.mesh_name]
        return uv if uv is not None and len(uv) == one.n_corners else np.full((one.n_corners, 2), np.nan, np.float32)

    def _spoilt(self, subjects: Subjects, pieces: Pieces, by_name: dict[str, Any]) -> list[Any]:
        """The objects whose modifiers make a UV map lie over itself, or lose it."""
        changed = [one for one in subjects.all if one.changed]
        trial, sizes = {}, {}
        for mesh in dict.fromkeys(one.mesh_name for one in changed):
            trial[mesh], sizes[mesh] = self._trial(pieces, mesh)
        moved = through_modifiers([by_name[one.object_name] for one in changed], trial)
        spoilt = []
        for one in changed:
            self.progress.check()
            obj = by_name[one.object_name]
            if not _can_serve(one, moved.get(obj), sizes[one.mesh_name]):
                spoilt.append(obj)
        return spoilt

    def _trial(self, pieces: Pieces, mesh: str) -> tuple[np.ndarray, tuple[int, int]]:
        """A mesh's UV map in an image of its own, about as dense as it will be, and that image's size."""
        piece, ring = pieces.of_mesh[mesh], self.settings.ring
        wanted = self.settings.size / sqrt(piece.area) if self.settings.size else self.settings.density
        lowest, highest = (side / sqrt(piece.area) for side in _TRIAL_SIDES)
        density = min(max(wanted, lowest), highest)
        packed = pack([piece], density, ring, check=self.progress.check)
        assert packed is not None  # as its size is free
        return packed.uv[0], (packed.height, packed.width)

    def _with_chosen_maps(self, objects: list[Any]) -> LightmapObjects:
        name = self.settings.uv_map
        subjects, sides, uv_of = [], [], []
        for obj in objects:
            try:
                side = _side_of_image(obj, self.depsgraph, name)
            except BakeError as error:
                self._out.add(str(error))
                continue
            read = own_subjects([obj], self.depsgraph, {}, self._out, self.progress).all
            for one in read:
                uv = read_uv_map(obj.evaluated_get(self.depsgraph).data, name)
                subjects.append(one)
                sides.append(side * self.density_of.get(obj.name, 1.0))
                uv_of.append(np.full((one.n_corners, 2), np.nan, np.float32) if uv is None else uv)
        self._out.end(subjects)
        layout = lay_out_as_chosen(subjects, sides, self.settings, self.warnings)
        return self._checked(subjects, layout, uv_of, {obj.name: obj for obj in objects})

    def _checked(
        self, subjects: list[Subject], layout: Layout, uv_of: list[np.ndarray], objects: dict[str, Any]
    ) -> LightmapObjects:
        """The surfaces less those whose texture coordinates cannot serve."""
        meshes = []
        for one, place, uv in zip(subjects, layout.places, uv_of, strict=True):
            scale, offset = np.array(place.scale_offset, np.float32).reshape(2, 2)
            meshes.append(one.mesh(place.image, uv * scale + offset))
        doubtful = [bool(self.settings.uv_map) or one.changed for one in subjects]
        slack = 0 if self.settings.uv_map else _SLACK
        problems = uv_problems(meshes, doubtful, layout.sizes, layout.uv_map, slack, self.progress)
        for sentence in problems.values():
            self._out.add(sentence)
        kept = [i for i in range(len(subjects)) if i not in problems]
        self._out.end(kept)
        layout = layout.where(kept)
        meshes = [replace(meshes[i], image=place.image) for i, place in zip(kept, layout.places, strict=True)]
        subjects = [subjects[i] for i in kept]
        meanwhile = [AsRead.of(objects[one.object_name]) for one in subjects if one.copy is None]
        return LightmapObjects(subjects, layout, meshes, meanwhile)


def _still(subject: Subject | None, name: str) -> Subject:
    """The surface of an object in a frame."""
    if subject is None:
        raise BakeError(_other_than_before(name))
    return subject


def _other_than_before(name: str) -> str:
    """A sentence about an object that has no lightmap in a frame, though it had one in the first."""
    return (
        f"Object '{name}' is not the same mesh as in the first frame, so its lightmap cannot go on: keep it shown and "
        "its faces alike, or leave it out (Selected Only, --objects)."
    )


def _can_serve(one: Subject, uv: np.ndarray | None, size: tuple[int, int]) -> bool:
    """Whether a surface's UV map (c, 2) holds its light, in an image (height, width).

    It does if hardly any of it lies twice in the image, nor has triangles that are no larger than lines there.
    """
    if uv is None or len(uv) != one.n_corners or overlap_share(uv[one.corners], size) > OVERLAP:
        return False
    in_space, flat = areas(one.positions), areas(uv[one.corners])
    thin = flat * in_space.sum() < _THIN * in_space * flat.sum()
    return bool(flat.sum() > 0 and in_space[thin].sum() <= _WITHOUT_TEXELS * in_space.sum())


def _can_be_replaced(obj: "bpy.types.Object", shown: "dict[bpy.types.Object, Shown]") -> bool:
    """Whether a copy may take an object's place in renders."""
    return obj in shown and shown[obj].all_meshes and obj.is_editable


def _repeats_faces(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph", copies: bool) -> str:
    """A sentence about an object whose modifiers spoil UV maps."""
    names = listed([f"'{modifier.name}'" for modifier in active_modifiers(obj, depsgraph.mode)])
    remedy = "apply them" if copies else "turn on Bake Copies, or apply them"
    return (
        f"Object '{obj.name}' has modifiers ({names}) that copy faces or make new ones, which would share texels of "
        f"its lightmap: {remedy}."
    )


def _side_of_image(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph", uv_map: str) -> float:
    """Side that an image has in space where it lies on an object by a UV map, m: how many times UV is enlarged."""
    uv = read_uv_map(obj.data, uv_map)
    if uv is None:
        there_are = ", ".join(f"'{one.name}'" for one in obj.data.uv_layers) or "none"
        raise BakeError(
            f"Object '{obj.name}' has no UV map '{uv_map}' (there are: {there_are}): add one of that name, or choose "
            "none and have it made."
        )
    faces = faces_of(obj.data, np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)[:3, :3])
    flat = float(areas(np.nan_to_num(uv)[faces.triangles]).sum())
    if not flat > 0:
        raise BakeError(
            f"The UV map '{uv_map}' of object '{obj.name}' has no area: unwrap the mesh, or choose no UV map and have "
            "one made."
        )
    return sqrt(faces.area / flat)


def share_materials(objects: "Sequence[bpy.types.Object]") -> bool:
    """Whether more than `_FEW` objects have a material in common."""
    of_object = ({slot.material for slot in obj.material_slots} or {None} for obj in objects)
    return max(Counter(chain.from_iterable(of_object)).values(), default=0) > _FEW
