"""Sources of photons: their power, what they shine on, and where their photons are aimed."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from ..core.compiling import kernel_array
from ..core.sampling.sobol import fixed_points
from ..scene import ALL_BOUNCES, RayKind, Scene
from .aiming.discs import Discs, discs_around
from .aiming.guided import Guide, guide_cells
from .aiming.projection_map import ProjectionMap, balls_of
from .aiming.regions import Sphere
from .emission import N_DIMENSIONS, Emitters, emit_rays
from .lamps import LampArrays, lamp_arrays
from .mesh import MeshArrays, mesh_arrays
from .patterns.pattern import fall_offs
from .row import MESH, WORLD, SourceRow
from .world import WorldArrays, world_arrays

_N_FOR_POWER = 1 << 13
"""Photons by which the power is told that lamps send to the scene, and spots into their cones."""


@dataclass(frozen=True)
class Rays:
    """Emitted light: origins (n, 3) m, unit directions (n, 3), flux (n, 3) W whose mean is the source's power.

    Also the objects that emitted it, (n,) int32; −1 where it was none of the scene's.
    """

    origins: np.ndarray
    directions: np.ndarray
    flux: np.ndarray
    objects: np.ndarray


@dataclass(frozen=True)
class Surroundings:
    """What the sources of a scene have in common."""

    scene: Scene
    discs: Discs
    lamps: LampArrays
    mesh: MeshArrays
    mesh_power: np.ndarray
    world: WorldArrays

    @property
    def world_is_sampled(self) -> bool:
        """Whether no photons of the world need to be stored where they first hit."""
        world = self.scene.world
        return world.image is not None or RayKind.DIFFUSE in world.hidden_from

    @staticmethod
    def of(scene: Scene, region: Sphere) -> "Surroundings":
        """Those of a scene's sources, the receivers being in `region`."""
        discs = discs_around(scene, region)
        mesh, power = mesh_arrays(scene, discs)
        return Surroundings(scene, discs, lamp_arrays(scene.lights), mesh, power, world_arrays(scene.world))


class Source:
    """Something that emits photons.

    Attributes
    ----------
    name : str
    kind, lamp, n_cells
        As in `SourceRow`.
    power : (3,) float64, W
        For the sun and the world, what enters the region of the receivers. Below 0 where light is taken away.
    importance : float
        What photons are shared out by: the power's size, until it is known what the photons are worth.
    sampled_directly : bool
        Its direct light is found by next-event estimation, so that its photons need not be stored where they first hit.
    illuminates, blocked_by : (o,) bool or None
        Objects that its light falls on, and that keep it away; None: all.
    max_bounces : int
        As in `Lights`.
    aim : ProjectionMap or None
        What half of the photons are aimed at.
    guide : Guide
        Where photons are worth most.
    """

    name: str
    power: np.ndarray
    n_cells: tuple[int, ...]
    illuminates: np.ndarray | None = None
    blocked_by: np.ndarray | None = None
    max_bounces = ALL_BOUNCES
    aim: ProjectionMap | None = None

    def __init__(self, row: SourceRow, surroundings: Surroundings) -> None:
        self.surroundings, self.row, self.guide = surroundings, row, Guide.even()
        self.kind, self.lamp, self.n_cells = row.kind, row.lamp, row.n_cells
        self.sampled_directly = self.kind != WORLD or surroundings.world_is_sampled
        if self.kind in (MESH, WORLD):
            self.name = "Emissive meshes" if self.kind == MESH else "World"
        else:
            self._be_lamp(self.lamp)
        self.power = self._measured_power() if row.power is None else row.power
        self.importance = float(np.abs(self.power).sum()) * self._fall_off()

    def aim_at(self, aim: ProjectionMap) -> None:
        """Aim half of the photons: those whose last number is below a half."""
        self.aim = aim
        self.n_cells = (*self.n_cells[:4], max(2 * self.n_cells[4], 2))

    def emit(self, u: np.ndarray) -> Rays:
        """Rays for points `u` (n, 5) of the unit hypercube."""
        return emitted([self], np.zeros(len(u), np.int32), u)

    def seen_by(self, kind: RayKind) -> bool:
        """Whether surfaces scatter its light by the lobe that rays of a kind follow."""
        scene = self.surroundings.scene
        if self.kind == WORLD:
            return kind not in scene.world.hidden_from
        return self.kind == MESH or bool(scene.lights.seen_by(kind)[self.lamp])

    def _be_lamp(self, lamp: int) -> None:
        """Take over what a lamp says of its light."""
        lights = self.surroundings.scene.lights
        self.name, self.max_bounces = lights.names[lamp], int(lights.max_bounces[lamp])
        self.illuminates = None if lights.illuminates is None else lights.illuminates[lamp]
        self.blocked_by = None if lights.blocked_by is None else lights.blocked_by[lamp]

    def _be_like(self, source: "Source") -> None:
        """Take over everything."""
        vars(self).update(vars(source))

    def _fall_off(self) -> float:
        """What is left of a lamp's light, beside that it spreads, about where the receivers are."""
        of = self.surroundings
        if self.kind in (MESH, WORLD) or not of.lamps.patterns.differs[self.lamp]:
            return 1.0
        away = np.linalg.norm(of.scene.lights.position[self.lamp] - np.array(of.discs.region))
        return float(fall_offs(of.lamps.patterns, self.lamp, np.array([max(away, of.discs.region_radius)]))[0])

    def _measured_power(self) -> np.ndarray:
        power: np.ndarray = self.emit(_points_for_power()).flux.mean(axis=0, dtype=np.float64)
        return power


@cache
def _points_for_power() -> np.ndarray:
    return fixed_points(_N_FOR_POWER, N_DIMENSIONS)


def emitters_of(sources: Sequence[Source]) -> Emitters:
    """The arrays of sources of one scene."""
    rows, of = [source.row for source in sources], sources[0].surroundings

    def column(name: str, dtype: Any) -> np.ndarray:
        return np.array([getattr(row, name) for row in rows], dtype)

    return Emitters(
        column("kind", np.int32),
        column("lamp", np.int32),
        column("axis", np.float32),
        column("versine", np.float64),
        column("aims", np.bool_),
        balls_of([source.aim for source in sources]),
        guide_cells([source.guide for source in sources]),
        of.lamps,
        of.mesh,
        of.world,
        of.discs,
        of.scene.arrays,
    )


def emitted(sources: Sequence[Source], source: np.ndarray, u: np.ndarray) -> Rays:
    """Rays of `sources` by their numbers (n,) int32 and points `u` (n, 5) of their hypercubes."""
    origins, directions, flux = np.empty((3, len(u), 3), np.float32)
    rays = Rays(origins, directions, flux, np.empty(len(u), np.int32))
    numbers = kernel_array(source, np.int32), kernel_array(u, np.float32)
    emit_rays(emitters_of(sources), *numbers, origins, directions, flux, rays.objects)
    return rays
