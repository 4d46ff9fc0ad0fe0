"""Measures how charts are made and packed: texel use and seconds of each way, on the objects of the scenes.

    python tests/bench/lightmap_uvs.py [--scenes DIR] [--density N]

Use is the share of texels that charts touch, over all images of a scene, one an object.
"""

from time import perf_counter

import bpy
import numpy as np
import xatlas
from figures import scene_options, scenes_in, table
from photon_bake.addon.blender import bake_objects
from photon_bake.addon.blender.lightmap import packing
from photon_bake.addon.blender.lightmap.charts import Faces, chart_of_triangles, laid_flat
from photon_bake.addon.blender.lightmap.meshes import check_lightmap_object
from photon_bake.addon.blender.lightmap.packing import Packed, Piece
from photon_bake.addon.blender.temporary import Temporary
from photon_bake.addon.parallel import Workers
from photon_bake.addon.receivers.coverage import texels_of

HEAD = ["Scene", "Texels a metre", "Charts by", "Packed by", "Objects", "Charts", "Texels", "Use", "Seconds"]
SKIP = {"cornell": (), "oa_bases3": ("skies",), "classroom": ("Mesh035",)}
"""Skies and the ground outside, each larger than all the rest."""


def smart(faces, density, pack):
    """Blender's Smart UV Project, packed by a function of `packing`."""
    uv = laid_flat(faces, 66)
    piece = Piece.of(uv, faces.triangles, chart_of_triangles(faces, uv))
    return pack([piece], density, 1, 0, True), len(np.unique(piece.chart))


def of_xatlas(faces, density):
    """Charts of xatlas, which cuts faces into triangles."""
    atlas, options = xatlas.Atlas(), xatlas.PackOptions()
    atlas.add_mesh(faces.positions, faces.corner_vertex[faces.triangles].astype(np.uint32))
    options.padding, options.bilinear, options.blockAlign, options.texels_per_unit = 1, True, True, density
    options.bruteForce = False
    atlas.generate(pack_options=options)
    _, indices, uv = atlas.get_mesh(0)
    of_corner = np.zeros((faces.triangles.max() + 1, 2), np.float32)
    of_corner[faces.triangles.reshape(-1)] = uv[indices.reshape(-1)]
    return Packed(atlas.width, atlas.height, [of_corner], density), atlas.chart_count


def lightmap_pack(faces, density):
    """Blender's Lightmap Pack: each face by itself; its margin is in parts of the image, so the side is guessed."""
    side = packing.whole_blocks(density * (faces.area / 0.6) ** 0.5)
    with Temporary() as temporary:
        mesh = temporary.add(bpy.data.meshes.new("Bench"))
        mesh.from_pydata(faces.positions, [], np.split(faces.corner_vertex, np.cumsum(faces.n_corners)[:-1]))
        mesh.uv_layers.new(name="Bench")
        obj = temporary.add(bpy.data.objects.new("Bench", mesh))
        with bpy.context.temp_override(object=obj, active_object=obj, selected_objects=[obj]):
            bpy.ops.uv.lightmap_pack(PREF_CONTEXT="ALL_FACES", PREF_MARGIN_DIV=0.1)
        uv = np.empty((len(mesh.loops), 2), np.float32)
        mesh.uv_layers[0].uv.foreach_get("vector", uv.reshape(-1))
    return Packed(side, side, [uv], density), len(faces.n_corners)


WAYS = {
    ("Smart UV Project", "xatlas"): lambda faces, density: smart(faces, density, packing._by_xatlas),
    ("Smart UV Project", "Pack Islands"): lambda faces, density: smart(faces, density, packing._by_blender),
    ("xatlas", "xatlas"): of_xatlas,
    ("Lightmap Pack", "Lightmap Pack"): lightmap_pack,
}


def used_texels(packed, faces):
    """How many texels charts touch."""
    size = np.array([packed.width, packed.height])
    corners = np.clip(packed.uv[0][faces.triangles], 0, 1).astype(np.float64) * size
    texel = texels_of(corners, np.broadcast_to(size, (len(corners), 2)), Workers()).texel
    return len(np.unique(texel[:, 1].astype(np.int64) * packed.width + texel[:, 0]))


def row(scene, all_faces, way, make, density):
    charts = texels = used = 0
    seconds = 0.0
    try:
        for faces in all_faces:
            start = perf_counter()
            packed, n = make(faces, density)
            seconds += perf_counter() - start
            charts, texels, used = charts + n, texels + packed.width * packed.height, used + used_texels(packed, faces)
    except RuntimeError as error:
        return [scene, f"{density:g}", *way, str(len(all_faces)), str(error).strip(), "", "", ""]
    figures = [f"{len(all_faces)}", f"{charts:,}", f"{texels:,}", f"{used / texels:.0%}", f"{seconds:.2f}"]
    return [scene, f"{density:g}", *way, *figures]


def tables(scenes, densities=(8.0, 32.0)):
    rows = []
    for name, path in scenes.items():
        bpy.ops.wm.open_mainfile(filepath=str(path))
        graph = bpy.context.evaluated_depsgraph_get()
        objects = [o for o in bake_objects(graph, None, [], check_lightmap_object) if not left_out(name, o)]
        matrices = [np.array(o.matrix_world, np.float64)[:3, :3] for o in objects]
        faces = [Faces.of(o.data, matrix) for o, matrix in zip(objects, matrices, strict=True)]
        rows += [row(name, faces, way, make, density) for density in densities for way, make in WAYS.items()]
    return [table("UV maps: charts and their packing", HEAD, rows)]


def left_out(scene, obj):
    return obj.name == "Probes" or obj.name.startswith(tuple(SKIP.get(scene, ())))


if __name__ == "__main__":
    parser = scene_options(__doc__)
    parser.add_argument("--density", type=float, nargs="+", default=(8.0, 32.0))
    given = parser.parse_args()
    tables(scenes_in(given.scenes), given.density)
