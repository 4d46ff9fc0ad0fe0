"""A scene as kernels take it: named tuples of arrays, each contiguous, writable and of one dtype.

Numba compiles a kernel anew for arrays that are strided, read-only or of another dtype; here they become of one kind.
"""

from dataclasses import fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.compiling import by_reference, kernel_array
from .materials import Channel, Materials
from .ray_kinds import RayKind, seen_by
from .textures import Textures

if TYPE_CHECKING:
    from .scene import Scene


@by_reference
class ChannelArrays(NamedTuple):
    """A `Channel`: values (m, 3) float32 and textures (m,) int32, −1 for none."""

    value: np.ndarray
    texture: np.ndarray


@by_reference
class TextureArrays(NamedTuple):
    """`Textures`."""

    pixels: np.ndarray
    offset: np.ndarray
    width: np.ndarray
    height: np.ndarray
    extends: np.ndarray


@by_reference
class ClosureArrays(NamedTuple):
    """`Closures`: those of material m are rows `start[m]` to `start[m + 1]`.

    `by_angle` and `angle_curves` are `AngleCurves`.
    """

    start: np.ndarray
    kind: np.ndarray
    weight: ChannelArrays
    roughness: ChannelArrays
    f0: ChannelArrays
    f90: ChannelArrays
    ior: np.ndarray
    fresnel: np.ndarray
    preserves_energy: np.ndarray
    layer: np.ndarray
    distribution: np.ndarray
    curve: np.ndarray
    edge: ChannelArrays
    film: ChannelArrays
    stretch: ChannelArrays
    stretched: np.ndarray
    normal_space: np.ndarray
    normal: ChannelArrays
    by_angle: np.ndarray
    angle_curves: np.ndarray


@by_reference
class MaterialArrays(NamedTuple):
    """`Materials`: closures and channels, and which rows stand for others (m, 12) int32.

    Those from `matte` on, (m,) bool, are known of a triangle's material, whichever row stands for it.
    """

    closures: ClosureArrays
    emission: ChannelArrays
    coverage: ChannelArrays
    tint: ChannelArrays
    seen_as: np.ndarray
    matte: np.ndarray
    directional: np.ndarray
    broad: np.ndarray
    spreads_light: np.ndarray
    subsurface: np.ndarray
    perturbed: np.ndarray
    see_through: np.ndarray
    two_faced: np.ndarray
    differs_by_kind: np.ndarray
    emits_unsampled: np.ndarray
    one_sided: np.ndarray


@by_reference
class SceneArrays(NamedTuple):
    """Triangles and what they are made of.

    Attributes
    ----------
    vertices, triangles, normals, corner_normals, corner_uvs
        As those of `Scene`.
    corner_tangents, normal_matrices
        As those of `ShadingFrames`.
    packed_normals : (t, 2, 2) int16
    smooth : (t,) bool
    height_errors : (t,) float32, m
        What `hit.ray_offset` takes of a triangle.
    material, object : (t,) int32
        Of each triangle.
    materials : MaterialArrays
    textures : TextureArrays
    seen_by : (6, o) bool
        Which objects rays of each `RayKind` see.
    emits, held_out : (o,) bool
    link_group : (o,) int32
        As `EmitterLinks`; (0,) where all objects light all.
    illuminates : (g, o) bool
    """

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    packed_normals: np.ndarray
    corner_normals: np.ndarray
    corner_uvs: np.ndarray
    corner_tangents: np.ndarray
    normal_matrices: np.ndarray
    smooth: np.ndarray
    height_errors: np.ndarray
    material: np.ndarray
    object: np.ndarray
    materials: MaterialArrays
    textures: TextureArrays
    seen_by: np.ndarray
    emits: np.ndarray
    held_out: np.ndarray
    link_group: np.ndarray
    illuminates: np.ndarray


def scene_arrays(scene: "Scene") -> SceneArrays:
    """A scene's arrays; what is large is not copied."""
    f, i, b, links = np.float32, np.int32, np.bool_, scene.objects.links
    return SceneArrays(
        vertices=kernel_array(scene.vertices, f),
        triangles=kernel_array(scene.triangles, i),
        normals=kernel_array(scene.normals, f),
        packed_normals=kernel_array(scene.packed_normals, np.int16),
        corner_normals=kernel_array(scene.corner_normals, f),
        corner_uvs=kernel_array(scene.corner_uvs, f),
        corner_tangents=kernel_array(scene.frames.corner_tangents, f),
        normal_matrices=kernel_array(scene.frames.normal_matrices, f),
        smooth=kernel_array(scene.smooth, b),
        height_errors=kernel_array(scene.height_errors, f),
        material=kernel_array(scene.material_of_triangle, i),
        object=kernel_array(scene.object_of_triangle, i),
        materials=_material_arrays(scene.materials),
        textures=_texture_arrays(scene.materials.textures),
        seen_by=kernel_array(np.stack([seen_by(scene.objects, kind) for kind in RayKind]), b),
        emits=kernel_array(scene.objects.emits, b),
        held_out=kernel_array(scene.objects.held_out, b),
        link_group=kernel_array(np.zeros(0, i) if links is None else links.group, i),
        illuminates=kernel_array(np.zeros((0, 0), b) if links is None else links.illuminates, b),
    )


def channel_arrays(channel: Channel) -> ChannelArrays:
    """A channel's arrays."""
    return ChannelArrays(kernel_array(channel.value, np.float32), kernel_array(channel.texture, np.int32))


def _material_arrays(materials: Materials) -> MaterialArrays:
    angles = materials.closures.angles
    curves = {
        "by_angle": kernel_array(angles.of_closure, np.int32),
        "angle_curves": kernel_array(angles.curves, np.float32),
    }
    others = [name for name in ClosureArrays._fields if name not in curves]
    closures = {name: _column(getattr(materials.closures, name)) for name in others} | curves
    columns = {name: _column(getattr(materials, name)) for name in MaterialArrays._fields if name != "closures"}
    return MaterialArrays(closures=ClosureArrays(**closures), **columns)


def _column(column: Any) -> Any:
    """A channel or an array inside kernels."""
    if isinstance(column, Channel):
        return channel_arrays(column)
    return kernel_array(column, np.float32 if column.dtype.kind == "f" else column.dtype)


def _texture_arrays(textures: Textures) -> TextureArrays:
    dtypes = {"pixels": np.float32, "extends": np.bool_}
    return TextureArrays(
        *(kernel_array(getattr(textures, f.name), dtypes.get(f.name, np.int32)) for f in fields(Textures))
    )
