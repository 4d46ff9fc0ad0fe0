"""The scene: triangles, and what they are made of and lit by."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..core.compiling import kernel_array
from ..core.parallel import slices
from ..core.sampling.octahedral import encode_octahedral
from ..core.sampling.vectors import dot, rows
from . import hit
from .arrays import SceneArrays, channel_arrays, scene_arrays
from .lights import Lights
from .materials import Channel, Materials
from .media import Media
from .ray_kinds import RayKind
from .world import World

_CHUNK = 1 << 16  # triangles
_ROUNDING = 2.0**-24  # of a result in float32, at most


@dataclass(frozen=True)
class EmitterLinks:
    """What g groups of emissive objects light, as light linking says.

    Attributes
    ----------
    group : (o,) int32
        Of each object; −1 where it lights all.
    illuminates, blocked_by : (g, o) bool
        Which objects each group lights, and which keep its light away.
    """

    group: np.ndarray
    illuminates: np.ndarray
    blocked_by: np.ndarray


@dataclass(frozen=True)
class SceneObjects:
    """The o objects (an instance is an object of its own) that the triangles belong to.

    Attributes
    ----------
    names : tuple of str
        Names for messages.
    scatters : (o,) bool
        Diffuse rays see the object: photons hit it and gather rays end on it.
    casts_shadow : (o,) bool
        Shadow rays see the object.
    seen_in_gloss, seen_through_glass : (o,) bool
        Rays that come from a glossy lobe, and rays that were transmitted, see the object.
    emits : (o,) bool
        Whether the object's emission counts (in a bake of one light group, its members' alone).
    seen_by_camera : (o,) bool
        Rays from the camera see the object.
    held_out : (o,) bool
        The picture has a hole where the camera sees the object.
    links : EmitterLinks or None
        What emissive objects light; None where all light all.
    fibrous : (o,) bool or None
        Objects of strands or points, so fine that no radiance cache resolves them; None where there are none.
    """

    names: tuple[str, ...]
    scatters: np.ndarray
    casts_shadow: np.ndarray
    seen_in_gloss: np.ndarray
    seen_through_glass: np.ndarray
    emits: np.ndarray
    seen_by_camera: np.ndarray
    held_out: np.ndarray
    links: EmitterLinks | None = None
    fibrous: np.ndarray | None = None

    @staticmethod
    def seen_by_all(names: tuple[str, ...]) -> "SceneObjects":
        """Objects that all rays see."""
        a, b, c, d, e, f = np.ones((6, len(names)), bool)
        return SceneObjects(names, a, b, c, d, e, f, held_out=np.zeros(len(names), bool))


@dataclass(frozen=True)
class ShadingFrames:
    """What closures' own frames are given by, besides the interpolated normals; empty where no material needs it.

    Attributes
    ----------
    corner_tangents : (t or 0, 3, 3, 3) float32
        Of each triangle corner in the world: tangent and bitangent by which normals are given, beside a normal of
        length 1 (under a transform that scales unevenly they are longer or shorter); and the tangent along which
        facets are stretched, of any length.
    normal_matrices : (o or 0, 3, 3) float32
        What takes each object's normals to the world, but for their lengths.
    """

    corner_tangents: np.ndarray
    normal_matrices: np.ndarray

    @staticmethod
    def none() -> "ShadingFrames":
        """Nothing needs them."""
        return ShadingFrames(np.zeros((0, 3, 3, 3), np.float32), np.zeros((0, 3, 3), np.float32))


@dataclass(frozen=True)
class Scene:
    """Everything that light meets, in world space.

    Attributes
    ----------
    vertices : (v, 3) float32, m
    triangles : (t, 3) int32
        Indices into `vertices`; no triangle has zero area.
    corner_normals : (t, 3, 3) float32
        Unit shading normal of each triangle corner.
    corner_uvs : (t, 3, 2) float32
        Texture coordinates of each triangle corner, from the UV map that the triangle's material reads.
    material_of_triangle, object_of_triangle : (t,) int32
    materials : Materials
    objects : SceneObjects
    lights : Lights
    world : World
    frames : ShadingFrames
    media : Media
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corner_normals: np.ndarray
    corner_uvs: np.ndarray
    material_of_triangle: np.ndarray
    object_of_triangle: np.ndarray
    materials: Materials
    objects: SceneObjects
    lights: Lights
    world: World
    frames: ShadingFrames = field(default_factory=ShadingFrames.none)
    media: Media = field(default_factory=Media)

    @property
    def n_triangles(self) -> int:
        return len(self.triangles)

    def lit_by(self, lamps: np.ndarray, emits: np.ndarray, world: World) -> "Scene":
        """The same surfaces, lit by some of the lamps (l,) bool, by objects (o,) bool that emit, and by a world."""
        objects = replace(self.objects, emits=self.objects.emits & emits)
        scene = replace(self, lights=self.lights.where(lamps), objects=objects, world=world)
        for name in ("bounds", "diagonal", "_normals_and_areas", "smooth", "packed_normals", "height_errors"):
            scene.__dict__[name] = getattr(self, name)  # of the surfaces alone: known already
        return scene

    @cached_property
    def bounds(self) -> np.ndarray:
        """Lowest and highest corner of the axis-aligned box around the vertices, (2, 3) float32; 0 without any."""
        if len(self.vertices) == 0:
            return np.zeros((2, 3), np.float32)
        return np.stack([self.vertices.min(0), self.vertices.max(0)])

    @cached_property
    def diagonal(self) -> float:
        """Length of the bounds' diagonal, m."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0]))

    def _chunks(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray, np.ndarray]]:
        """Slices of the triangles and their corners, (3, n) float64 each: NumPy is fast along rows of coordinates."""
        for part in slices(self.n_triangles, _CHUNK):
            a, b, c = (rows(self.vertices, self.triangles[part, i]).astype(np.float64).T for i in range(3))
            yield part, a, b, c

    @cached_property
    def _normals_and_areas(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (t, 3) float32 and areas (t,) float64, in chunks: of a large scene the edges would be larger."""
        normals, areas = np.empty((self.n_triangles, 3), np.float32), np.empty(self.n_triangles)
        for part, a, b, c in self._chunks():
            ab, ac = b - a, c - a
            cross = ab[[1, 2, 0]] * ac[[2, 0, 1]] - ab[[2, 0, 1]] * ac[[1, 2, 0]]
            length = np.sqrt(np.einsum("in,in->n", cross, cross))
            normals[part], areas[part] = (cross / length).T, length / 2
        return normals, areas

    @property
    def normals(self) -> np.ndarray:
        """Unit geometric normal of each triangle by its winding, (t, 3) float32."""
        return self._normals_and_areas[0]

    @cached_property
    def shines(self) -> np.ndarray:
        """Which triangles emit light that diffuse rays see, (t,) bool."""
        of_object = self.objects.scatters & self.objects.emits
        return self.materials.emits[self.material_of_triangle] & of_object[self.object_of_triangle]

    @property
    def areas(self) -> np.ndarray:
        """Area of each triangle, (t,) float64, m²."""
        return self._normals_and_areas[1]

    @cached_property
    def packed_normals(self) -> np.ndarray:
        """Octahedral codes of the normals of each triangle's front and back, (t, 2, 2) int16."""
        return np.stack([encode_octahedral(self.normals), encode_octahedral(-self.normals)], axis=1)

    def corners(self, triangle: np.ndarray) -> np.ndarray:
        """Corners of triangles, (n, 3, 3) float32, m."""
        return rows(self.vertices, rows(self.triangles, triangle))

    @cached_property
    def arrays(self) -> SceneArrays:
        """What kernels take."""
        return scene_arrays(self)

    def points(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Positions of barycentric coordinates (1−u−v, u, v) on triangles, (n, 3) float32."""
        out = np.empty((len(triangle), 3), np.float32)
        hit.points_of(self.arrays, *_places(triangle, u, v), out)
        return out

    def barycentrics(self, triangle: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Barycentric weights (u, v) of points on triangles, clipped to the triangles, (n,) float32 each."""
        u, v = np.empty((2, len(triangle)), np.float32)
        hit.barycentrics_of(self.arrays, *_positions(triangle, positions), u, v)
        return u, v

    def plane_coordinates(self, triangle: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Barycentric weights (u, v) of where points (n, 3) lie over the planes of triangles, (n,) float64 each."""
        u, v = np.empty((2, len(triangle)))
        hit.plane_coordinates_of(self.arrays, *_positions(triangle, positions), u, v)
        return u, v

    @cached_property
    def smooth(self) -> np.ndarray:
        """Which triangles are shaded by normals other than their own, (t,) bool."""
        cosines = [dot(self.corner_normals[:, corner], self.normals) for corner in range(3)]
        return np.minimum.reduce(cosines) < 1 - 1e-5

    def shading_normals(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Unit normals that shade points on triangles, on the side of `normals`, (n, 3) float32.

        On the back they point the other way, as geometric normals do. They may lie beyond the triangle's own plane;
        what Cycles makes of that is dark.

        Parameters
        ----------
        normals : (n, 3) float32
            Geometric normals of the sides.
        """
        out = np.empty((len(triangle), 3), np.float32)
        hit.shading_normals_of(self.arrays, *_places(triangle, u, v), kernel_array(normals, np.float32), out)
        return out

    def look_up(
        self, channel: Channel, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, back: np.ndarray | None = None
    ) -> np.ndarray:
        """A channel of the materials at points on triangles, (n, 3) float32.

        Parameters
        ----------
        back : (n,) bool, optional
            Which of them are seen from the back; none without it.
        """
        out = np.empty((len(triangle), 3), np.float32)
        hit.look_up_of(self.arrays, channel_arrays(channel), *_places(triangle, u, v), _sides(triangle, back), out)
        return out

    def albedo(
        self,
        triangle: np.ndarray,
        u: np.ndarray,
        v: np.ndarray,
        back: np.ndarray | None = None,
        kind: RayKind = RayKind.DIFFUSE,
    ) -> np.ndarray:
        """Diffuse albedo of points on triangles that rays of a kind see, before what layers take of it, (n, 3) float32.

        `back` as above.
        """
        out = np.empty((len(triangle), 3), np.float32)
        hit.albedos_of(self.arrays, *_places(triangle, u, v), _sides(triangle, back), int(kind), out)
        return out

    def ray_offset(self, triangle: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """How far a ray has to start off its triangle so as not to meet it again (`hit.ray_offset`), (n, 1) float32, m.

        Parameters
        ----------
        triangle : (n,) int32
        positions : (n, 3) float32, m
            Points on the triangles by their barycentric weights (`points`), not by the distance that a ray flew.
        """
        out = np.empty(len(triangle), np.float32)
        hit.ray_offsets_of(self.arrays, *_positions(triangle, positions), out)
        return out[:, None]

    @cached_property
    def height_errors(self) -> np.ndarray:
        """How far from a triangle's plane an interpolated point may seem to be to a tracer, (t,) float32, m.

        Every operation in float32 is off by u = 2⁻²⁴ of its result at most; N, of unit length, is the normal, M the
        largest size of the corners' coordinates, d the edges' extents, all of them along each axis. As in pbrt (Pharr,
        Jakob and Humphreys 2016, 3.9) the errors of sums of products add up:

        - Interpolation (1−u−v) a + u b + v c: four roundings of each term and two of the weight, 6 u ∑ |N| M.
        - The tracer compares N·(a − o) with 0, where N is the cross product of two edges over twice the area A. Edges,
          products and their difference are rounded, 4 u of G = (|e₂ f₃| + |e₃ f₂|, …) / 2A ≥ |N|; a − o, the products
          with it and their sums, another 4 u of |N|: 8 u ∑ G d together.

        The ray's own origin is rounded by less than `ray_offset` adds. For slivers the second is large; more than
        their width is not taken, since such a step could lead past other surfaces, and little light is on them.
        """
        errors = np.empty(self.n_triangles, np.float32)
        for part, a, b, c in self._chunks():
            ab, ac, area = np.abs(b - a), np.abs(c - a), self.areas[part]
            extents = np.maximum(np.maximum(ab, ac), np.abs(c - b))
            products = (ab[[1, 2, 0]] * ac[[2, 0, 1]] + ab[[2, 0, 1]] * ac[[1, 2, 0]]) / (2 * area)
            sizes = np.maximum(np.maximum(np.abs(a), np.abs(b)), np.abs(c))
            interpolated = 6 * _ROUNDING * np.einsum("in,in->n", np.abs(self.normals[part].T), sizes)
            traced = 8 * _ROUNDING * np.einsum("in,in->n", products, extents)
            width = 2 * area / np.sqrt(np.einsum("in,in->n", extents, extents))
            errors[part] = interpolated + np.minimum(traced, width)
        return errors


def interpolate(corners: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Barycentric interpolation (1−u−v, u, v) of corner values (n, 3, d) to (n, d)."""
    w = 1 - u - v
    values = np.empty((len(corners), corners.shape[2]), np.result_type(corners, w))
    for i in range(corners.shape[2]):  # by columns, of which NumPy makes few, long loops
        a, b, c = corners[:, :, i].T
        values[:, i] = w * a + u * b + v * c
    return values


def _places(triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points on triangles as kernels take them."""
    return kernel_array(triangle, np.int32), kernel_array(u, np.float32), kernel_array(v, np.float32)


def _sides(triangle: np.ndarray, back: np.ndarray | None) -> np.ndarray:
    """Which points are seen from the back as kernels take it."""
    return np.zeros(len(triangle), np.bool_) if back is None else kernel_array(back, np.bool_)


def _positions(triangle: np.ndarray, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles and points over them as kernels take them."""
    return kernel_array(triangle, np.int32), kernel_array(positions, np.float32)
