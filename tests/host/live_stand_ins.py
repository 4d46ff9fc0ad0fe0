"""Surfaces and light as the live engine gives them, for tests of what Blender's side makes of them."""

from types import SimpleNamespace

import numpy as np


def square(number=0, first=0, z=0.0, side=2.0, material=0):
    """A square around the z axis that faces up."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], np.float32)
    return SimpleNamespace(
        object=number,
        vertices=slice(first, first + 4),
        position=np.concatenate([corners * side / 2, np.full((4, 1), z)], axis=1).astype(np.float32),
        normal=np.tile(np.array([0, 0, 1], np.float32), (4, 1)),
        uv=(corners + 1) / 2,
        triangles=np.array([(0, 1, 2), (0, 2, 3)], np.int32),
        material=np.full(2, material, np.int32),
    )


class Surfaces:
    """As `LiveSurfaces`."""

    def __init__(self, *meshes):
        self.meshes = meshes

    def __len__(self):
        return self.meshes[-1].vertices.stop if self.meshes else 0


def light_on(surfaces, direct=1.0, indirect=0.5, version=1, error=0.02, converged=False):
    """The same light everywhere, as `LiveLight`."""
    ones = np.ones((len(surfaces), 3), np.float32)
    return SimpleNamespace(
        version=version,
        surfaces=surfaces,
        direct=ones * np.float32(direct),
        indirect=ones * np.float32(indirect),
        error=error,
        since=0.0,
        converged=converged,
    )


class Engine:
    """As `Live`: remembers what it is told, and answers with the same light each time."""

    def __init__(self, surfaces):
        self.edits, self.failure, self.running = [], None, True
        self.light = light_on(surfaces)

    def edit(self, *edits):
        self.edits += edits
        self.light = light_on(getattr(edits[-1], "surfaces", self.light.surfaces), version=self.light.version + 1)

    def start(self):
        self.running = True

    def stop(self):
        self.running = False

    def told(self):
        """Kinds of the edits since it was asked last."""
        edits, self.edits = self.edits, []
        return [type(one).__name__ for one in edits]
