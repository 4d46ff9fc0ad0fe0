"""Scenes of many small objects: robots of glossy metal, balls in a room, twenty thousand crumbs.

Lengths in metres, z up.
"""

from dataclasses import dataclass
from math import pi

import bpy
import numpy as np
from scene_parts import box, lamp, material, matte, sun

N_ROBOTS = 9
_LIMBS = ((-0.3, 1.5), (0.3, 1.5), (-0.15, 0.9), (0.15, 0.9))  # x and z of where they start


def robots():
    """Nine robots of glossy metal on a floor before two walls, under sun and sky: 148,000 receivers.

    Each has the same 99 meshes of balls, rings and rods.
    """
    for name, low, high in (
        ("Floor", (-4, -4, -0.2), (4, 4, 0)),
        ("Back", (-4, 4, -0.2), (4, 4.2, 4)),
        ("Side", (4, -4, -0.2), (4.2, 4.2, 4)),
    ):
        box(name, low, high, matte("Concrete", 0.5, 0.48, 0.45))
    metals = [
        _metal("Steel", 0.6, 0.6, 0.62, roughness=0.3),
        _metal("Copper", 0.8, 0.45, 0.3, roughness=0.2),
        _metal("Lacquer", 0.7, 0.1, 0.08, roughness=0.4),
    ]
    meshes = []
    for i, (shape, (middle, size)) in enumerate(_robot(np.random.default_rng(3))):
        vertices, faces, smooth = shape
        mesh = _mesh(f"Part {i + 1}", middle + vertices * size, faces, metals[i % 3], smooth)
        meshes.append(mesh)
    for k in range(N_ROBOTS):
        for i, mesh in enumerate(meshes):
            _place(f"Robot {k + 1}.{i + 1}", mesh, (2 * (k % 3 - 1), 2 * (k // 3 - 1), 0), 0.7 * k)
    sun((-0.4, -0.5, 0.7), 4.0, sky=0.8)


def balls():
    """A thousand balls of a decimetre, each with a mesh of its own, in a closed room with a lamp."""
    random = np.random.default_rng(4)
    for name, low, high in (("Floor", (0, 0, -0.2), (6, 4, 0)), ("Ceiling", (0, 0, 2.8), (6, 4, 3))):
        box(name, low, high, matte("White", 0.75, 0.74, 0.7))
    walls = [(-0.2, 0, 0, 4), (6, 6.2, 0, 4), (0, 6, -0.2, 0), (0, 6, 4, 4.2)]
    paints = [matte("Red", 0.6, 0.12, 0.1), matte("Green", 0.15, 0.5, 0.2), *2 * [matte("White", 0.75, 0.74, 0.7)]]
    for i, ((west, east, south, north), paint) in enumerate(zip(walls, paints, strict=True)):
        box(f"Wall {i + 1}", (west, south, -0.2), (east, north, 3), paint)
    vertices, faces, smooth = _ball(14, 10)
    paints = [matte(f"Paint {i + 1}", *color) for i, color in enumerate(random.uniform(0.1, 0.8, (5, 3)).tolist())]
    for i in range(1000):
        size = random.uniform(0.04, 0.09)
        mesh = _mesh(f"Ball {i + 1}", size * vertices, faces, paints[i % 5], smooth)
        _place(f"Ball {i + 1}", mesh, random.uniform((0.1, 0.1, 0.1), (5.9, 3.9, 2.3)))
    lamp("Lamp", "AREA", (3, 2, 2.75), 120, (1, 0.95, 0.85), shape="SQUARE", size=1.0)


def crumbs():
    """Twenty thousand cubes of a centimetre, each with a mesh of its own, on a table under a sky."""
    random = np.random.default_rng(6)
    box("Table", (-1, -1, -0.1), (1, 1, 0), matte("Oak", 0.5, 0.33, 0.18))
    box("Wall", (-1, 1, -0.1), (1, 1.1, 0.8), matte("Blue", 0.12, 0.2, 0.5))
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (0, 2)]) * 0.004
    faces = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    bread = matte("Bread", 0.7, 0.55, 0.35)
    for i in range(20_000):
        mesh = _mesh(f"Crumb {i + 1}", random.uniform(0.6, 1.3) * corners, faces, bread, np.zeros(6, bool))
        _place(f"Crumb {i + 1}", mesh, (*random.uniform(-0.95, 0.95, 2), 0.0002), random.uniform(0, pi))
    sun((-0.4, -0.5, 0.7), 4.0, sky=0.8)


SCENES = {"robots": robots, "balls": balls, "crumbs": crumbs}


def build(name):
    """Replace Blender's scene by one of `SCENES`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[name]()
    bpy.context.view_layer.update()


# --- what they are made of -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Chain:
    """Where a limb's parts are: along a bent line, thinner towards its end."""

    start: np.ndarray
    steps: np.ndarray
    width: float

    def __iter__(self):
        at = self.start
        for i, step in enumerate(self.steps):
            yield at, step, self.width * (1 - 0.05 * i)
            at = at + step


def _robot(random):
    """Shapes, and middles and half sizes (3,) of a robot's parts."""
    ball, ring, rod = _ball(16, 13), _ring(24, 10), _rod(20)
    for z, size in ((1.2, 0.3), (0.9, 0.22), (1.75, 0.17)):
        yield ball, (np.array([0, 0, z]), np.array([size, 0.7 * size, size]))
    for x, z in _LIMBS:
        steps = np.array([np.sign(x) * 0.05, -0.03, -0.1]) + random.uniform(-0.04, 0.04, (8, 3))
        for at, step, width in _Chain(np.array([x, 0, z]), steps, 0.07):
            yield ball, (at, np.full(3, 0.8 * width))
            yield ring, (at + 0.3 * step, np.array([width, width, 0.5 * width]))
            yield rod, (at + 0.5 * step, np.array([0.4 * width, 0.4 * width, 0.5 * np.linalg.norm(step)]))


def _ball(n, n_rings):
    """Vertices, faces and whether those are smooth, of a ball of radius 1."""
    latitude, longitude = np.meshgrid(
        np.arange(1, n_rings + 1) * pi / (n_rings + 1), np.arange(n) * 2 * pi / n, indexing="ij"
    )
    around = np.stack([np.sin(latitude) * np.cos(longitude), np.sin(latitude) * np.sin(longitude), np.cos(latitude)], 2)
    i, nexts = np.arange(n), np.roll(np.arange(n), -1)
    rings = [np.stack([i + r * n, i + r * n + n, nexts + r * n + n, nexts + r * n], 1) for r in range(n_rings - 1)]
    top, bottom, last = n * n_rings, n * n_rings + 1, n * (n_rings - 1)
    caps = [np.stack([i, nexts, 0 * i + top], 1), np.stack([nexts + last, i + last, 0 * i + bottom], 1)]
    faces = [*np.concatenate(rings), *np.concatenate(caps)]
    return np.concatenate([around.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]]), faces, np.ones(len(faces), bool)


