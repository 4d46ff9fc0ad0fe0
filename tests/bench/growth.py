"""How a bake's time and memory grow with photons and with triangles."""

from dataclasses import replace
from time import perf_counter

import bpy
from memory import extra_memory
from photon_bake.addon.blender import extract_scene
from photon_bake.addon.settings import settings_for

HEAD = ["Changed", "Photons", "Triangles", "Receivers", "Seconds", "MB more"]
PHOTONS = (250_000, 1_000_000, 4_000_000, 16_000_000)
LEVELS = (3, 5, 7, 8)  # of simple subdivision


def rows(case):
    """Rows of `HEAD`: a case at medium quality with more and more photons, then with its triangles cut up."""
    found = [_row("photons", case, n) for n in PHOTONS]
    modifiers = [_subdivided(obj) for obj in bpy.data.objects if obj.type == "MESH" and obj.visible_diffuse]
    for level in LEVELS:
        for modifier in modifiers:
            modifier.levels = modifier.render_levels = level
        bpy.context.view_layer.update()
        scene = extract_scene(bpy.context.evaluated_depsgraph_get())
        found.append(_row("triangles", replace(case, scene=scene), PHOTONS[1]))
    return found


def memory_a_unit(found, column):
    """Bytes that each photon (column 1) or receiver (column 3) adds, from the first and last row that tell."""
    number = [float(row[column].replace(",", "")) for row in found if row[-1]]
    size = [float(row[-1].replace(",", "")) * 1e6 for row in found if row[-1]]
    return (size[-1] - size[0]) / (number[-1] - number[0]) if size else None


def _row(what, case, n_photons):
    start = perf_counter()
    _, memory = extra_memory(lambda: case.bake(settings_for("medium", n_photons=n_photons)))
    seconds = perf_counter() - start
    numbers = (f"{n:,}" for n in (n_photons, case.scene.n_triangles, len(case.receivers)))
    return [what, *numbers, f"{seconds:.1f}", "" if memory is None else f"{memory:,.0f}"]


def _subdivided(obj):
    modifier = obj.modifiers.new("Cut", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    return modifier
