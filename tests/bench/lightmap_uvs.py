"""Measures how UV maps are made and packed: texel use and seconds, against xatlas' own tool on the same meshes.

    python tests/bench/lightmap_uvs.py [--scenes DIR] [--density N]

The objects of the scenes, and a made scene of 1,000 objects with a million triangles (wavy balls of four sizes). Use is
the share of texels that the surfaces would have at the density that was asked for. xatlas has cut the faces into
triangles, and puts borders of charts through faces, which a UV map cannot say; and it holds Python's lock meanwhile.
*Longest* is the longest time without a look at whether the bake was cancelled. Seconds are the processor's.
"""

from time import perf_counter, process_time

import bpy
import numpy as np
import xatlas
from figures import scene_options, scenes_in, table
from photon_bake.addon.blender import bake_objects
from photon_bake.addon.blender.lightmap.charts import faces_of
from photon_bake.addon.blender.lightmap.meshes import check_lightmap_object
from photon_bake.addon.receivers.uv_maps import Faces, pack, unwrapped

HEAD = ["Scene", "Texels a metre", "Images", "By", "Objects", "Triangles", "Charts", "Texels", "Use"]
HEAD += ["Unwrap, s", "Pack, s", "Longest, s"]
SKIP = {"cornell": (), "oa_bases3": ("skies",), "classroom": ("Mesh035",)}
"""Skies and the ground outside, each larger than all the rest."""

N_OBJECTS, N_ALONG = 1000, 22  # wavy balls; squares around each
SIZES = (0.25, 0.5, 1.0, 2.0)  # m


class Gaps:
    """The longest time between two looks at the progress."""

    def __init__(self):
        self.longest, self._last = 0.0, perf_counter()

    def check(self):
        now = perf_counter()
        self.longest, self._last = max(self.longest, now - self._last), now


def ours(groups, density):
    gaps, start = Gaps(), process_time()
    pieces = [[unwrapped(faces, gaps.check) for faces in group] for group in groups]
    between = process_time()
    images = [pack(of_image, density, 1, check=gaps.check) for of_image in pieces]
    gaps.check()
    end = process_time()
    charts = sum(len(np.unique(piece.chart)) for of_image in pieces for piece in of_image)
    texels = sum(image.width * image.height for image in images)
    return charts, texels, between - start, end - between, gaps.longest


def of_xatlas(groups, density):
    """Its charts and its packing in one call each; the times of the two are not told apart."""
    gaps, start, charts, texels = Gaps(), process_time(), 0, 0
    for group in groups:
        atlas, options = xatlas.Atlas(), xatlas.PackOptions()
        for faces in group:
            atlas.add_mesh(faces.positions, faces.corner_vertex[faces.triangles].astype(np.uint32))
        options.padding, options.bilinear, options.blockAlign = 1, True, True
        options.texels_per_unit, options.bruteForce = density, False
        gaps.check()
        atlas.generate(pack_options=options)
        gaps.check()
        charts, texels = charts + atlas.chart_count, texels + atlas.width * atlas.height
    return charts, texels, process_time() - start, 0.0, gaps.longest


def balls():
    """The made scene's faces."""
    n = N_ALONG
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, n + 1), np.linspace(0, np.pi, n + 1))
    number = np.arange((n + 1) ** 2, dtype=np.int32).reshape(n + 1, n + 1)
    squares = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=2).reshape(-1, 4)
    start = np.arange(len(squares), dtype=np.int32)[:, None] * 4
    triangles = np.concatenate([start + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    for k in range(N_OBJECTS):
        radius = SIZES[k % len(SIZES)] / 2 * (1 + 0.15 * np.sin(3 * turn + k) * np.sin(rise) ** 3)
        place = radius[..., None] * np.stack(
            [np.cos(turn) * np.sin(rise), np.sin(turn) * np.sin(rise), np.cos(rise)], axis=2
        )
        place[:, -1] = place[:, 0]
        yield Faces(
            place.reshape(-1, 3).astype(np.float32),
            squares.reshape(-1),
            np.full(len(squares), 4, np.int32),
            triangles.astype(np.int32),
        )


def rows_of(scene, all_faces, densities):
    rows, area = [], sum(faces.area for faces in all_faces)
    n_triangles = sum(len(faces.triangles) for faces in all_faces)
    for density in densities:
        for images, groups in (("one each", [[faces] for faces in all_faces]), ("one", [all_faces])):
            for name, way in (("Photon Bake", ours), ("xatlas", of_xatlas)):
                charts, texels, unwrap, packing, longest = way(groups, density)
                figures = [f"{len(all_faces):,}", f"{n_triangles:,}", f"{charts:,}", f"{texels:,}"]
                figures += [f"{area * density**2 / texels:.0%}", f"{unwrap:.2f}", f"{packing:.2f}", f"{longest:.2f}"]
                rows.append([scene, f"{density:g}", images, name, *figures])
    return rows


def tables(scenes, densities=(8.0, 32.0)):
    rows = []
    for name, path in scenes.items():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        graph = bpy.context.evaluated_depsgraph_get()
        objects = [o for o in bake_objects(graph, None, [], check_lightmap_object) if not left_out(name, o)]
        matrices = [np.array(o.matrix_world, np.float64)[:3, :3] for o in objects]
        faces = [faces_of(o.data, matrix) for o, matrix in zip(objects, matrices, strict=True)]
        rows += rows_of(name, [one for one in faces if one.area > 0], densities)
    rows += rows_of("1,000 balls", list(balls()), densities[:1])
    return [table("UV maps: charts and their packing", HEAD, rows)]


def left_out(scene, obj):
    return obj.name == "Probes" or obj.name.startswith(tuple(SKIP.get(scene, ())))


if __name__ == "__main__":
    parser = scene_options(__doc__)
    parser.add_argument("--density", type=float, nargs="+", default=(8.0, 32.0))
    given = parser.parse_args()
    tables(scenes_in(given.scenes), given.density)
