"""Measures tracing through cube maps: photon rays against Embree's, what they cost, and what the maps see.

    python tests/bench/multi_image.py [--scenes DIR] [--pictures DIR]

The rays are a random 100,000 of those that 100,000 photons ask for, all bounces mixed. A hit counts as right within a
share of a diagonal of Embree's hit; where only one of the two hits anything the ray counts as wrong. Times are those of
one thread.
"""

from dataclasses import dataclass
from time import perf_counter

import numpy as np
from figures import RecordingTracer, camera_of_scene, load, scene_options, scenes_in, table, write_png
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.photons import emitted_rays, trace_photons
from photon_bake.addon.pipeline.outputs import N_LIGHT_RAYS
from photon_bake.addon.scene import Scene
from photon_bake.addon.scene.surface_points import surface_points
from photon_bake.addon.tracing import Hits, TransparencyTracer
from photon_bake.addon.tracing.cube_maps import LightRays, MultiImageTracer, Statistics, lit_region
from photon_bake.addon.tracing.cube_maps.box import through_box
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.cube_map_methods.fan import Fan
from photon_bake.tests.cube_map_methods.plane import Plane

N_RAYS = N_PHOTONS = 100_000
N_PHOTONS_OF_ROOM = 3_000_000  # of which few come in through the windows
ALONE = Workers(n_threads=1)
METHODS = {"plane": Plane, "fan": Fan, "crossing": None}
PLACES = ("regular", "placed by surfaces", "placed by light")
RIGHT = (0.01, 0.02, 0.05)
PICTURED = ("cornell", "classroom")

METHODS_HEAD = ["Rays", "Method", "Maps", *(f"{r:.0%} of scene" for r in RIGHT), *(f"{r:.0%} of region" for r in RIGHT)]
METHODS_HEAD += ["Look-ups a ray", "µs a ray"]
NUMBERS_HEAD = ["Rays", "Maps", "Faces", "2% of scene", "2% of region", "Look-ups a ray", "µs a ray", "Build, s", "MB"]
LOOPS_HEAD = ["Rays", "Method", *(str(n) for n in range(9))]
SEEN_HEAD = ["Region", "Maps", *PLACES]


@dataclass(frozen=True)
class Case:
    """Photon rays of a scene with Embree's hits, the region of the receivers, and rays that leave the lamps."""

    name: str
    scene: Scene
    region: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    hits: Hits
    light: LightRays

    def tracer(self, method="crossing", places="placed by light", n_maps=27, size=64):
        return MultiImageTracer.build(
            self.scene,
            EmbreeTracer(self.scene),
            self.region,
            n_maps,
            size,
            placement="regular" if places == "regular" else "placed",
            method=METHODS[method],
            workers=ALONE,
            light=self.light if places == "placed by light" else None,
        )


def photon_rays(name, scene, receivers, n_photons=N_PHOTONS, only_through=None):
    """A case: the rays of photons that are aimed at receivers; only those that get into a box, if one is given."""
    sources, recorder = light_sources(scene, region_of(receivers.position)), RecordingTracer(scene)
    tracer = TransparencyTracer(scene, recorder)
    recorder.asked.clear()
    trace_photons(scene, tracer, sources, n_photons, 32, ALONE)
    origins, directions = (np.concatenate(rays) for rays in zip(*recorder.asked, strict=True))
    hits = EmbreeTracer(scene).closest_hit(origins, directions)
    if only_through is not None:
        enter, leave = through_box(only_through, origins, directions)
        gets_in = (enter < leave) & (enter < hits.distance)
        origins, directions, hits = origins[gets_in], directions[gets_in], hits.where(gets_in)
    k = np.sort(stream(0).permutation(len(origins))[:N_RAYS])
    return Case(name, scene, lit_region(receivers.position), origins[k], directions[k], hits.where(k), light(sources))


def light(sources):
    """Rays that leave the lamps, as a bake takes them to place maps."""
    rays = emitted_rays(sources, N_LIGHT_RAYS, ALONE.seed)
    return LightRays(*(np.concatenate([getattr(part, name) for part in rays]) for name in ("origins", "directions")))


def errors(case, hits):
    """How far hits are from Embree's, m; infinite where only one of the two is a hit."""
    both = hits.hit & case.hits.hit
    apart = np.where(both, hits.distance, 0) - np.where(both, case.hits.distance, 0)
    return np.where(both | (hits.hit == case.hits.hit), np.abs(apart), np.inf)


def right(case, hits, shares_of_diagonal=RIGHT):
    """Cells: share of rays within shares of the scene's diagonal, then of the region's."""
    off = errors(case, hits)
    diagonals = case.scene.diagonal, float(np.linalg.norm(case.region[1] - case.region[0]))
    return [f"{np.mean(off <= share * diagonal):.1%}" for diagonal in diagonals for share in shares_of_diagonal]


def trace(case, tracer):
    """Hits, look-ups a ray, microseconds a ray, and rays by loops."""
    tracer.statistics = Statistics()
    start = perf_counter()
    hits = tracer.closest_hit(case.origins, case.directions)
    seconds = perf_counter() - start
    n = len(case.origins)
    return hits, tracer.statistics.n_look_ups / n, seconds / n * 1e6, tracer.statistics.n_rays_of_loops


