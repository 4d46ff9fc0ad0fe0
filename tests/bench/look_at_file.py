"""What the trial on public files wants to know of one, in a process of its own; see public_files.py.

look_at_file.py shown FILE ANSWER.json            the mesh objects with faces that renders show, and the area of all
look_at_file.py cycles FILE ANSWER.json           how long Cycles' bake of them takes, with 16 samples
look_at_file.py picture FILE PICTURE.png BAKED    Cycles' picture beside that of the baked file
"""

import json
import os
import sys
from pathlib import Path
from time import perf_counter, process_time

import bpy
import numpy as np
from cycles_bakes import lose_no_light

N_SAMPLES = 16
WIDTH = 320  # pixels of a picture


class Counter(bpy.types.RenderEngine):
    """An engine that renders nothing and keeps which objects it was given: Blender's own word for what renders show."""

    bl_idname = "PHOTON_BAKE_COUNTER"
    bl_label = "Counter"
    bl_use_preview = False
    meshes: list[str] = []
    area = 0.0  # m², of all faces, those of instances too

    def render(self, depsgraph):
        """Keep the mesh objects with faces, each once, that are objects of the view layer."""
        Counter.area = sum(map(area_of, depsgraph.object_instances))
        in_layer = {obj.original.name for obj in depsgraph.view_layer.objects}
        Counter.meshes = sorted(
            {
                instance.object.original.name
                for instance in depsgraph.object_instances
                if not instance.is_instance
                and instance.show_self
                and instance.object.type == "MESH"
                and instance.object.original.type == "MESH"
                and instance.object.original.name in in_layer
                and len(instance.object.data.polygons)
                and np.linalg.matrix_rank(np.array(instance.matrix_world)[:3, :3]) > 1  # at zero scale there is no area
            }
        )


def area_of(instance):
    """The area of an instance's faces, m², as if it were scaled alike along all axes."""
    obj = instance.object
    if not instance.show_self or obj.type != "MESH" or not len(obj.data.polygons):
        return 0.0
    areas = np.empty(len(obj.data.polygons), np.float32)
    obj.data.polygons.foreach_get("area", areas)
    return float(np.nan_to_num(areas, posinf=0.0).sum(dtype=float)) * abs(instance.matrix_world.determinant()) ** (
        2 / 3
    )


def shown():
    """Names of the mesh objects with faces that renders of the scene show."""
    bpy.utils.register_class(Counter)
    scene = bpy.context.scene
    engine, camera = scene.render.engine, scene.camera
    scene.render.engine = Counter.bl_idname
    scene.render.use_compositing = scene.render.use_sequencer = scene.render.use_freestyle = False
    for layer in scene.view_layers:
        layer.use = layer == bpy.context.view_layer
    if camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    small_picture(64)
    bpy.ops.render.render()
    scene.render.engine, scene.camera = engine, camera
    bpy.utils.unregister_class(Counter)
    return Counter.meshes


def small_picture(width):
    """Make renders `width` pixels wide."""
    render = bpy.context.scene.render
    render.resolution_percentage, render.use_border = 100, False
    render.resolution_x, render.resolution_y = width, max(32, round(width * render.resolution_y / render.resolution_x))


def cycles_bake(names):
    """What Cycles' bake of indirect light takes onto the corners of objects of some names."""
    lose_no_light()
    bpy.context.scene.cycles.samples = N_SAMPLES
    if bpy.context.object is not None and bpy.context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    objects = [bpy.context.view_layer.objects[name] for name in names]
    objects = [obj for obj in objects if obj.data.library is None and len(obj.data.polygons)]
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    for obj in objects:
        obj.hide_set(False)
        obj.hide_select = obj.hide_viewport = False
        obj.select_set(True)
        if "Trial" not in obj.data.color_attributes:
            obj.data.color_attributes.new("Trial", "FLOAT_COLOR", "CORNER")
        obj.data.color_attributes.active_color = obj.data.color_attributes["Trial"]
    bpy.context.view_layer.objects.active = objects[0]
    start, cpu = perf_counter(), process_time()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"INDIRECT"}, target="VERTEX_COLORS", use_clear=True)
    took = {"seconds": perf_counter() - start, "cpu_seconds": process_time() - cpu, "objects": len(objects)}
    return {f"cycles_{name}": value for name, value in took.items()}


def picture(path, baked):
    """Cycles' picture of the open file, and of the one `baked` with surfaces that shine with the baked light alone."""
    halves = [rendered()]
    bpy.ops.wm.open_mainfile(filepath=baked)
    bpy.context.view_layer.material_override = light_alone()
    for light in bpy.data.lights:
        light.energy = 0
    halves.append(rendered())
    both = np.concatenate(halves, axis=1)
    image = bpy.data.images.new("Both", both.shape[1], both.shape[0])
    image.pixels.foreach_set(both.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()


def light_alone():
    """A material that shines with the baked light."""
    material = bpy.data.materials.new("Light Alone")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    attribute, emission = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeEmission")
    attribute.attribute_name = "Indirect"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(attribute.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def rendered():
    """A small picture of the open scene as displays show it, (h, w, 4) float32."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 32
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.image_settings.file_format = "PNG"
    small_picture(WIDTH)
    scene.render.filepath = os.path.join(bpy.app.tempdir, "half.png")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty((image.size[1], image.size[0], 4), np.float32)
    image.pixels.foreach_get(pixels.ravel())
    bpy.data.images.remove(image)
    return pixels


def main(what, file, answer, baked=None):
    bpy.ops.wm.open_mainfile(filepath=os.path.abspath(file))
    version = ".".join(map(str, bpy.data.version[:2]))
    if what == "picture":
        picture(answer, baked)
        return
    names = shown()
    said = {"version": version, "shown": names, "area": Counter.area}
    if what == "cycles":
        said = cycles_bake(names)
    Path(answer).write_text(json.dumps(said))


if __name__ == "__main__":
    status = 1
    try:
        main(*sys.argv[1:])
        status = 0
    except BaseException as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
    sys.stderr.flush()
    os._exit(status)  # without the module's own end, in which some versions hang after a render