def _ring(n, m):
    """The same of a ring round z, of radii 1 and 0.3."""
    a, b = np.meshgrid(np.arange(n) * 2 * pi / n, np.arange(m) * 2 * pi / m, indexing="ij")
    wide = 1 + 0.3 * np.cos(b)
    vertices = np.stack([wide * np.cos(a), wide * np.sin(a), 0.3 * np.sin(b)], 2).reshape(-1, 3)
    i, j = np.divmod(np.arange(n * m), m)
    nexts, up = (i + 1) % n, (j + 1) % m
    faces = np.stack([i * m + j, nexts * m + j, nexts * m + up, i * m + up], 1)
    return vertices, faces, np.ones(len(faces), bool)


def _rod(n):
    """The same of a rod along z, its sides smooth and its ends flat."""
    angle = np.arange(n) * 2 * pi / n
    circle = np.stack([np.cos(angle), np.sin(angle)], 1)
    vertices = np.concatenate([np.column_stack([circle, np.full(n, z)]) for z in (-1, 1)])
    i, nexts = np.arange(n), np.roll(np.arange(n), -1)
    faces = [*np.stack([i, nexts, nexts + n, i + n], 1), i[::-1], i + n]
    return vertices, faces, np.append(np.ones(n, bool), [False, False])


def _mesh(name, vertices, faces, material, smooth):
    mesh = bpy.data.meshes.new(name)
    sizes = [len(face) for face in faces]
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(sum(sizes))
    mesh.loops.foreach_set("vertex_index", np.concatenate(list(faces)).astype(np.int32))
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(sizes) - sizes).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", smooth)
    mesh.update(calc_edges=True)
    mesh.materials.append(material)
    return mesh


def _place(name, mesh, location, turn=0.0):
    obj = bpy.data.objects.new(name, mesh)
    obj.location, obj.rotation_euler = location, (0, 0, turn)
    bpy.context.scene.collection.objects.link(obj)


def _metal(name, *color, roughness):
    metal = material(name, color, roughness, specular=0.5)
    principled = next(node for node in metal.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Metallic"].default_value = 0.9  # of a pure one Cycles bakes nothing
    return metal
