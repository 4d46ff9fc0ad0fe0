"""Small scenes in plain arrays, for tests that know the answer, and χ² tests."""

from dataclasses import fields, replace

import numpy as np
from photon_bake.addon.core.compiling import jit
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.scene import LightKind, Lights, Materials, Scene, SceneObjects, World
from scipy import stats


def fewer(n):
    """So many samples; where kernels run as plain Python, a 256th, for tests whose bounds follow the noise."""
    return n if jit() else max(n >> 8, 100)


def scene_of(vertices, triangles, albedo=0.5, emission=0.0, lights=None, world=0.0, material=None, hidden=()) -> Scene:
    """A scene of one object a triangle, all of one material unless `material` says otherwise.

    `albedo` and `emission` are numbers or one a material; triangles in `hidden` are seen by no diffuse or shadow ray.
    """
    vertices, triangles = np.asarray(vertices, np.float32), np.asarray(triangles, np.int32).reshape(-1, 3)
    n = len(triangles)
    albedo = np.atleast_1d(np.asarray(albedo, np.float32))
    albedo = np.repeat(albedo[:, None], 3, 1) if albedo.ndim == 1 else albedo
    emission = np.broadcast_to(np.asarray(emission, np.float32).reshape(-1, 1), (len(albedo), 3))
    seen = ~np.isin(np.arange(n), hidden)
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Scene(
        vertices=vertices,
        triangles=triangles,
        corner_normals=np.repeat(normals[:, None], 3, axis=1),
        corner_uvs=corners[:, :, :2].copy(),
        material_of_triangle=np.zeros(n, np.int32) if material is None else np.asarray(material, np.int32),
        object_of_triangle=np.arange(n, dtype=np.int32),
        materials=Materials.matte_of(albedo, emission),
        objects=SceneObjects(
            tuple(f"Triangle {i}" for i in range(n)),
            *(seen.copy() for _ in range(4)),
            np.ones(n, bool),
            seen.copy(),
            np.zeros(n, bool),
        ),
        lights=lights or Lights.none(),
        world=World.constant(world),
    )


def of_objects(scene, object_of_triangle) -> Scene:
    """The scene, whose triangles belong to objects (t,) instead of one each."""
    object_of_triangle = np.asarray(object_of_triangle, np.int32)
    first = np.unique(object_of_triangle, return_index=True)[1]
    columns = {
        f.name: getattr(scene.objects, f.name) for f in fields(scene.objects) if f.name not in {"links", "fibrous"}
    }
    chosen = {name: tuple(c[k] for k in first) if name == "names" else c[first] for name, c in columns.items()}
    return replace(scene, objects=SceneObjects(**chosen), object_of_triangle=object_of_triangle)


def plane(half=1.0, z=0.0):
    """Two triangles that face up: vertices, triangles."""
    corners = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
    return np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def box(half=1.0, inwards=True):
    """A cube around the origin: vertices (8, 3), triangles (12, 3), facing in or out."""
    vertices = np.array([(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)], np.float32)
    quads = np.array(
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)], np.int32
    )  # facing outwards
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return vertices, triangles[:, ::-1] if inwards else triangles


