"""A photon in flight, for tests that change what matters to them."""

import numpy as np
from photon_bake.addon.emitters import Sphere
from photon_bake.addon.photons.front import Photon
from photon_bake.addon.scene import RayKind
from photon_bake.tests.core.values.lobe_formulas import f, triple, unit

INTO = unit(0.4, -0.3, -0.7)
REGION = Sphere(np.float32([2.0, 1, 8]), 0.5)
DIFFUSE, GLOSSY, TRANSMITTED, SHADOW = (
    int(k) for k in (RayKind.DIFFUSE, RayKind.GLOSSY, RayKind.TRANSMITTED, RayKind.SHADOW)
)


def photon(**values):
    """One of a lamp that comes down slantwise, with other values in place of its own."""
    given = {"origin": triple((0, 0, 1)), "direction": INTO, "power": triple((0.5, 0.4, 0.3)), "path_density": f(0.7)}
    given |= {
        "gained": f(1),
        "specular": True,
        "dispersed": False,
        "came_from": -1,
        "path": 5,
        "source": 0,
        "kind": np.uint8(DIFFUSE),
    }
    return Photon(**given | values)
