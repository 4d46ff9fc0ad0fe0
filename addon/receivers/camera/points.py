"""What a camera's pixels are made of: few points, each for those of a pixel's samples that lie on one surface."""

from dataclasses import dataclass, replace

import numpy as np

from ...bsdf import diffuse_albedo, surface_at, translucent_albedo
from ...core.parallel import Workers
from ...core.sampling.vectors import dot, rows
from ...scene import RayKind, Scene
from ...tracing import TransparencyTracer
from ..receivers import Receivers, View
from .camera import Camera, SeenSurface
from .pixel_filter import PixelFilter
from .samples import CameraSamples, camera_samples

_ALIKE = np.float32(0.9)  # least cosine between shading normals of one surface
_OFF_PLANE = np.float32(0.5)  # pixels, that points of one surface may lie off its plane
_APART = np.float32(3)  # pixels, that they may lie apart: as far as filters reach
_WHOLE = np.float32(1 - 1e-4)  # share of a point that has all samples of its pixel
_LIFT = np.float32(1e-3)  # of a receiver off its surface, as a share of its radius
_SAMPLES = 1 << 17  # in a chunk
_SAMPLE_BYTES = 400  # a sample takes, with what it meets
_COLUMNS = ("share", "front", "back", "tint", "n_followed")
_SAMPLING = 73  # stream of random numbers


@dataclass(frozen=True)
class CameraPoints:
    """n points that a camera sees, and pictures (height, width, …) float32 of what needs no light.

    Attributes
    ----------
    camera : Camera
    seen : SeenSurface
        The points; their areas add up to what the pixels cover.
    share : (n,) float32
        Of its pixel's samples that each stands for.
    front, back : (n, 3) float32
        Of the irradiance in front of the surface and behind it, over π, what the pixel gets as radiance: the mean
        albedo of the diffuse and of the translucent lobe, times what mirrors, glass and media on the way leave, times
        `share`.
    tint : (n, 3) float32
        What mirrors, glass and media on the way leave, times `share`.
    n_followed : (n,) uint8
        How many of them there were.
    depth, normal, beyond, transmittance
        As in `CameraSamples`.
    pixel_filter : PixelFilter
    """

    camera: Camera
    seen: SeenSurface
    share: np.ndarray
    front: np.ndarray
    back: np.ndarray
    tint: np.ndarray
    n_followed: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    beyond: np.ndarray
    transmittance: np.ndarray | None
    pixel_filter: PixelFilter

    def __len__(self) -> int:
        return len(self.seen)

    def picture(self, values: np.ndarray) -> np.ndarray:
        """Values (n, 3) of the points summed in each pixel, (height, width, 3) float32."""
        n = self.camera.n_pixels
        sums = [np.bincount(self.seen.pixel, column, minlength=n) for column in values.T]
        return np.stack(sums, axis=1).reshape(self.camera.height, self.camera.width, -1).astype(np.float32)

    @property
    def through(self) -> np.ndarray:
        """The points that are lit from behind too, indices."""
        return np.flatnonzero(self.back.any(axis=1))

    def receivers(self, scene: Scene) -> Receivers:
        """A receiver in front of each point, and after those one behind each of `through`.

        Only points in mirrors take caustics: those that the camera itself sees have them by `photon_splatting`.
        """
        seen = self.seen
        footprint = np.sqrt(seen.area / np.float32(np.pi))
        least = scene.ray_offset(seen.hits.triangle, seen.position)
        lift = np.maximum(least, (_LIFT * footprint)[:, None]) * seen.normal
        k = self.through
        takes = self.n_followed > 0
        base = None
        if scene.materials.perturbed.any():
            base = scene.shading_normals(seen.hits.triangle, seen.hits.u, seen.hits.v, seen.normal)
            base = np.concatenate([base, -base[k]])
        return Receivers(
            np.concatenate([seen.position + lift, (seen.position - lift)[k]]).astype(np.float32),
            np.concatenate([seen.shading_normal, -seen.shading_normal[k]]),
            np.concatenate([footprint, footprint[k]]).astype(np.float32),
            takes_caustics=np.concatenate([takes, takes[k]]),
            view=View(self.camera, SeenSurface.join([seen, seen.where(k).turned()]) if len(k) else seen),
            base_normal=base,
        )


