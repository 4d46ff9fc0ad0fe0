"""How a bake's time and memory grow with photons and with triangles."""

from dataclasses import dataclass, replace
from time import perf_counter

import bpy
from figures import rendered_scene
from memory import extra_memory
from photon_bake.addon.settings.bake import settings_for

HEAD = ["Changed", "Photons", "Stored", "Triangles", "Receivers", "Seconds", "MB more"]
PHOTONS = (250_000, 1_000_000, 4_000_000, 16_000_000)
LEVELS = (3, 5, 7, 8)  # of simple subdivision


@dataclass(frozen=True)
class Bake:
    """What one bake took; memory in MB on top of what there was before it, None where unknown."""

    changed: str
    n_photons: int
    n_stored: int
    n_triangles: int
    n_receivers: int
    seconds: float
    memory: float | None

    @staticmethod
    def measure(changed, case, n_photons):
        start = perf_counter()
        settings = settings_for("medium", n_photons=n_photons)
        irradiance, memory = extra_memory(lambda: case.bake(settings))
        seconds, n_stored = perf_counter() - start, irradiance.counts["stored_photons"]
        return Bake(changed, n_photons, n_stored, case.scene.n_triangles, len(case.receivers), seconds, memory)

    @property
    def row(self):
        """Cells of `HEAD`."""
        numbers = (f"{n:,}" for n in (self.n_photons, self.n_stored, self.n_triangles, self.n_receivers))
        return [self.changed, *numbers, f"{self.seconds:.1f}", "" if self.memory is None else f"{self.memory:,.0f}"]


def measure(case):
    """Bakes of a case at medium quality with more and more photons, and with its triangles cut up more and more."""
    bakes = [Bake.measure("photons", case, n) for n in PHOTONS]
    modifiers = [_cut_up(obj) for obj in bpy.data.objects if obj.type == "MESH" and obj.visible_diffuse]
    for level in LEVELS:
        for modifier in modifiers:
            modifier.levels = modifier.render_levels = level
        bpy.context.view_layer.update()
        scene = rendered_scene()
        bakes.append(Bake.measure("triangles", replace(case, scene=scene), PHOTONS[1]))
    return bakes


def bytes_each(memories, numbers):
    """What one more of them takes, bytes, from the memory of the fewest and the most; None where unknown."""
    (few, least), *_, (many, most) = sorted(zip(numbers, memories, strict=True))
    return None if least is None or many == few else (most - least) * 1e6 / (many - few)


def _cut_up(obj):
    modifier = obj.modifiers.new("Cut", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    return modifier
