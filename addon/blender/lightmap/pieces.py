"""The charts of objects' meshes, ready to be packed."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from ...core.parallel import aside
from ...core.progress import Progress
from ...receivers.uv_maps import Packed, Piece, PiecesAt, pack, unwrapped
from .subjects import LeftOut, Subjects

_STAGE = "Unwrapping"


@dataclass
class Pieces:
    """What objects bring into images: the charts of a mesh, or where objects share one, its image as a whole.

    Attributes
    ----------
    objects : list of (name, mesh name)
        The name is that of a lightmap of its own.
    of_mesh : dict of str to Piece
        Charts of each mesh, as large as on its largest object.
    check : callable
        Raises an exception where the bake was cancelled.
    """

    objects: list[tuple[str, str]]
    of_mesh: dict[str, Piece]
    check: Callable[[], None] = lambda: None
    _alone: dict[tuple[str, float], Packed] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._users = Counter(mesh for _, mesh in self.objects)

    @staticmethod
    def of(subjects: Subjects, out: LeftOut, progress: Progress) -> "Pieces":
        """The pieces of surfaces, less those of meshes without an area."""
        of_mesh: dict[str, Piece] = {}
        for i, (name, faces) in enumerate(subjects.faces.items()):
            progress.update(_STAGE, i / len(subjects.faces))
            if faces.area > 0:
                of_mesh[name] = aside(partial(unwrapped, faces, progress.check), progress.check)
                continue
            for one in subjects.all:
                if one.mesh_name == name:
                    out.add(f"The faces of object '{one.object_name}' have no area: give it some, or leave it out.")
        progress.update(_STAGE, 1)
        objects = [(one.image_name, one.mesh_name) for one in subjects.all if one.mesh_name in of_mesh]
        return Pieces(objects, of_mesh, progress.check)

    def of_subjects(self, subjects: Subjects) -> "Pieces":
        """Those of some of the surfaces, and of others."""
        objects = [(one.image_name, one.mesh_name) for one in subjects.all]
        return Pieces(objects, {name: self.of_mesh[name] for name in subjects.faces}, self.check)

    def is_shared(self, mesh: str) -> bool:
        """Whether several objects have the mesh."""
        return self._users[mesh] > 1

    def alone(self, mesh: str, density: float, ring: int) -> Packed:
        """The image of a mesh by itself."""
        key = (mesh, density)
        if key not in self._alone:
            packed = pack([self.of_mesh[mesh]], density, ring, check=self.check)
            assert packed is not None  # as the image's size is free
            self._alone[key] = packed
        return self._alone[key]

    def charts_of(self, mesh: str) -> PiecesAt:
        """The charts of one mesh."""
        return lambda _: [self.of_mesh[mesh]]

    def at(self, chosen: Sequence[int], ring: int, inner_density: float) -> PiecesAt:
        """Pieces of some objects; meshes that objects share are packed at `inner_density`, or the image's own if 0."""

        def pieces(density: float) -> list[Piece]:
            return [self._of_mesh(self.objects[i][1], ring, inner_density or density) for i in chosen]

        return pieces

    def _of_mesh(self, mesh: str, ring: int, density: float) -> Piece:
        if not self.is_shared(mesh) or not density:
            return self.of_mesh[mesh]
        alone = self.alone(mesh, density, ring)
        return Piece.rectangle(alone.width / density, alone.height / density)

    def split(self, chosen: Sequence[int]) -> list[list[int]]:
        """Two halves of some objects with about as much surface each."""
        areas = {i: self.of_mesh[self.objects[i][1]].area for i in chosen}
        halves: list[list[int]] = [[], []]
        totals = [0.0, 0.0]
        for i in sorted(chosen, key=lambda i: (-areas[i], i)):
            lighter = 0 if totals[0] <= totals[1] else 1
            halves[lighter].append(i)
            totals[lighter] += areas[i]
        return [sorted(half) for half in halves]
