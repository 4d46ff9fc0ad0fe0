"""The demo scene, and a picture of any baked scene.

    python tools/demo_scene.py build OUT.blend
    python tools/demo_scene.py render BAKED.blend OUT.png [--attribute NAME] [--samples N]

The picture is direct light by Cycles plus the baked light, as Use Baked Light shows it, so what bounces is the bake's
alone. It needs a camera in the file, and leaves the file as it is.
"""

import argparse
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from math import pi, radians
from pathlib import Path
from typing import Any

import bpy  # isort: skip  (the module brings bmesh and mathutils)
import bmesh
import numpy as np
from mathutils import Matrix, Vector

CELL = 0.06
"""Side of the walls' quads, m: the finest light that a bake to vertices can show."""

# --- the scene -------------------------------------------------------------------------------------------------------


def build(path: str) -> None:
    """Save the demo scene as `path`: the sun looks through a window into a room with coloured walls."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)  # keeps the add-ons that are on
    scene = bpy.context.scene
    _build_room()
    _build_things()
    _add_light(scene)
    _add_camera(scene)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 960, 720
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.exposure = 0.4
    scene.view_settings.look = "AgX - Medium High Contrast"
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(path).absolute()), compress=True)


def _build_room() -> None:
    """4 m wide (x), 5 m deep (y), 2.8 m high; the window is in the left wall, all quads face inwards."""
    white = _material("White", (0.80, 0.78, 0.74))
    red = _material("Red", (0.62, 0.08, 0.05))
    wood = _material("Wood", (0.52, 0.33, 0.18))
    _grid("Floor", (0, 0, 0), (4, 0, 0), (0, 5, 0), wood)
    _grid("Ceiling", (0, 0, 2.8), (0, 5, 0), (4, 0, 0), white)
    _grid("Back Wall", (0, 5, 0), (4, 0, 0), (0, 0, 2.8), white)
    _grid("Front Wall", (0, 0, 0), (0, 0, 2.8), (4, 0, 0), white)
    _grid("Right Wall", (4, 0, 0), (0, 0, 2.8), (0, 5, 0), red)
    _grid("Window Wall", (0, 0, 0), (0, 5, 0), (0, 0, 2.8), white, hole=((2.0, 0.8), (4.0, 2.3)))
    for i, y in enumerate((2.0, 3.0, 4.0)):
        _box(f"Window Post {i + 1}", (0.0, y, 1.55), (0.10, 0.07, 1.5), white)
    for i, z in enumerate((0.8, 1.75, 2.3)):
        _box(f"Window Bar {i + 1}", (0.0, 3.0, z), (0.10, 2.07, 0.07), white)


def _build_things() -> None:
    clay = _material("Clay", (0.78, 0.76, 0.72))
    blue = _material("Blue", (0.10, 0.24, 0.55))
    yellow = _material("Yellow", (0.80, 0.50, 0.06))
    _box("Pedestal", (2.35, 3.6, 0.35), (0.8, 0.8, 0.7), clay, turn=25)
    _smooth("Suzanne", bmesh.ops.create_monkey, clay, (2.35, 3.55, 1.17), 0.48, turn=-20, tilt=-12, subdivisions=1)
    ball = {"u_segments": 64, "v_segments": 32, "radius": 1.0}
    _smooth("Ball", bmesh.ops.create_uvsphere, blue, (1.25, 3.35, 0.36), 0.36, **ball)
    _torus("Ring", yellow, (3.25, 2.75, 0.13), 0.34, 0.13)


def _add_light(scene: Any) -> None:
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.color, sun.angle = 14.0, (1.0, 0.88, 0.72), radians(1.0)
    towards_sun = Vector((-0.88, 0.12, 0.36))
    _place(bpy.data.objects.new("Sun", sun)).rotation_euler = towards_sun.to_track_quat("Z", "Y").to_euler()
    world = bpy.data.worlds.new("Sky")
    _use_nodes(world)
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.45, 0.65, 1.0, 1.0)
    background.inputs["Strength"].default_value = 1.2
    scene.world = world


def _add_camera(scene: Any) -> None:
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start = 22.0, 0.01
    scene.camera = _place(bpy.data.objects.new("Camera", data))
    scene.camera.location = (2.15, 0.25, 1.45)
    scene.camera.rotation_euler = (radians(84), 0, radians(1))


def _material(name: str, colour: tuple[float, float, float]) -> Any:
    material = bpy.data.materials.new(name)
    _use_nodes(material)
    principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    principled.inputs["Base Color"].default_value = (*colour, 1.0)
    principled.inputs["Roughness"].default_value = 1.0
    principled.inputs["Specular IOR Level"].default_value = 0.0
    material.diffuse_color = (*colour, 1.0)
    return material


def _use_nodes(owner: Any) -> None:
    """Give a material or world its nodes; from Blender 5 on it always has them."""
    if bpy.app.version < (5, 0):
        owner.use_nodes = True


def _place(thing: Any) -> Any:
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _mesh_object(name: str, mesh: Any, material: Any, smooth: bool) -> Any:
    mesh.materials.append(material)
    mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
    return _place(bpy.data.objects.new(name, mesh))


def _grid(name: str, origin: Any, side_u: Any, side_v: Any, material: Any, hole: Any = None) -> Any:
    """A wall of quads facing side_u × side_v; `hole` is the window's lowest and highest (u, v) in metres."""
    origin, side_u, side_v = np.array(origin, float), np.array(side_u, float), np.array(side_v, float)
    size = np.array([np.linalg.norm(side_u), np.linalg.norm(side_v)])
    n_u, n_v = np.maximum(np.round(size / CELL).astype(int), 1)
    u, v = np.meshgrid(np.linspace(0, 1, n_u + 1), np.linspace(0, 1, n_v + 1), indexing="ij")
    vertices = origin + u.reshape(-1, 1) * side_u + v.reshape(-1, 1) * side_v
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n_u), np.arange(n_v), indexing="ij"))
    if hole is not None:
        centre = np.stack([(i + 0.5) / n_u, (j + 0.5) / n_v], axis=1) * size
        wall = ~((centre > hole[0]) & (centre < hole[1])).all(axis=1)
        i, j = i[wall], j[wall]
    corner = i * (n_v + 1) + j
    faces = np.stack([corner, corner + n_v + 1, corner + n_v + 2, corner + 1], axis=1)
    used, faces = np.unique(faces, return_inverse=True)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices[used].tolist(), [], faces.reshape(-1, 4).tolist())
    return _mesh_object(name, mesh, material, smooth=True)


