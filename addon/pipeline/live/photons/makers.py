"""Which scenes photons are traced in at all."""

import numpy as np

from ....bsdf import SMOOTH
from ....scene import Lobe, Scene


def makes_caustics(scene: Scene) -> bool:
    """Whether some surface mirrors smoothly or is of glass, so that photons find what links do not."""
    closures = scene.materials.closures
    smooth = (closures.roughness.value[:, 0] < SMOOTH) | (closures.roughness.texture >= 0)
    clear = np.isin(closures.kind, (Lobe.GLASS, Lobe.PANE, Lobe.FIBRE))
    bright = (closures.weight.value != 0).any(axis=1)
    makes = np.zeros(len(scene.materials), bool)
    makes[closures.material[bright & (clear | (smooth & (closures.kind == Lobe.GLOSSY)))]] = True
    return bool(scene.materials.of_any_view(makes)[scene.material_of_triangle].any())
