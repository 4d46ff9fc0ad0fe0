"""The picture of docs/engines/threejs.md: Cycles, three.js with lightmaps, three.js with light on vertices."""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
import photon_bake
from photon_bake.addon.output.png import write_png
from photon_bake.tests.host import test_threejs as page
from photon_bake.tests.web.browser import lacking

PATH = Path(__file__).resolve().parents[2] / "docs" / "images" / "threejs.png"
GAP = 4


def shown(picture):
    """Light (h, w, 3) as a screen shows it, row 0 at the top."""
    picture = np.clip(picture[::-1], 0, 1)
    return np.where(picture < 0.0031308, 12.92 * picture, 1.055 * picture ** (1 / 2.4) - 0.055)


def beside(pictures, axis):
    """Pictures in a row or a column, with gaps."""
    gap = list(pictures[0].shape)
    gap[axis] = GAP
    parts = [part for one in pictures for part in (np.ones(gap), one)][1:]
    return np.concatenate(parts, axis=axis)


def main():
    """Make the picture."""
    if lacking():
        sys.exit(lacking())
    photon_bake.register()
    page.WIDTH, page.HEIGHT, page.FINE = 288, 216, 2
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with TemporaryDirectory() as folder:
        folder = Path(folder)
        page.add_terrace()
        page.bake(folder)
        bpy.ops.photon_bake.export_gltf(filepath=str(folder / "scene.glb"), cameras=True)
        full, direct = page.cycles(folder, 32, 128), page.cycles(folder, 0, 16)
        bounced = [full - direct, *(page.drawn(folder, f"baked={source}") for source in ("lightmap", "vertex"))]
        whole = [full, *(page.drawn(folder, f"baked={source}&lights") for source in ("lightmap", "vertex"))]
    rows = [beside([shown(2 * one) for one in bounced], 1), beside([shown(one) for one in whole], 1)]
    write_png(PATH, np.rint(255 * beside(rows, 0)).astype(np.uint8))
    print(PATH)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # version 4.5 of the module may hang at its own end