def _box(name: str, centre: Any, size: Any, material: Any, turn: float = 0.0) -> Any:
    """A box with sharp edges, its faces cut into quads."""
    shape = bmesh.new()
    bmesh.ops.create_cube(shape, size=1.0, matrix=Matrix.Diagonal((*size, 1.0)))
    cuts = max(1, round(min(size) / CELL) - 1) if min(size) > 0.2 else 0
    if cuts:
        bmesh.ops.subdivide_edges(shape, edges=shape.edges[:], cuts=cuts, use_grid_fill=True)
    thing = _mesh_object(name, _to_mesh(name, shape), material, smooth=False)
    thing.matrix_world = Matrix.Translation(centre) @ Matrix.Rotation(radians(turn), 4, "Z")
    return thing


def _smooth(
    name: str, create: Any, material: Any, centre: Any, scale: float,
    turn: float = 0.0, tilt: float = 0.0, subdivisions: int = 0, **shape_options: Any,
) -> Any:  # fmt: skip
    shape = bmesh.new()
    create(shape, **shape_options)
    thing = _mesh_object(name, _to_mesh(name, shape), material, smooth=True)
    rotation = Matrix.Rotation(radians(turn), 4, "Z") @ Matrix.Rotation(radians(tilt), 4, "X")
    thing.matrix_world = Matrix.Translation(centre) @ rotation @ Matrix.Scale(scale, 4)
    if subdivisions:
        thing.modifiers.new("Subdivision", "SUBSURF").levels = subdivisions
        depsgraph = bpy.context.evaluated_depsgraph_get()
        finer = bpy.data.meshes.new_from_object(thing.evaluated_get(depsgraph))
        thing.modifiers.clear()
        thing.data = finer
    return thing