def camera_points(
    scene: Scene,
    tracer: TransparencyTracer,
    camera: Camera,
    pixel_filter: PixelFilter,
    n_samples: int,
    workers: Workers,
) -> CameraPoints:
    """Trace `n_samples` through each pixel, and make points of them.

    Half of them are enough for pixels in which they all lie on one surface.
    """

    def sampled(pixel: np.ndarray, n: int, random: np.random.Generator) -> tuple[list[np.ndarray], "_Clusters"]:
        samples = camera_samples(scene, tracer, camera, pixel_filter, n, pixel, random)
        clusters = _clusters(scene, samples, n)
        seen = replace(clusters.seen, pixel=pixel[clusters.seen.pixel])
        pictures = [samples.depth, samples.normal, samples.beyond, samples.transmittance]
        return [one for one in pictures if one is not None], replace(clusters, seen=seen)

    def look(chunk: slice, random: np.random.Generator) -> tuple[list[np.ndarray], "_Clusters"]:
        pixel = np.arange(chunk.start, chunk.stop)
        pictures, clusters = sampled(pixel, (n_samples + 1) // 2, random)
        plain = np.zeros(len(pixel), bool)
        plain[clusters.seen.pixel[clusters.share > _WHOLE] - chunk.start] = True
        k = np.flatnonzero(~plain)
        if len(k):
            again, others = sampled(pixel[k], n_samples, random)
            clusters = clusters.where(plain[clusters.seen.pixel - chunk.start]).joined(others)
            for picture, better in zip(pictures, again, strict=True):
                picture[k] = better
        return pictures, clusters

    size = max(1, _SAMPLES // n_samples)
    stage, bytes_ = "Looking through the camera", n_samples * _SAMPLE_BYTES
    chunks = workers.chunks(stage, camera.n_pixels, size, look, (_SAMPLING,), row_bytes=bytes_)
    parts, pictures = [], []
    for _, (of_pixels, clusters) in chunks:
        parts.append(clusters)
        pictures.append(of_pixels)

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(clusters, name) for clusters in parts])

    def picture(i: int) -> np.ndarray:
        values = np.concatenate([of_pixels[i] for of_pixels in pictures])
        return values.reshape(camera.height, camera.width, *values.shape[1:]).astype(np.float32)

    seen = SeenSurface.join([clusters.seen for clusters in parts])
    columns = {name: joined(name) for name in _COLUMNS}
    return CameraPoints(
        camera,
        seen,
        **columns,
        depth=picture(0),
        normal=picture(1),
        beyond=picture(2),
        transmittance=picture(3) if tracer.arrays.media.any else None,
        pixel_filter=pixel_filter,
    )


@dataclass(frozen=True)
class _Clusters:
    """The points of some pixels; see `CameraPoints`."""

    seen: SeenSurface
    share: np.ndarray
    front: np.ndarray
    back: np.ndarray
    tint: np.ndarray
    n_followed: np.ndarray

    def where(self, chosen: np.ndarray) -> "_Clusters":
        """Those that a mask chooses."""
        return _Clusters(self.seen.where(chosen), *(rows(getattr(self, name), chosen) for name in _COLUMNS))

    def joined(self, others: "_Clusters") -> "_Clusters":
        """These and others, in the order of their pixels."""
        seen = SeenSurface.join([self.seen, others.seen])
        order = np.argsort(seen.pixel, kind="stable")
        columns = (rows(np.concatenate([getattr(self, name), getattr(others, name)]), order) for name in _COLUMNS)
        return _Clusters(seen.where(order), *columns)


def _clusters(scene: Scene, samples: CameraSamples, n_samples: int) -> _Clusters:
    """Points for the samples of pixels."""
    leader = _leaders(scene, samples)
    chosen, cluster = np.unique(leader, return_inverse=True)
    n = len(chosen)
    share = (np.bincount(cluster, samples.share, minlength=n) / n_samples).astype(np.float32)
    front, back = diffuse_colors(scene, samples.seen)

    def mean(values: np.ndarray) -> np.ndarray:
        sums = [np.bincount(cluster, column, minlength=n) for column in values.T]
        return (np.stack(sums, axis=1) / n_samples).astype(np.float32)

    seen = samples.seen.where(chosen)
    return _Clusters(
        seen=replace(seen, area=seen.area * share),
        share=share,
        front=mean(front * samples.throughput),
        back=mean(back * samples.throughput),
        tint=mean(samples.throughput),
        n_followed=samples.n_followed[chosen],
    )


def _leaders(scene: Scene, samples: CameraSamples) -> np.ndarray:
    """For each of k samples that see a surface the first one of its pixel that lies on the same surface, (k,) int64.

    In turns, the first sample of each pixel that has no leader yet leads all those that lie on its surface.
    """
    seen, followed = samples.seen, samples.n_followed
    objects = scene.object_of_triangle[seen.hits.triangle]
    width = np.sqrt(seen.area)
    leader = np.full(len(seen), -1)
    left = np.arange(len(seen))
    while len(left):
        pixel = seen.pixel[left]
        first = np.append(True, pixel[1:] != pixel[:-1])
        led = left[first][np.cumsum(first) - 1]
        away = rows(seen.position, left) - rows(seen.position, led)
        alike = (objects[left] == objects[led]) & (followed[left] == followed[led])
        alike &= dot(rows(seen.shading_normal, left), rows(seen.shading_normal, led)) > _ALIKE
        alike &= np.abs(dot(away, rows(seen.normal, led))) <= _OFF_PLANE * width[led]
        alike &= dot(away, away) <= (_APART * width[led]) ** 2
        alike |= left == led
        leader[left[alike]] = led[alike]
        left = left[~alike]
    return leader


def diffuse_colors(scene: Scene, seen: SeenSurface) -> tuple[np.ndarray, np.ndarray]:
    """Albedo of the diffuse lobe, as far as gloss over it lets it be seen, and of the translucent lobe, (n, 3) each."""
    hits = seen.hits
    diffuse = scene.albedo(hits.triangle, hits.u, hits.v, hits.back(seen.direction), RayKind.CAMERA)
    translucent = np.zeros_like(diffuse)
    k = np.flatnonzero(~scene.materials.matte[scene.material_of_triangle[hits.triangle]])
    if len(k):
        met = hits.where(k)
        flown = rows(seen.direction, k)
        surface = surface_at(scene, met.triangle, met.u, met.v, met.back(flown))
        cosine = np.abs(dot(rows(seen.normal, k), flown))
        diffuse[k] = diffuse_albedo(surface, cosine)
        translucent[k] = translucent_albedo(surface, cosine)
    return diffuse, translucent