def ball(radius, centre=(0, 0, 0), n=24):
    """A sphere of n rings of 2n faces each, facing out: vertices, triangles."""
    theta, phi = np.linspace(0, np.pi, n + 1)[:, None], np.arange(2 * n) * np.pi / n
    z = np.broadcast_to(np.cos(theta), (n + 1, 2 * n))
    grid = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=2).reshape(-1, 3) * radius
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij"))
    a, b, c, d = (p * 2 * n + q % (2 * n) for p, q in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
    triangles = np.concatenate([np.stack([a, b, c], axis=1)[i < n - 1], np.stack([a, c, d], axis=1)[i > 0]])
    return (grid + centre).astype(np.float32), triangles.astype(np.int32)


def merge(*meshes):
    """Several (vertices, triangles) as one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([triangles + offset for (_, triangles), offset in zip(meshes, offsets, strict=False)]),
    )


def lamp(kind: LightKind, emission=1.0, position=(0, 0, 1), direction=(0, 0, -1), name="Lamp", **columns) -> Lights:
    """One lamp; its frame is any that has its direction. `columns` are others of `Lights`."""
    direction = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    helper = (1.0, 0, 0) if abs(direction[0]) < 0.9 else (0, 1.0, 0)
    axis_y = np.cross(direction, helper)
    axis_y /= np.linalg.norm(axis_y)
    return Lights.of(
        (name,),
        np.array([kind]),
        emission=np.broadcast_to(np.asarray(emission, np.float32), (1, 3)).copy(),
        position=[position],
        axis_x=[np.cross(axis_y, direction)],
        axis_y=[axis_y],
        direction=[direction],
        **{name: [value] for name, value in columns.items()},
    )


def receivers_at(positions, normals) -> Receivers:
    """Receivers at positions (n, 3) with normals (n, 3) or (3,)."""
    positions = np.atleast_2d(np.asarray(positions, np.float32))
    normals = np.broadcast_to(np.asarray(normals, np.float32), positions.shape).copy()
    return Receivers(positions, normals, np.full(len(positions), 0.01, np.float32))


def receivers_in_box(n_a_wall: int, half=1.0, lift=1e-3, seed=3) -> Receivers:
    """Evenly random receivers on the inner walls of `box`."""
    random = np.random.default_rng(seed)
    positions, normals = [], []
    for axis in range(3):
        for side in (-1, 1):
            place = random.uniform(-half, half, (n_a_wall, 3))
            place[:, axis] = side * (half - lift)
            positions.append(place)
            normals.append(np.tile(-side * np.eye(3)[axis], (n_a_wall, 1)))
    return receivers_at(np.concatenate(positions), np.concatenate(normals))


def grid_on_walls(n=12, lift=1e-3):
    """Receivers in the middles of n² squares of each wall: their mean is the walls' to a few parts in a thousand."""
    a, b = (axis.ravel() for axis in np.meshgrid(*[(np.arange(n) + 0.5) / n * 2 - 1] * 2))
    positions, normals = [], []
    for axis in range(3):
        for side in (-1, 1):
            positions.append(np.insert(np.stack([a, b], 1), axis, side * (1 - lift), axis=1))
            normals.append(np.tile(-side * np.eye(3)[axis], (n * n, 1)))
    return receivers_at(np.concatenate(positions), np.concatenate(normals))


def chi_square(counts, expected) -> float:
    """p-value of counts against expected counts, with sparse bins pooled."""
    counts, expected = np.ravel(counts).astype(float), np.ravel(expected)
    sparse = expected < 5
    counts = np.append(counts[~sparse], counts[sparse].sum())
    expected = np.append(expected[~sparse], expected[sparse].sum())
    if expected[-1] < 5:
        assert counts[-1] <= 20, "samples where the density is zero"
        counts, expected = counts[:-1], expected[:-1]
    return float(stats.chisquare(counts, expected * counts.sum() / expected.sum()).pvalue)


def chi_square_of_directions(directions, pdf) -> float:
    """χ² of directions (n, 3) in cells of z and φ against a density of z by solid angle."""
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-5)
    z_edges, phi_edges = np.linspace(-1, 1, 41), np.linspace(-np.pi, np.pi, 17)
    counts, _, _ = np.histogram2d(
        directions[:, 2], np.arctan2(directions[:, 1], directions[:, 0]), [z_edges, phi_edges]
    )
    fine = np.linspace(0, 1, 101)[:-1] + 0.005
    z = z_edges[:-1, None] + fine * np.diff(z_edges)[:, None]
    mass = pdf(z).mean(axis=1) * np.diff(z_edges) * (2 * np.pi)
    assert abs(mass.sum() - 1) < 2e-3, "the density does not integrate to one"
    return chi_square(counts, np.repeat(mass[:, None], 16, 1) / 16 * len(directions))