def _torus(name: str, material: Any, centre: Any, radius: float, thickness: float, n: int = 72, m: int = 28) -> Any:
    a, b = np.meshgrid(np.arange(n) * 2 * pi / n, np.arange(m) * 2 * pi / m, indexing="ij")
    out = radius + thickness * np.cos(b)
    vertices = np.stack([out * np.cos(a), out * np.sin(a), thickness * np.sin(b)], axis=-1).reshape(-1, 3)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    i_next, j_next = (i + 1) % n, (j + 1) % m
    faces = np.stack([i * m + j, i_next * m + j, i_next * m + j_next, i * m + j_next], axis=1)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    thing = _mesh_object(name, mesh, material, smooth=True)
    thing.location = centre
    return thing


def _to_mesh(name: str, shape: Any) -> Any:
    mesh = bpy.data.meshes.new(name)
    shape.to_mesh(mesh)
    shape.free()
    return mesh


# --- the picture -----------------------------------------------------------------------------------------------------


def render(path: str, picture: str, attribute: str = "Indirect", samples: int = 48) -> None:
    """Render the baked file `path` with its camera to `picture`: direct light plus baked light."""
    from photon_bake.addon.blender.show import Layer, use_baked_light

    bpy.ops.wm.open_mainfile(filepath=str(Path(path).absolute()))
    scene = bpy.context.scene
    if scene.camera is None:
        raise SystemExit(f"{path} has no camera to render with.")
    for warning in use_baked_light(scene, [Layer(attribute=attribute)]):
        print(warning, file=sys.stderr)
    _set_up_cycles(scene, samples)
    scene.render.filepath = str(Path(picture).absolute())
    with _progress_of_cycles():
        bpy.ops.render.render(write_still=True)


@contextmanager
def _progress_of_cycles() -> Iterator[None]:
    """Show how far the render is in place of Cycles' log; nothing where QUIET is set."""
    from photon_bake.addon.output import hushed
    from photon_bake.operators.command_line.console import ProgressLine

    line = ProgressLine(sys.stderr, {"Rendering": 1.0}, name="demo_scene")

    def listen(said: str, *_: Any) -> None:
        sample = re.search(r"Sample (\d+)/(\d+)", said)
        if sample and not os.environ.get("QUIET"):
            line("Rendering", int(sample[1]) / int(sample[2]))

    bpy.app.handlers.render_stats.append(listen)
    try:
        with hushed(1):
            yield
    finally:
        bpy.app.handlers.render_stats.remove(listen)
        line.clear()


def _set_up_cycles(scene: Any, samples: int) -> None:
    """A size and quality that take about a minute."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 960, 720, 100
    scene.render.image_settings.file_format = "PNG"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = _has_denoiser()


def _has_denoiser() -> bool:
    """Whether this Cycles was built with OpenImageDenoise; distributions leave it out at times."""
    import _cycles

    return bool(_cycles.with_openimagedenoise)


def main(arguments: list[str] | None = None) -> None:
    """Build or render, as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    actions = parser.add_subparsers(dest="action", required=True)
    builder = actions.add_parser("build")
    builder.add_argument("blend")
    renderer = actions.add_parser("render")
    renderer.add_argument("blend")
    renderer.add_argument("picture")
    renderer.add_argument("--attribute", default="Indirect")
    renderer.add_argument("--samples", type=int, default=48)
    given = parser.parse_args(arguments)
    if given.action == "build":
        build(given.blend)
    else:
        render(given.blend, given.picture, given.attribute, given.samples)


if __name__ == "__main__":
    main()
