"""Measures how long a scene takes out of Blender, against Cycles' own start on the same scene.

    python tests/bench/extraction.py

Two scenes are built in code: 5 million triangles (sculpted, flat, textured and subdivided), and 2,000 objects with
meshes of their own beside 20,000 instances (10,000 by collections, 10,000 on vertices). Each measurement is a process
of its own:

- ours: `read_scene` on the evaluated dependency graph, and the most memory that the process had during it beyond
  what it had before;
- Cycles: a render of 4×4 pixels with one sample on all cores. Its start is the time from the first object that it
  synchronises to its first sample, by its own statistics: synchronisation and BVH. In Blenders before 5.0, where
  Python cannot listen to them safely, and as the last column, the time from the call to the first sample, in which
  Blender also evaluates the scene for the render.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
from photon_bake.addon.blender import read_scene

HEAD = [
    "Scene",
    "Triangles",
    "Instances",
    "Ours, s",
    "Ours, MB more",
    "Cycles' start, s",
    "Cycles / ours",
    "Its call, s",
]


def grid_mesh(name, n):
    """A rippled grid of n × n quads with a UV map."""
    x, y = np.meshgrid(*[np.linspace(-1, 1, n + 1)] * 2, indexing="ij")
    positions = np.stack([x, y, 0.3 * np.sin(4 * x) * np.cos(5 * y)], axis=-1).reshape(-1, 3)
    first = np.arange(n)[:, None] * (n + 1) + np.arange(n)
    corners = np.add.outer(first.ravel(), [0, n + 1, n + 2, 1])
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.loops.add(corners.size)
    mesh.polygons.add(len(corners))
    mesh.vertices.foreach_set("co", positions.astype(np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", corners.astype(np.int32).ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    uvs = positions[corners.ravel(), :2].astype(np.float32)
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uvs.ravel())
    return mesh


def add(name, data, location=(0, 0, 0), collection=None):
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def textured_material():
    material = bpy.data.materials.new("Textured")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Picture", 64, 64)
    node.image.generated_type = "UV_GRID"
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(node.outputs["Color"], surface.inputs["Base Color"])
    return material


def build_triangles():
    """5 million triangles in four objects."""
    kinds = {"Smooth": 790, "Flat": 790, "Textured": 790, "Subdivided": 99}
    for i, (name, n) in enumerate(kinds.items()):
        obj = add(name, grid_mesh(name, n), (3 * i, 0, 0))
        obj.rotation_euler, obj.scale = (0.1, 0.2, 0.3 * i), (1, 1.5, 1)
        if name != "Flat":
            obj.data.shade_smooth()
        if name == "Textured":
            obj.data.materials.append(textured_material())
        if name == "Subdivided":
            modifier = obj.modifiers.new("Subdivision", "SUBSURF")
            modifier.levels = modifier.render_levels = 3


def build_instances():
    """2,000 objects, and 20,000 instances beside them; each of 80 triangles."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.4)
    template = bpy.context.object.data
    template.shade_smooth()
    bpy.data.objects.remove(bpy.context.object)
    for i in range(2000):
        add(f"Own {i}", template.copy(), (i % 50, i // 50, 0))
    kit = bpy.data.collections.new("Kit")
    for i in range(10):
        add(f"Part {i}", template.copy(), (i / 10, 0, 0), kit)
    for i in range(1000):
        empty = add(f"Kit {i}", None, (i % 50, i // 50, 2))
        empty.instance_type, empty.instance_collection = "COLLECTION", kit
    points = add("Points", grid_mesh("Points", 99), (0, 0, 5))
    points.instance_type, points.show_instancer_for_render, points.scale = "VERTS", False, (50, 50, 1)
    add("On points", template.copy()).parent = points


BUILDERS = {"5 M triangles": build_triangles, "22,000 instances": build_instances}


def build(name):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    BUILDERS[name]()
    add("Sun", bpy.data.lights.new("Sun", "SUN"), (0, 0, 50))
    bpy.context.view_layer.update()


def resident_mb(field):
    """What the kernel says of this process' memory: VmRSS now, VmHWM at most."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field):
            return int(line.split()[1]) * 1024 / 1e6
    return 0.0


def measure_ours(name):
    build(name)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    before = 0.0
    if Path("/proc/self/clear_refs").exists():
        Path("/proc/self/clear_refs").write_text("5")  # the most from now on
        before = resident_mb("VmRSS")
    start = perf_counter()
    scene = read_scene(depsgraph).scene(bpy.context.scene)
    seconds = perf_counter() - start
    more = resident_mb("VmHWM") - before
    return {"seconds": seconds, "mb": more, "triangles": scene.n_triangles, "objects": len(scene.objects.names)}


def measure_cycles(name):
    build(name)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.use_persistent_data = False
    scene.camera = add("Camera", bpy.data.cameras.new("Camera"), (0, 0, 60))
    said = []
    if bpy.app.version >= (5, 0, 0):
        bpy.app.handlers.render_stats.append(lambda text, _: said.append((perf_counter(), str(text))))
    start = perf_counter()
    bpy.ops.render.render()
    call = perf_counter() - start
    times = [time for time, text in said if "Synchronizing object" in text or "Sample 0/" in text]
    return {"seconds": times[-1] - times[0] if times else call, "call": times[-1] - start if times else call}


def in_process(what, name):
    """What a process of its own measures."""
    with tempfile.NamedTemporaryFile(suffix=".json") as file:
        command = [sys.executable, __file__, "--measure", what, name, file.name]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return json.loads(Path(file.name).read_text())


def rows(repeats=3):
    """Table rows of `HEAD`, the medians of some runs of each in turn."""
    found = []
    for name in BUILDERS:
        ours, cycles = zip(
            *((in_process("ours", name), in_process("cycles", name)) for _ in range(repeats)), strict=True
        )
        seconds, start, call = (
            float(np.median([one[key] for one in runs]))
            for runs, key in ((ours, "seconds"), (cycles, "seconds"), (cycles, "call"))
        )
        found.append(
            [
                name,
                f"{ours[0]['triangles']:,}",
                f"{ours[0]['objects']:,}",
                f"{seconds:.2f}",
                f"{max(one['mb'] for one in ours):.0f}",
                f"{start:.2f}",
                f"{start / seconds:.1f}",
                f"{call:.2f}",
            ]
        )
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--measure", nargs=3, metavar=("WHAT", "SCENE", "FILE"), help="for the processes it starts")
    options = parser.parse_args()
    if options.measure:
        what, name, file = options.measure
        measure = measure_ours if what == "ours" else measure_cycles
        Path(file).write_text(json.dumps(measure(name)))
        return
    for row in [HEAD, ["---"] * len(HEAD), *rows(options.repeats)]:
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
