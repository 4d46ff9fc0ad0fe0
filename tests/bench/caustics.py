"""Measures caustics: photons traced and scattered into pixels, their power, and a picture beside Cycles'.

    make bench ARGS="--only caustics [--pictures DIR]"

A ball of glass and a ring of gold stand on a plane under a small lamp, as in Figures 5 and 6 of McGuire and Luebke.
"""

import tempfile
from math import radians
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
from bounce_maps import attrition_table
from figures import camera_of_scene, rendered_scene, scene_options, scenes_in, table, write_png
from flicker import flicker_table
from light_volume import material, side_by_side
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.gather import splat_irradiance
from photon_bake.addon.photons import PathKind, trace_photons
from photon_bake.addon.receivers import diffuse_colors, seen_surface
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer

WIDTH, HEIGHT = 800, 540
N_STORED = (16_000, 100_000, 1_000_000)
N_REFERENCE, SEED_OF_REFERENCE = 6_000_000, 77
SAMPLES_WITHOUT = 32  # of Cycles' picture that our caustics are added to

HALF_NORMAL = np.sqrt(2 / np.pi)  # the mean size of an error over its standard deviation

HEAD = ["Stored photons", "Emitted", "Trace, s", "Growth", "Scatter, s", "Growth", "Power", "Error", "Said"]
PAPER = [  # Table 2, Caustic Ring: stored photons, CPU trace and GPU radiance estimate, ms, on hardware of 2009
    ["McGuire and Luebke, 512 × 384: 16,030", "324,900", "0.020", "", "0.010", "", "", "", ""],
    ["McGuire and Luebke, 1920 × 1080: 5,020", "101,124", "0.007", "", "0.014", "", "", "", ""],
]


def build():
    """A ball of glass and an open ring of gold on a white plane, under a small spherical lamp."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add, smooth = bpy.ops.mesh, bpy.ops.object.shade_smooth
    add.primitive_plane_add(size=12)
    bpy.context.object.data.materials.append(material("Diffuse", Color=(0.75, 0.75, 0.75, 1)))
    add.primitive_uv_sphere_add(segments=128, ring_count=64, radius=0.4, location=(-0.65, 0, 0.45))
    bpy.context.object.data.materials.append(material("Glass", Roughness=0, IOR=1.5))
    smooth()
    add.primitive_cylinder_add(vertices=256, radius=0.5, depth=0.2, end_fill_type="NOTHING", location=(0.65, 0, 0.1))
    bpy.context.object.data.materials.append(material("Anisotropic", Color=(0.9, 0.7, 0.3, 1), Roughness=0.0))
    bpy.context.object.modifiers.new("Thickness", "SOLIDIFY").thickness = 0.03
    smooth()
    bpy.ops.object.light_add(type="POINT", location=(2.4, 1.6, 2.0))
    bpy.context.object.data.shadow_soft_size, bpy.context.object.data.energy = 0.05, 300
    bpy.ops.object.camera_add(location=(-0.15, -2.3, 3.4), rotation=(radians(32), 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.context.object.data.lens = 40


class Bench:
    """The scene as the engine sees it, and what its camera sees."""

    def __init__(self, change=lambda: None):
        build()
        change()
        bpy.context.view_layer.update()
        self.scene = rendered_scene()
        self.camera = camera_of_scene(WIDTH, HEIGHT)
        self.tracer = TransparencyTracer(self.scene, EmbreeTracer(self.scene))
        self.seen = seen_surface(self.scene, self.tracer, self.camera)
        self.floor = self.seen.where(np.abs(self.seen.position[:, 2]) < 1e-4)
        self.sources = light_sources(self.scene, region_of(self.seen.position))

    def caustic(self, n_emitted, seed=0):
        """Photons of the caustics, and the seconds that they took."""
        start = perf_counter()
        photons = trace_photons(self.scene, self.tracer, self.sources, n_emitted, 32, Workers(seed))
        caustic = photons.where(photons.kind == PathKind.CAUSTIC)
        return caustic, perf_counter() - start

    def power_on_floor(self, photons):
        """Power (W, mean over colours) of photons that fall into the floor's pixels."""
        shown = np.zeros(self.camera.n_pixels + 1, bool)
        shown[self.floor.pixel] = True
        falls = shown[self.camera.pixels(photons.position)] & (np.abs(photons.position[:, 2]) < 1e-4)
        return float(photons.power[falls].mean(axis=1).sum(dtype=np.float64))

    def light(self, photons):
        """Irradiance of the floor's pixels and its error, and the seconds that it took."""
        start = perf_counter()
        irradiance, stderr = splat_irradiance(self.camera, self.floor, photons, Workers())
        return irradiance.mean(axis=1), stderr, perf_counter() - start


