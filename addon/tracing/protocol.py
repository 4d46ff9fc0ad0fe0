"""What every tracer promises."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from ..core.sampling.vectors import dot, rows
from ..scene import RayKind, Scene, SceneObjects, seen_by

Tree = TypeVar("Tree")


@dataclass(frozen=True)
class Hits:
    """Where n rays end.

    Attributes
    ----------
    triangle : (n,) int32
        Triangle of the scene that each ray meets first, −1 where it meets none.
    distance : (n,) float32, m
        Along the ray's unit direction; infinite where the ray meets nothing.
    u, v : (n,) float32
        Barycentric weights of the triangle's second and third vertex.
    normal : (n, 3) float32
        The triangle's unit geometric normal by its winding; undefined where the ray meets nothing.
    tint : (n, 3) float32 or None
        What see-through surfaces on the way leave of the light; None: there were none.
    """

    triangle: np.ndarray
    distance: np.ndarray
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray
    tint: np.ndarray | None = None

    def back(self, directions: np.ndarray) -> np.ndarray:
        """Which rays came to the back of their triangle, (n,) bool."""
        return dot(self.normal, directions) > 0

    def points(self, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions of the hits, and the unit normals of the sides that the rays came to, (n, 3) float32 each.

        The positions lie on the triangles to within their rounding, however far the rays flew.
        """
        normals = np.where(self.back(directions), np.float32(-1), np.float32(1))[:, None] * self.normal
        return scene.points(self.triangle, self.u, self.v), normals

    def where(self, chosen: np.ndarray) -> "Hits":
        """The hits of the rays that a mask or an index array chooses."""
        k = np.flatnonzero(chosen) if chosen.dtype == bool else chosen
        tint = None if self.tint is None else rows(self.tint, k)
        numbers = (self.triangle[k], self.distance[k], self.u[k], self.v[k])
        return Hits(*numbers, rows(self.normal, k), tint)

    def with_tint(self) -> "Hits":
        """A copy that may be written to, with a tint: white where there was none."""
        copy = self.where(np.arange(len(self.triangle)))
        return replace(copy, tint=copy.tinted(np.ones((len(copy.triangle), 3), np.float32)))

    def put(self, k: np.ndarray, others: "Hits") -> None:
        """Write `others` to the rows `k`; a tint only if these have one."""
        for name in ("triangle", "distance", "u", "v", "normal"):
            getattr(self, name)[k] = getattr(others, name)
        if self.tint is not None:
            self.tint[k] = 1 if others.tint is None else others.tint

    def tinted(self, light: np.ndarray) -> np.ndarray:
        """What see-through surfaces on the way leave of light (n, 3)."""
        return light if self.tint is None else light * self.tint

    @staticmethod
    def join(parts: "list[Hits]") -> "Hits":
        """All hits of several `Hits`, in order; all have a tint, or none has."""
        tints = [part.tint for part in parts if part.tint is not None]

        def joined(name: str) -> np.ndarray:
            return np.concatenate([getattr(part, name) for part in parts])

        return Hits(
            triangle=joined("triangle"),
            distance=joined("distance"),
            u=joined("u"),
            v=joined("v"),
            normal=joined("normal"),
            tint=np.concatenate(tints) if tints else None,
        )

    @staticmethod
    def none(n: int) -> "Hits":
        """As many rays that meet nothing."""
        u, v = np.zeros((2, n), np.float32)
        return Hits(np.full(n, -1, np.int32), np.full(n, np.inf, np.float32), u, v, np.zeros((n, 3), np.float32))

    @property
    def hit(self) -> np.ndarray:
        """Which rays meet a triangle, (n,) bool."""
        return self.triangle >= 0


def tree_of_each_kind(objects: SceneObjects, build: Callable[[np.ndarray], Tree]) -> list[Tree]:
    """What `build` makes of the objects that rays of a kind see, (o,) bool, for each `RayKind`.

    Kinds of rays that see the same objects share a tree.
    """
    trees: dict[bytes, Tree] = {}
    seen_by_kind = [seen_by(objects, kind) for kind in RayKind]
    for seen in seen_by_kind:
        if seen.tobytes() not in trees:
            trees[seen.tobytes()] = build(seen)
    return [trees[seen.tobytes()] for seen in seen_by_kind]


class Tracer(Protocol):
    """Finds where rays meet a scene. Both calls may be made from several threads at once."""

    def closest_hit(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        kind: RayKind = RayKind.DIFFUSE,
    ) -> Hits:
        """The first triangle along each ray that rays of a kind see.

        Parameters
        ----------
        origins, directions : (n, 3) float32
            World space, m; directions have unit length.
        t_max : (n,) float32 or float
            Farthest distance looked at, m.
        kind : RayKind
            Which objects are seen.
        """
        ...

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Whether a triangle that casts shadows lies strictly between each origin and its target, (n,) bool.

        Parameters
        ----------
        origins, targets : (n, 3) float32
            World space, m. The last 1e-4 of the way to the target is not looked at.
        """
        ...
