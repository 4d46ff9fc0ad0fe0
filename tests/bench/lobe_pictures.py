"""Pictures of docs/lobes.md: each lobe on a ball in a small room, baked beside rendered, and the page itself.

    python tests/bench/lobe_pictures.py                    all, into docs/images/lobes, and docs/lobes.md
    python tests/bench/lobe_pictures.py --only sheen       those with "sheen" in their name; the page stays

Left of each picture is Cycles' render of direct light with the pass of a bake at medium added by the compositor, right
Cycles' own render of all light.
"""

import argparse
import tempfile
from pathlib import Path

import bpy
import numpy as np
import photon_bake
from camera_pictures import add_baked_pass, rendered
from photon_bake.addon.output.png import write_png
from photon_bake.tests.host.cases.cycles import set_cycles
from photon_bake.tests.host.cases.stage import lamp, nodes, put, room, shader, world

DOCS = Path(__file__).resolve().parents[2] / "docs"
SIDE = 160  # pixels
SAMPLES = 256

GOLD = (1.0, 0.71, 0.29)
RED = (0.6, 0.05, 0.04)

PRINCIPLED = {
    "Coat": {"Base Color": RED, "Coat Weight": 1.0, "Coat Roughness": 0.05},
    "Tinted coat": {"Base Color": (0.8, 0.8, 0.8), "Coat Weight": 1.0, "Coat Tint": (0.9, 0.4, 0.1)},
    "Coat over metal": {"Base Color": GOLD, "Metallic": 1.0, "Roughness": 0.4, "Coat Weight": 1.0},
    "Sheen": {"Base Color": (0.1, 0.02, 0.05), "Roughness": 1.0, "Sheen Weight": 1.0, "Sheen Roughness": 0.3},
    "Rough diffuse": {"Base Color": (0.8, 0.7, 0.6), "Specular IOR Level": 0.0, "Diffuse Roughness": 1.0},
    "Anisotropic metal": {"Base Color": (0.8, 0.8, 0.8), "Metallic": 1.0, "Roughness": 0.4, "Anisotropic": 0.9},
    "Edge tint": {"Base Color": GOLD, "Metallic": 1.0, "Roughness": 0.2, "Specular Tint": (0.2, 0.4, 1.0)},
    "Thin film": {"Base Color": (0.02, 0.02, 0.02), "Roughness": 0.1, "Thin Film Thickness": 420.0},
    "Subsurface": {"Base Color": (0.9, 0.5, 0.4), "Subsurface Weight": 1.0, "Subsurface Scale": 0.3},
    "Rough transmission": {"Base Color": (0.9, 1, 0.9), "Transmission Weight": 1.0, "Roughness": 0.3},
}
SHADERS = {
    "Diffuse BSDF": ("BsdfDiffuse", {"Color": RED}, {}),
    "Diffuse BSDF, roughness": ("BsdfDiffuse", {"Color": (0.8, 0.7, 0.6), "Roughness": 1.0}, {}),
    "Translucent BSDF": ("BsdfTranslucent", {"Color": (0.7, 0.8, 0.3)}, {}),
    "Glossy BSDF, GGX": ("BsdfAnisotropic", {"Color": GOLD, "Roughness": 0.3}, {"distribution": "GGX"}),
    "Glossy BSDF, Beckmann": ("BsdfAnisotropic", {"Color": GOLD, "Roughness": 0.3}, {"distribution": "BECKMANN"}),
    "Glossy BSDF, Ashikhmin-Shirley": (
        "BsdfAnisotropic",
        {"Color": GOLD, "Roughness": 0.3},
        {"distribution": "ASHIKHMIN_SHIRLEY"},
    ),
    "Metallic BSDF": ("BsdfMetallic", {"Base Color": GOLD, "Roughness": 0.2}, {}),
    "Glass BSDF": ("BsdfGlass", {"Color": (0.9, 1, 0.95), "Roughness": 0.0}, {}),
    "Refraction BSDF": ("BsdfRefraction", {"Color": (1, 0.9, 0.8), "Roughness": 0.2, "IOR": 1.3}, {}),
    "Sheen BSDF": ("BsdfSheen", {"Color": (0.7, 0.6, 0.9), "Roughness": 0.5}, {}),
    "Sheen BSDF, velvet": ("BsdfSheen", {"Color": (0.7, 0.6, 0.9), "Roughness": 0.5}, {"distribution": "ASHIKHMIN"}),
    "Toon BSDF": ("BsdfToon", {"Color": RED}, {}),
}

PAGE = """# Lobes

Each lobe that is baked, on a ball in a small room: left Cycles' direct light with our pass, right Cycles' render of
all light. Made by `python tests/bench/lobe_pictures.py` with Blender {version}; *Mean* is how far means differ.

| Lobe | Ours, Cycles | Mean |
|---|---|---|
{rows}
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="TEXT")
    options = parser.parse_args()
    photon_bake.register()
    folder, rows = DOCS / "images" / "lobes", []
    folder.mkdir(parents=True, exist_ok=True)
    for name in (*PRINCIPLED, *SHADERS):
        if options.only.lower() not in name.lower():
            continue
        set_scene(name)
        ours, cycles = pair()
        off = ours.mean() / cycles.mean() - 1
        file = name.lower().replace(",", "").replace(" ", "_") + ".png"
        both = np.concatenate([ours, cycles], axis=1)
        write_png(folder / file, (255 * np.clip(both, 0, 1) ** (1 / 2.2) + 0.5).astype(np.uint8))
        rows.append(f"| {name} | ![{name}](images/lobes/{file}) | {off:+.1%} |")
        print(rows[-1], flush=True)
    if not options.only:
        page = PAGE.format(version=bpy.app.version_string, rows="\n".join(rows))
        (DOCS / "lobes.md").write_text(page, encoding="utf-8")


def set_scene(name):
    """A ball that wears a lobe, in a room with red and green walls, under a lamp, seen by a camera."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    room(without=("Front",))
    if name in PRINCIPLED:
        tree = nodes()
        material = tree.done(tree.add("BsdfPrincipled", PRINCIPLED[name]))
    else:
        kind, inputs, properties = SHADERS[name]
        material = shader(kind, inputs, **properties)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1.1, location=(0, 0, -0.9))
    ball = bpy.context.object
    ball.data.materials.append(material)
    ball.data.shade_smooth()
    lamp("AREA", (0.6, -0.9, 1.9), to=(0, 0, -0.6), energy=120.0, size=0.6)
    world((0.02, 0.02, 0.03))
    scene = bpy.context.scene
    scene.camera = put("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location, scene.camera.rotation_euler = (0, -6.2, 0), (np.pi / 2, 0, 0)
    scene.camera.data.angle = 0.75
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    set_cycles(SAMPLES)
    scene.render.threads_mode = "AUTO"
    bpy.context.view_layer.update()


def pair():
    """Direct light with our pass, and the full render, (h, w, 3) each."""
    scene = bpy.context.scene
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        cycles = rendered(scene, folder / "full.exr", compose=False)
        add_baked_pass(scene, folder)
        return rendered(scene, folder / "both.exr", compose=True), cycles


if __name__ == "__main__":
    main()