def method_rows(case):
    """Rows of `METHODS_HEAD`: each method with each way to place maps."""
    rows = []
    for method in METHODS:
        for places in PLACES:
            hits, look_ups, time, _ = trace(case, case.tracer(method, places))
            rows.append([case.name, method, places, *right(case, hits), f"{look_ups:.1f}", f"{time:.1f}"])
    return rows


def number_rows(case, sets=((8, 64), (27, 64), (64, 64), (125, 64), (27, 128), (27, 256))):
    """Rows of `NUMBERS_HEAD`: the first crossing in sets of maps of different number and size."""
    rows = []
    for n_maps, size in sets:
        start = perf_counter()
        tracer = case.tracer(n_maps=n_maps, size=size)
        build = perf_counter() - start
        hits, look_ups, time, _ = trace(case, tracer)
        cells = [*right(case, hits, (0.02,)), f"{look_ups:.1f}", f"{time:.1f}", f"{build:.2f}"]
        rows.append([case.name, str(n_maps), f"{size}²", *cells, f"{tracer.n_bytes / 1e6:.1f}"])
    return rows


def loop_rows(case):
    """Rows of `LOOPS_HEAD`: share of the rays that took each number of loops (fan) or walks (crossing)."""
    rows = []
    for method in ("fan", "crossing"):
        loops = trace(case, case.tracer(method))[3]
        rows.append([case.name, method, *(f"{share:.1%}" for share in loops / loops.sum())])
        rows[-1] += [""] * (len(LOOPS_HEAD) - len(rows[-1]))
    return rows


def seen_rows(case, numbers=(8, 27, 125)):
    """Rows of `SEEN_HEAD`: share of the surfaces in the region, by area, of which maps see a side."""
    spacing = float(np.linalg.norm(case.region[1] - case.region[0])) / 100
    parts = list(surface_points(case.scene, case.region, spacing))
    x, triangle = (np.concatenate([getattr(part, name) for part in parts]) for name in ("position", "triangle"))
    k = stream(2).permutation(len(x))[:4000]
    x, triangle = x[k].astype(np.float32), triangle[k]
    normal = case.scene.normals[triangle]
    gap, embree = case.scene.ray_offset(triangle, x) * normal, EmbreeTracer(case.scene)

    def share(centres):
        seen = np.zeros(len(x), bool)
        for centre in np.repeat(centres[:, None], len(x), axis=1):
            facing = np.copysign(1, np.einsum("ij,ij->i", centre - x, normal))[:, None].astype(np.float32)
            seen |= ~embree.occluded(centre, x + facing * gap)
        return f"{seen.mean():.1%}"

    return [
        [case.name, str(n), *(share(case.tracer(places=places, n_maps=n).maps.centres) for places in PLACES)]
        for n in numbers
    ]


def photon_picture(case, camera, path):
    """Write where photons are, as a camera sees them: above Embree and crossing, below plane and fan."""
    tracers = [EmbreeTracer(case.scene), *(case.tracer(method) for method in ("crossing", "plane", "fan"))]
    panels = [seen_photons(case, tracer.closest_hit(case.origins, case.directions), camera) for tracer in tracers]
    brightest = np.percentile(panels[0][panels[0] > 0], 95)
    a, b, c, d = (np.pad(np.sqrt(np.minimum(panel / brightest, 1)), 1, constant_values=1) for panel in panels)
    write_png(path, np.block([[a, b], [c, d]]).repeat(2, axis=0).repeat(2, axis=1))


def seen_photons(case, hits, camera):
    """Photons that the camera sees in each pixel, (height, width)."""
    x = (case.origins + hits.distance[:, None] * case.directions)[hits.hit]
    eye = np.repeat(camera.position[None], len(x), axis=0)
    x += np.float32(2e-3) * (eye - x)  # surfaces that photons lie on, or a little under, do not hide them
    pixel = camera.pixels(x[~EmbreeTracer(case.scene).occluded(eye, x)])
    counts = np.bincount(pixel[pixel >= 0], minlength=camera.n_pixels)
    return counts.reshape(camera.height, camera.width)


def cases(path):
    """The rays of all photons of a scene, and where it has a room in the open (classroom) those that get into it."""
    scene, receivers, probes = load(path)
    found = [photon_rays(path.stem, scene, receivers)]
    if path.stem == "classroom":
        room = lit_region(probes.position)
        found.append(photon_rays("classroom, the room", scene, probes, N_PHOTONS_OF_ROOM, only_through=room))
    return found


TABLES = (
    ("Photon rays through 27 cube maps against Embree", METHODS_HEAD, method_rows),
    ("The first crossing in more maps, and larger ones", NUMBERS_HEAD, number_rows),
    ("Loops to convergence", LOOPS_HEAD, loop_rows),
    ("Surfaces that maps see", SEEN_HEAD, seen_rows),
)


def tables(scenes, options):
    """Markdown tables; and pictures of the photons in a folder, if one is given."""
    found = []
    for name, path in scenes.items():
        found += cases(path)
        if options.pictures and name in PICTURED:
            photon_picture(found[-1], camera_of_scene(320, 240), options.pictures / f"photons_{name}.png")
    return [table(title, head, [row for case in found for row in rows(case)]) for title, head, rows in TABLES]


def main():
    options = scene_options(__doc__).parse_args()
    tables(scenes_in(options.scenes), options)


if __name__ == "__main__":
    main()
