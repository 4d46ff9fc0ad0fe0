"""The materials of a scene, each read once."""

import bpy

from ....core.progress import Progress
from ....scene import Materials
from ...warn import Warnings
from ..media.volume_shaders import VolumeShader
from ..meshes.instance_groups import MOST_BAKED_GROUPS, MOST_GROUPS
from ..meshes.object_values import Reading, Values, of_scene
from .columns import Seen, materials_of
from .material_reader import MaterialReader, PendingMaterial
from .pictures.images import ImageTable
from .pictures.texture_grid import Coordinates
from .stretches import Tangents

READING = "Reading the scene"


class MaterialTable:
    """The materials that triangles use, each read once.

    A material that only Cycles can evaluate has an index for each mesh that it is on, and is baked by `materials`: by
    then everything else has to be read, since a bake changes Blender's data for its while.
    """

    def __init__(self, warnings: Warnings, for_camera: bool = False) -> None:
        self._warnings, self._for_camera = warnings, for_camera
        self._images = ImageTable()
        self._readers: dict[tuple[int, bool], MaterialReader] = {}
        self._index: dict[tuple, int] = {}
        self._entries: list[Seen | PendingMaterial] = []
        self._tangents: list[Tangents] = []

    def add(
        self,
        material: "bpy.types.Material | None",
        obj: "bpy.types.Object | None" = None,
        mesh: "bpy.types.Mesh | None" = None,
        values: Values = of_scene,
    ) -> int:
        """Index of a material, where None is Cycles' default grey.

        Parameters
        ----------
        material : bpy.types.Material or None
            Evaluated.
        obj : bpy.types.Object, optional
            Evaluated mesh object (of an instance, the instanced one) that the material is on. Without it nothing is
            baked.
        mesh : bpy.types.Mesh, optional
            Of that object, with its modifiers.
        values : Values
            What the material may read of that object.
        """
        return self._index_of(self._reader(material), values, obj, mesh)

    def _index_of(
        self,
        reader: "MaterialReader",
        values: Values,
        obj: "bpy.types.Object | None" = None,
        mesh: "bpy.types.Mesh | None" = None,
    ) -> int:
        """The index of what a reader reads of an object."""
        read = reader.read(values)
        key: tuple = (reader.identity, reader.on_fibres, *(value.tobytes() for value in read.values()))
        baked = reader.needs_bake and obj is not None and mesh is not None
        if baked:
            key += reader.appearance(obj, mesh)
        if key not in self._index:
            self._index[key] = len(self._entries)
            self._tangents.append(Tangents(reader.normals.tangents, reader.stretched))
            self._entries.append(reader.pending(obj, mesh, read) if baked else reader.seen(read))
        return self._index[key]

    def add_on_fibres(self, material: "bpy.types.Material | None", values: Values) -> int:
        """Index of a material on hair or points, where nothing is baked: what it is on has no back."""
        reader = self._reader(material, True)
        if reader.needs_bake:
            reader.warn_of_guess("Cycles bakes no hair or points to say what its nodes are")
        return self._index_of(reader, values)

    def differing(self, material: "bpy.types.Material | None") -> tuple[list[Reading], int]:
        """What a material reads that differs by instance, and as how many it may be held."""
        reader = self._reader(material)
        most = MOST_BAKED_GROUPS if reader.needs_bake else MOST_GROUPS
        return [reading for reading in reader.readings if reading.differs_by_instance], most

    def _reader(self, material: "bpy.types.Material | None", on_fibres: bool = False) -> "MaterialReader":
        identity = material.original.session_uid if material else 0  # a local and a linked one may share a name
        if (identity, on_fibres) not in self._readers:
            reader = MaterialReader(material, identity, self._images, self._warnings, self._for_camera, on_fibres)
            self._readers[identity, on_fibres] = reader
        return self._readers[identity, on_fibres]

    def coordinates(self, index: int) -> Coordinates | None:
        """Texture coordinates that a material reads, or None where it has no texture."""
        return self._entries[index].coordinates

    def tangents(self, index: int) -> Tangents:
        """The tangents that a material needs."""
        return self._tangents[index]

    @property
    def readable_images(self) -> dict[int, bool]:
        """See `ImageTable.readable`."""
        return self._images.readable

    def materials(self, progress: Progress) -> Materials:
        """All materials, in columns. Comes last: it bakes what has to be baked."""
        rows = []
        for number, entry in enumerate(self._entries):
            progress.update(READING, number / len(self._entries))
            rows.append(entry.seen() if isinstance(entry, PendingMaterial) else entry)
        self._entries = list(rows)
        return materials_of(rows, self._images.textures())

    @property
    def volumes(self) -> tuple[VolumeShader | None, ...]:
        """What fills the meshes that each material is on; only after `materials`."""
        return tuple(entry.volume for entry in self._entries if isinstance(entry, Seen))

    def renewed(self, changed: "list[bpy.types.Material]") -> Materials | None:
        """All materials, some of which are read anew; only after `materials`.

        None where a material alone does not tell what it looks like, or what else was read depends on it: its
        coordinates, tangents, or how many rows there are.

        Parameters
        ----------
        changed : list of bpy.types.Material
            Evaluated. Those that no triangle has do not matter.
        """
        new = dict(enumerate(self._entries))
        for material in changed:
            identity = material.original.session_uid
            numbers = [number for key, number in self._index.items() if key[0] == identity]
            if not numbers:
                continue
            reader = MaterialReader(material, identity, self._images, self._warnings, self._for_camera, False)
            if numbers != [self._index.get((identity, False))] or reader.needs_bake or reader.readings:
                return None
            number, seen = numbers[0], reader.seen({})
            before = new[number]
            assert isinstance(before, Seen)
            same = len(seen.rows) == len(before.rows) and _same(seen.coordinates, before.coordinates)
            if not same or self._tangents[number] != Tangents(reader.normals.tangents, reader.stretched):
                return None
            new[number] = seen
        self._entries = list(new.values())
        return materials_of([one for one in self._entries if isinstance(one, Seen)], self._images.textures())

    def numbers_in(self, other: "MaterialTable") -> list[int]:
        """What number each material has in another table, −1 where it is not in it."""
        return [other._index.get(key, -1) for key in self._index]

    def forget_pictures(self) -> None:
        """Blender may have other images than before: read them anew when they are needed."""
        self._images.forget()


def _same(one: Coordinates | None, other: Coordinates | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.atlas is other.atlas and one.same(other)
