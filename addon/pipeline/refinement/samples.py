"""Points in triangles at which light is compared with what the corners say of it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.ranges import repeat_ranges
from ...core.sampling.sequences import r2_sequence
from ...core.sampling.streams import stream
from ...core.sampling.warps import sample_uniform_triangle
from ...receivers import AttributeTarget, Receivers, vertex_receivers
from ...receivers.vertices import LIFT
from .triangles import Placed, Split, Triangles

Light = Callable[[Receivers], tuple[np.ndarray, np.ndarray]]
"""What receivers receive: irradiance (n, 3) float32, W/m², and its standard error (n,)."""

LEAST_LIGHT = 0.25
"""Share of the mean irradiance, to which errors of darker places are compared: errors there are hardly seen."""

_STREAM = 101


@dataclass(frozen=True)
class Samples:
    """s points in triangles.

    Attributes
    ----------
    triangle : (s,) int
    weight : (s, 3) float32
        Barycentric.
    light : (s, 3) float32, W/m²
    stderr : (s,) float32, W/m²
    """

    triangle: np.ndarray
    weight: np.ndarray
    light: np.ndarray
    stderr: np.ndarray

    @staticmethod
    def placed(counts: np.ndarray, seed: int, turn: int) -> "Samples":
        """So many points (t,) in each triangle, evenly spread (R₂ sequence, shifted at random); still dark."""
        triangle, k = repeat_ranges(counts)
        shift = stream(seed, _STREAM, turn).random((len(counts), 2), np.float32)[triangle]
        b, c = sample_uniform_triangle(np.mod(shift + r2_sequence(k), np.float32(1)))
        weight, n = np.stack([1 - b - c, b, c], axis=1).astype(np.float32), len(triangle)
        return Samples(triangle, weight, np.zeros((n, 3), np.float32), np.zeros(n, np.float32))

    def __len__(self) -> int:
        return len(self.triangle)

    def joined(self, other: "Samples") -> "Samples":
        """These and others."""
        return Samples(
            *(
                np.concatenate([getattr(self, name), getattr(other, name)])
                for name in ("triangle", "weight", "light", "stderr")
            )
        )

    def lit(self, light: np.ndarray, stderr: np.ndarray) -> "Samples":
        """The same points with light."""
        return Samples(self.triangle, self.weight, light, stderr)

    def after(self, split: Split) -> "Samples":
        """The same points in the triangles after a split."""
        return Samples(*split.moved(self.triangle, self.weight), self.light, self.stderr)

    def receivers(self, triangles: Triangles) -> Receivers:
        """The points as receivers, for no targets."""
        at, weight = self.triangle, self.weight[:, :, None]
        normal = (triangles.normal[at] * weight).sum(axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.float32(1e-30))
        size = np.sqrt(triangles.area[at]).astype(np.float32)
        position = (triangles.position[triangles.point[at]] * weight).sum(axis=1) + LIFT * size[:, None] * normal
        return Receivers(position.astype(np.float32), normal.astype(np.float32), size)

    def errors(self, corner_light: np.ndarray, corner_stderr: np.ndarray, least: float) -> np.ndarray:
        """How far light is from what corners say of it, beyond the noise of both, (s,) float32, relative to the light.

        Parameters
        ----------
        corner_light : (t, 3, 3), W/m²
        corner_stderr : (t, 3), W/m²
        least : float, W/m²
            Light that errors are compared to where there is less.
        """
        said = np.einsum("sc,scd->sd", self.weight, corner_light[self.triangle])
        off = np.abs(self.light - said).mean(axis=1)
        of_corners = ((self.weight * corner_stderr[self.triangle]) ** 2).sum(axis=1)
        noise = np.sqrt(self.stderr**2 + of_corners)
        light = np.maximum(self.light.mean(axis=1), said.mean(axis=1))
        return np.maximum(off - noise, 0) / np.maximum(light, max(least, 1e-30))


def corner_receivers(triangles: Triangles, rows: np.ndarray) -> tuple[Receivers, np.ndarray]:
    """Receivers of the corners of some triangles, and which of them each corner's is, (k, 3) int."""
    receivers = vertex_receivers([triangles.receiver_mesh(rows)])
    return receivers, receivers.targets[0].receiver_of_element.reshape(-1, 3)


def on_objects(parts: list[Receivers], owners: list[np.ndarray], meshes: list[Placed]) -> Receivers:
    """All receivers, with the objects that they are on: which of the meshes, for each part (n,)."""
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable").astype(np.int32)
    chosen, start = np.unique(owner[order], return_index=True)
    targets = tuple(
        AttributeTarget(meshes[i].object_name, meshes[i].mesh_name, "POINT", rows)
        for i, rows in zip(chosen, np.split(order, start[1:]), strict=True)
    )
    position, normal, footprint = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("position", "normal", "footprint")
    )
    return Receivers(position, normal, footprint, targets)


def mean_by(triangle: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """Mean of samples' values (s,) in each of n triangles, (n,) float64; 0 where there is none."""
    return np.bincount(triangle, values, n) / np.maximum(np.bincount(triangle, minlength=n), 1)
