"""Materials as read, one a row, and as `Materials` holds them, in columns."""

from dataclasses import dataclass

import numpy as np

from ....scene import N_ANGLES, N_VIEWS, AngleCurves, Channel, Closures, Materials, Textures
from ..media.volume_shaders import VolumeShader
from .pictures.images import ImageTable
from .pictures.texture_grid import Coordinates
from .sums import ShaderSum, Term

CHANNELS = ("emission", "coverage", "tint")
OF_CLOSURES = ("weight", "roughness", "f0", "f90", "edge", "film", "stretch", "normal")
"""Channels of materials, and of closures."""


@dataclass(frozen=True)
class ChannelValues:
    """Channels of one row: the value of each, (3,) float32, and the texture of each that has one."""

    values: dict[str, np.ndarray]
    textures: dict[str, int]

    @staticmethod
    def of(channels: dict[str, np.ndarray], images: ImageTable, extends: bool) -> "ChannelValues":
        """Channels (h, w, 1 or 3), of which those that vary become textures."""
        values, textures = {}, {}
        for name, value in channels.items():
            varies = _varies(value)
            values[name] = np.ones(3, np.float32) if varies else np.broadcast_to(value[0, 0], 3)
            if varies:
                textures[name] = images.add(np.broadcast_to(value, (*value.shape[:2], 3)), extends)
        return ChannelValues(values, textures)


@dataclass(frozen=True)
class Surface:
    """One material, as `Materials` holds it in columns.

    Attributes
    ----------
    name : str
    channels : ChannelValues
    closures : list of (Term, ChannelValues)
        What it scatters, and the channels of that.
    coordinates : Coordinates
        Where its textures take their coordinates from.
    """

    name: str
    channels: ChannelValues
    closures: list[tuple[Term, ChannelValues]]
    coordinates: Coordinates

    @staticmethod
    def of(
        name: str, total: ShaderSum, images: ImageTable, coordinates: Coordinates | None = None, extends: bool = False
    ) -> "Surface":
        """A material of what its shaders add up to."""
        closures = []
        for term in total.closures():
            channels = {channel: getattr(term, channel) for channel in OF_CLOSURES}
            closures.append((term, ChannelValues.of(channels, images, extends)))
        return Surface(
            name, ChannelValues.of(total.channels(), images, extends), closures, coordinates or Coordinates()
        )

    @property
    def textured(self) -> bool:
        return any(one.textures for one in (self.channels, *(values for _, values in self.closures)))


def _varies(picture: np.ndarray) -> bool:
    """Whether an (h, w, channels) picture is not the same all over; most show it in a few texels."""
    step = max(picture.shape[0] // 16, 1)
    return any((np.abs(part - picture[:1, :1]) > 1e-6).any() for part in (picture[::step], picture))


@dataclass(frozen=True)
class Seen:
    """One material as it is seen from each side and by each kind of rays.

    Attributes
    ----------
    rows : list of Surface
        The first is that of the front for diffuse rays.
    as_seen : tuple of int
        Which of them each of `VIEWS` sees.
    one_sided : bool
        Whether what it is on is not there from behind.
    volume : VolumeShader or None
        What fills the meshes that it is on.
    """

    rows: list[Surface]
    as_seen: tuple[int, ...]
    one_sided: bool = False
    volume: VolumeShader | None = None

    @property
    def coordinates(self) -> Coordinates | None:
        """Where its textures take their coordinates from; None where it has none."""
        return next((row.coordinates for row in self.rows if row.textured), None)


def materials_of(seen: list[Seen], textures: Textures) -> Materials:
    """All materials, in columns; rows that the first ones do not tell come after those of all."""
    rows, seen_as = [one.rows[0] for one in seen], np.zeros((len(seen), N_VIEWS), np.int32)
    for k, one in enumerate(seen):
        number = [k, *range(len(rows), len(rows) + len(one.rows) - 1)]
        rows += one.rows[1:]
        seen_as[k] = [number[i] for i in one.as_seen]
    others = np.repeat(np.arange(len(seen), len(rows), dtype=np.int32)[:, None], N_VIEWS, axis=1)
    return Materials.of(
        len(rows),
        names=tuple(row.name for row in rows),
        closures=_closures(rows),
        textures=textures,
        seen_as=np.concatenate([seen_as, others]),
        one_sided=np.array([one.one_sided for one in seen] + [False] * len(others), bool),
        **{name: _channel([row.channels for row in rows], name) for name in CHANNELS},
    )


def _closures(rows: list[Surface]) -> Closures:
    """The closures of materials, one after the other."""
    start = np.cumsum([0, *(len(row.closures) for row in rows)])
    terms = [term for row in rows for term, _ in row.closures]
    values = [of_term for row in rows for _, of_term in row.closures]
    layer = [term.under for term in terms]
    first = np.repeat(start[:-1], np.diff(start))
    return Closures.of(
        start,
        np.array([term.kind for term in terms], np.int32),
        ior=np.array([term.ior for term in terms], np.float32),
        fresnel=np.array([term.fresnel for term in terms], bool),
        preserves_energy=np.array([term.keeps_energy for term in terms], bool),
        normal_space=np.array([term.normal_space for term in terms], np.int32),
        layer=np.where(np.array(layer, int) >= 0, first + np.array(layer, int), -1).astype(np.int32),
        by_angle=_angle_curves([term.by_angle for term in terms]),
        distribution=np.array([term.distribution for term in terms], np.int32),
        curve=np.array([term.curve for term in terms], np.int32),
        **{name: _channel(values, name) for name in OF_CLOSURES},
    )


def _angle_curves(by_angle: list[tuple[float, ...]]) -> AngleCurves:
    """The curves of closures, alike ones once."""
    different = list(dict.fromkeys(curve for curve in by_angle if curve))
    index = {curve: i for i, curve in enumerate(different)} | {(): -1}
    curves = np.array(different, np.float32).reshape(-1, N_ANGLES)
    return AngleCurves(np.array([index[curve] for curve in by_angle], np.int32), curves)


def _channel(rows: list[ChannelValues], name: str) -> Channel:
    values = np.array([row.values[name] for row in rows], np.float32).reshape(-1, 3)
    return Channel(values, np.array([row.textures.get(name, -1) for row in rows], np.int32))