def growth_table(bench):
    """Time, power and mean absolute error by the number of stored photons, against very many of another seed."""
    reference, _ = bench.caustic(N_REFERENCE, SEED_OF_REFERENCE)
    truth, _, _ = bench.light(reference)
    power, mean = bench.power_on_floor(reference), np.average(truth, weights=bench.floor.area)
    rows, before = [], None
    for n in N_STORED:
        n_emitted = round(n * N_REFERENCE / len(reference))
        photons, trace = bench.caustic(n_emitted)
        light, stderr, scatter = bench.light(photons)
        shown = float((light * bench.floor.area).sum(dtype=np.float64))
        error, said = (
            np.average(one, weights=bench.floor.area) / mean for one in (np.abs(light - truth), HALF_NORMAL * stderr)
        )
        grown = (
            ["", ""]
            if before is None
            else [f"× {now / then:.1f}" for now, then in zip((trace, scatter), before, strict=True)]
        )
        before = trace, scatter
        cells = [f"{len(photons):,}", f"{n_emitted:,}", f"{trace:.2f}", grown[0], f"{scatter:.2f}", grown[1]]
        rows.append([*cells, f"{shown / power - 1:+.1%}", f"{error:.1%}", f"{said:.1%}"])
    return table(f"Caustics in {WIDTH} × {HEIGHT} pixels, against {len(reference):,} photons", HEAD, [*rows, *PAPER])


def picture(bench, to):
    """Write Cycles' picture with our caustics added, and what Cycles makes of its own in the same time."""
    start = perf_counter()
    photons, _ = bench.caustic(N_STORED[-1])
    irradiance, _ = splat_irradiance(bench.camera, bench.seen, photons, Workers())
    albedo, _ = diffuse_colors(bench.scene, bench.seen)
    added = np.zeros((bench.camera.n_pixels, 3), np.float32)
    added[bench.seen.pixel] = albedo * irradiance / np.pi
    ours = perf_counter() - start
    without, of_one = rendered(SAMPLES_WITHOUT, caustics=False)
    n_samples = max(1, round(SAMPLES_WITHOUT * (ours + of_one) / of_one))
    cycles, seconds = rendered(n_samples, caustics=True)
    print(f"Picture: {ours:.1f} s and {of_one:.1f} s of Cycles without caustics; {n_samples} samples, {seconds:.1f} s")
    pictures = without + added.reshape(without.shape), cycles
    write_png(to, side_by_side(*pictures))


def rendered(n_samples, caustics):
    """Cycles' picture (HEIGHT, WIDTH, 3), row 0 at the top, and its seconds."""
    scene = bpy.context.scene
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", n_samples, False, False
    cycles.caustics_reflective = cycles.caustics_refractive = caustics
    cycles.blur_glossy = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        start = perf_counter()
        bpy.ops.render.render(write_still=True)
        seconds = perf_counter() - start
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(WIDTH * HEIGHT * 4, np.float32)
        image.pixels.foreach_get(pixels)
    return pixels.reshape(HEIGHT, WIDTH, 4)[::-1, :, :3], seconds


def tables(scenes, options):
    """Markdown tables; and a picture in a folder, if one is given."""
    bench = Bench()
    texts = [growth_table(bench)]
    if options.pictures:
        picture(bench, options.pictures / "caustics_equal_time.png")
    texts.append(flicker_table(Bench))
    texts.append(attrition_table({"glass ball and ring": bench.scene}, scenes))
    return texts


def main():
    options = scene_options(__doc__).parse_args()
    tables(scenes_in(options.scenes), options)


if __name__ == "__main__":
    main()
