"""What gets a place in lightmaps: surfaces of objects, as renders show them."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import bpy
import numpy as np

from ...core.errors import BakeError
from ...core.progress import Progress
from ...receivers import LightmapMesh
from ...receivers.uv_maps import Faces
from ..read.meshes.meshes import corner_vertex, evaluated_mesh, read_mesh
from ..read.meshes.shown_meshes import meshes_of
from ..read.transforms import place_normals, to_world
from ..warn import Warnings
from .charts import faces_of


@dataclass(frozen=True)
class Subject:
    """A surface that gets a place in a lightmap: that of an object's own mesh, or of one that a copy is made of.

    Attributes
    ----------
    object_name : str
        The original object that shows it.
    mesh_name : str
        Of its stored mesh, which other objects may share, or of the copy's.
    image_name : str
        Of a lightmap of its own.
    positions, normals : (t, 3, 3) float32
        Of its triangles' corners, in world space.
    corners : (t, 3) int32
        Corners of the evaluated mesh.
    n_corners : int
        Of the evaluated mesh.
    changed : bool
        Whether modifiers change the corners of the stored mesh.
    copy : (str, int) or None
        Original object and number of what it shows, of which a copy is made.
    corner_vertex : (c,) int32 or None
        Of the copy's mesh.
    """

    object_name: str
    mesh_name: str
    image_name: str
    positions: np.ndarray
    normals: np.ndarray
    corners: np.ndarray
    n_corners: int
    changed: bool = False
    copy: tuple[str, int] | None = None
    corner_vertex: np.ndarray | None = None

    def mesh(self, image: int, uv: np.ndarray) -> LightmapMesh:
        """Its triangles in an image, by texture coordinates (c, 2) of the evaluated mesh's corners."""
        return LightmapMesh(self.object_name, image, self.positions, self.normals, uv[self.corners])


class LeftOut:
    """Objects that get no lightmap, and why: they stop nothing while others are left."""

    def __init__(self, warnings: list[str]) -> None:
        self._warn, self._sentences = Warnings(warnings), list[str]()

    def add(self, sentence: str) -> None:
        """Say why an object gets none."""
        self._sentences.append(sentence)

    def end(self, subjects: Collection[object]) -> None:
        """Warn of those that were left out.

        Raises
        ------
        BakeError
            If nothing else is left.
        """
        if self._sentences and not subjects:
            raise BakeError(self._sentences[0])
        for sentence in self._sentences:
            self._warn.add(f"Left out: {sentence}")


@dataclass
class Subjects:
    """Surfaces with the faces that UV maps are made of, by the meshes' names.

    Attributes
    ----------
    all : list of Subject
    faces : dict of str to Faces
        Of each mesh, as large as on its largest object.
    """

    all: list[Subject]
    faces: dict[str, Faces]

    def __add__(self, others: "Subjects") -> "Subjects":
        return Subjects(self.all + others.all, self.faces | others.faces)

    def where(self, keep: Callable[[Subject], bool]) -> "Subjects":
        """Those that a function says to keep."""
        kept = [one for one in self.all if keep(one)]
        meshes = {one.mesh_name for one in kept}
        return Subjects(kept, {name: faces for name, faces in self.faces.items() if name in meshes})


def own_subjects(
    objects: "list[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    density_of: Mapping[str, float],
    out: LeftOut,
    progress: Progress,
) -> Subjects:
    """The surfaces of objects' own meshes, with the faces that these store, in the places that modifiers put them to.

    Parameters
    ----------
    density_of : mapping
        Factors of texels a metre, by objects' names; 1 for others.
    """
    subjects, faces, size = [], {}, dict[str, float]()
    for obj in objects:
        progress.check()
        shown = obj.evaluated_get(depsgraph)
        mesh, matrix = evaluated_mesh(shown, depsgraph), np.array(shown.matrix_world, np.float64)
        changed = not _same_corners(obj.data, mesh)
        progress.check()
        try:
            subjects.append(_subject(obj.name, obj.data.name, obj.name, mesh, matrix, progress, changed=changed))
        except BakeError as error:
            out.add(str(error))
            continue
        linear = matrix[:3, :3] * density_of.get(obj.name, 1.0)
        volume = abs(np.linalg.det(linear))
        progress.check()
        if volume > size.get(obj.data.name, -1.0):
            size[obj.data.name] = volume
            faces[obj.data.name] = faces_of(obj.data if changed else mesh, linear)
    return Subjects(subjects, faces)


def copied_subjects(
    owners: "Collection[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    density_of: Mapping[str, float],
    out: LeftOut,
    progress: Progress,
) -> Subjects:
    """The surfaces of all meshes that some original objects show, of which copies are made."""
    subjects, faces = [], {}
    for owner, index, instance in meshes_of(owners, depsgraph):
        progress.check()
        mesh, matrix = evaluated_mesh(instance.object, depsgraph), np.array(instance.matrix_world, np.float64)
        name = f"{owner.name} (Baked)" + (f" {index + 1}" if index else "")
        image = owner.name + (f" {index + 1}" if index else "")
        try:
            of_copy = {"copy": (owner.name, index), "corner_vertex": corner_vertex(mesh)}
            subject = _subject(owner.name, name, image, mesh, matrix, progress, **of_copy)
        except BakeError as error:
            out.add(str(error))
            continue
        subjects.append(subject)
        progress.check()
        faces[name] = faces_of(mesh, matrix[:3, :3] * density_of.get(owner.name, 1.0))
    return Subjects(subjects, faces)


def _subject(
    object_name: str,
    mesh_name: str,
    image_name: str,
    mesh: "bpy.types.Mesh",
    matrix: np.ndarray,
    progress: Progress,
    **others: object,
) -> Subject:
    if not len(mesh.polygons):
        raise BakeError(f"Object '{object_name}' has no faces to bake to: give it some, or leave it out.")
    local = read_mesh(mesh)
    progress.check()
    positions = to_world(local.vertices, matrix, object_name)[local.triangles]
    progress.check()
    return Subject(
        object_name=object_name,
        mesh_name=mesh_name,
        image_name=image_name,
        positions=positions,
        normals=place_normals(local.normals, matrix)[local.normal_of_corner],
        corners=local.corners,
        n_corners=len(mesh.loops),
        **others,  # type: ignore[arg-type]
    )


def _same_corners(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> bool:
    """Whether modifiers leave the faces' corners alone, or only give them new vertices."""
    if len(mesh.loops) != len(evaluated.loops) or len(mesh.polygons) != len(evaluated.polygons):
        return False
    return np.array_equal(corner_vertex(mesh), corner_vertex(evaluated))
