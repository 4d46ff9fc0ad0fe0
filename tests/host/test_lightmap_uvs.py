"""UV maps of lightmaps and their places in images."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.lightmap.checks import middles
from photon_bake.addon.blender.lightmap.reading import LightmapReading
from photon_bake.addon.blender.read.meshes.meshes import count_triangles
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.receivers import Charts
from photon_bake.addon.receivers.lightmap.coverage import texels_of
from photon_bake.addon.settings.lightmap import LightmapSettings
from scipy.ndimage import maximum_filter, minimum_filter

from .scenes import CUBE_FACES, add_cube, add_mesh, add_plane, in_graph


def overlapping(uv, size):
    """Which triangles (t, 3, 2) share the middle of a texel of the image (height, width) with others."""
    texel, triangle = middles(uv, size)
    return np.unique(triangle[np.bincount(texel, minlength=size[0] * size[1])[texel] > 1])


def laid_out(warnings=None, copies=False, density_of=None, **settings):
    """The layout of all objects, and their meshes in it."""
    chosen, warnings = LightmapSettings(**settings), [] if warnings is None else warnings

    def read(graph):
        return LightmapReading(graph, chosen, copies, density_of or {}, warnings).objects(None)

    found = in_graph(read)
    return found.layout, found.meshes


def densities(layout, meshes):
    """Texels a metre of each triangle."""
    found = []
    for mesh in meshes:
        flat = mesh.uv * layout.sizes[mesh.image][::-1]
        a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
        in_space = np.linalg.norm(np.cross(*np.moveaxis(mesh.positions[:, 1:] - mesh.positions[:, :1], 1, 0)), axis=1)
        found.append(np.sqrt(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / in_space))
    return np.concatenate(found)


def charts_on(layout, meshes, image=0):
    """The chart of each texel that one touches, (h, w); −1 where none does."""
    size = layout.sizes[image]
    charts = Charts.of([mesh for mesh in meshes if mesh.image == image])
    corners = charts.uv.astype(np.float64) * size[::-1]
    fragments = texels_of(corners, np.broadcast_to(size[::-1], (len(corners), 2)), Workers())
    found = np.full(size, -1)
    found[fragments.texel[:, 1], fragments.texel[:, 0]] = charts.chart[fragments.triangle]
    return found


@pytest.mark.parametrize("atlas", ["per_object", "shared"])
@pytest.mark.parametrize("padding", [0, 1])
def test_charts_have_the_density_and_stay_apart(empty_scene, atlas, padding):
    add_plane(size=3.0)
    add_cube().scale = (1.0, 0.5, 2.0)
    bpy.ops.mesh.primitive_monkey_add()
    layout, meshes = laid_out(atlas=atlas, density=20.0, padding=padding)
    assert len(layout.sizes) == (1 if atlas == "shared" else 3)
    assert all(side % 4 == 0 for size in layout.sizes for side in size)
    assert np.median(densities(layout, meshes)) == pytest.approx(20, rel=0.25)
    for image in range(len(layout.sizes)):
        on = charts_on(layout, meshes, image)
        around = 1 + 2 * (2 << padding)  # two rings of 2^padding texels
        low, high = minimum_filter(np.where(on < 0, 10**6, on), around), maximum_filter(on, around)
        assert (on >= 0).any() and not ((on >= 0) & ((low < on) | (high > on))).any()
        triangles = np.concatenate([mesh.uv for mesh in meshes if mesh.image == image])
        assert not len(overlapping(triangles, layout.sizes[image]))


@pytest.mark.parametrize("atlas", ["per_object", "shared"])
def test_a_size_is_filled(empty_scene, atlas):
    add_plane(size=3.0)
    add_cube()
    layout, meshes = laid_out(atlas=atlas, size=128)
    assert set(layout.sizes) == {(128, 128)}
    for image in range(len(layout.sizes)):
        assert (charts_on(layout, meshes, image) >= 0).mean() > 0.5


def test_objects_that_share_a_mesh_get_places_of_their_own(empty_scene):
    cube = add_cube()
    for i in range(3):
        twin = bpy.data.objects.new(f"Twin {i}", cube.data)
        twin.location.x = 3 * (i + 1)
        bpy.context.scene.collection.objects.link(twin)
    add_plane(size=3.0)
    layout, meshes = laid_out(atlas="shared", density=8.0)
    assert len(layout.sizes) == 1 and set(layout.made) == {"Cube", "Plane"}
    places = [place.scale_offset for place in layout.places if place.mesh_name == "Cube"]
    assert len(set(places)) == 4 and len({place[:2] for place in places}) <= 4
    assert not len(overlapping(np.concatenate([mesh.uv for mesh in meshes]), layout.sizes[0]))
    assert densities(layout, meshes).min() > 7


def test_an_atlas_becomes_several_where_it_is_too_large(empty_scene):
    for i in range(6):
        add_plane(f"Plane {i}", size=4.0).location.x = 5 * i
    warnings = []
    layout, meshes = laid_out(warnings, atlas="shared", density=16.0, max_size=140)
    assert len(layout.sizes) > 1 and max(max(size) for size in layout.sizes) <= 140 and not warnings
    assert layout.names[0] == "Atlas 1" and densities(layout, meshes).min() > 15


def test_what_is_too_large_for_an_image_gets_fewer_texels_and_is_named(empty_scene):
    add_plane("Ground", size=100.0)
    warnings = []
    layout, _ = laid_out(warnings, density=16.0, max_size=256)
    assert layout.sizes == ((256, 256),)
    assert len(warnings) == 1 and "'Ground'" in warnings[0] and "1,60" in warnings[0]


def test_an_image_that_cannot_hold_the_charts_says_which_could(empty_scene):
    faces = [(4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3) for i in range(100)]
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    corners = [(3 * (i % 10) + x, 3 * (i // 10) + y, 0) for i in range(100) for x, y in square]
    add_mesh("Tiles", corners, faces)
    with pytest.raises(BakeError, match=r"'Tiles' do not fit .* 32 × 32 .*: set Size to (\d+) or more") as error:
        laid_out(size=32)
    needed = int(str(error.value).split(" to ")[1].split(" or ")[0])
    layout, _ = laid_out(size=needed)
    assert layout.sizes == ((needed, needed),)


def test_faces_that_lie_behind_each_other_get_charts_of_their_own(empty_scene):
    """A spiral ramp, whose turns lie over each other as seen from above."""
    turns = np.linspace(0, 6 * np.pi, 60)
    ring = np.column_stack([np.cos(turns), np.sin(turns), 0.05 * turns])
    vertices = np.concatenate([ring, ring * (2, 2, 1)])
    add_mesh("Ramp", vertices, [(i, i + 1, 61 + i, 60 + i) for i in range(59)])
    layout, meshes = laid_out(density=32.0)
    assert not len(overlapping(meshes[0].uv, layout.sizes[0]))


def test_faces_stay_whole(empty_scene):
    """A face's corners are those of one chart, however many triangles it is cut into."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=32)
    _, meshes = laid_out(density=32.0)
    charts = Charts.of(meshes).chart
    assert (charts[:30] == charts[0]).all() or len(np.unique(charts)) < 8


def test_a_chosen_uv_map_lies_as_it_is(empty_scene):
    add_plane(size=3.0)
    layout, meshes = laid_out(uv_map="UVMap", density=10.0)
    assert layout.sizes == ((32, 32),) and not layout.made and layout.uv_map == "UVMap"
    assert np.array_equal(np.unique(meshes[0].uv), [0, 1])


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("SUBSURF", {"levels": 1}),
        ("BEVEL", {"width": 0.1}),
        ("TRIANGULATE", {}),
        ("EDGE_SPLIT", {"split_angle": 0.1}),
        ("DISPLACE", {"strength": 0.1}),
        ("DECIMATE", {"decimate_type": "DISSOLVE"}),
    ],
)
def test_a_made_uv_map_goes_through_modifiers(empty_scene, kind, settings):
    cube = add_cube()
    modifier = cube.modifiers.new("Modifier", kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    blocks = [len(blocks) for blocks in (bpy.data.meshes, bpy.data.objects, bpy.data.scenes)]
    _, (mesh,) = laid_out(density=8.0)
    assert [len(blocks) for blocks in (bpy.data.meshes, bpy.data.objects, bpy.data.scenes)] == blocks
    assert not len(cube.data.uv_layers)
    assert len(mesh.uv) == in_graph(lambda graph: count_triangles(cube.evaluated_get(graph).data))
    assert np.ptp(mesh.uv, axis=(0, 1)).min() > 0.4


def test_modifiers_that_copy_faces_are_named(empty_scene):
    cube = add_cube()
    cube.modifiers.new("Array", "ARRAY")
    with pytest.raises(BakeError, match=r"'Cube' has modifiers \('Array'\) that copy faces .* Bake Copies"):
        laid_out()


@pytest.mark.parametrize(
    ("uvs", "says"),
    [
        ([(0, 0), (1, 0), (1, 1), (0, 1)] * 6, "'Cube' lies over itself in 100% of its texels"),
        ([(0, 0), (2, 0), (2, 1), (0, 1)] * 6, "'Cube' leaves the square from 0 to 1 with 12 of its 12 triangles"),
        ([(0, 0)] * 24, "'Cube' has no area"),
    ],
    ids=["overlapping", "out of range", "without area"],
)
def test_a_chosen_uv_map_that_cannot_serve_is_named(empty_scene, uvs, says):
    cube = add_cube()
    cube.data.uv_layers.new(name="Mine").uv.foreach_set("vector", np.ravel(uvs).astype(np.float32))
    with pytest.raises(BakeError, match=says) as error:
        laid_out(uv_map="Mine")
    assert "have one made" in str(error.value) and "\n" not in str(error.value)


def test_objects_in_one_place_of_a_shared_image_are_named(empty_scene):
    add_plane("A")
    add_plane("B")
    warnings = []
    layout, _ = laid_out(warnings, uv_map="UVMap", atlas="shared")
    assert len(layout.places) == 1
    assert len(warnings) == 1 and warnings[0].startswith("Left out: Objects 'A' and 'B' lie in one place")


def test_a_chosen_uv_map_that_is_not_there_is_named(empty_scene):
    add_plane("Floor")
    add_cube("Box")
    warnings = []
    layout, _ = laid_out(warnings, uv_map="UVMap")
    assert [place.object_name for place in layout.places] == ["Floor"] and len(layout.sizes) == 1
    assert "'Box' has no UV map 'UVMap' (there are: none)" in warnings[0]
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    with pytest.raises(BakeError, match="'Box' has no UV map"):
        laid_out(uv_map="UVMap")


def test_no_room_for_another_uv_map(empty_scene):
    plane = add_plane("Floor")
    while len(plane.data.uv_layers) < 8:
        plane.data.uv_layers.new()
    with pytest.raises(BakeError, match="'Floor' has 8 UV maps"):
        laid_out()


def test_linked_meshes(tmp_path, empty_scene):
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {add_plane("Linked").data, add_mesh("Bare", CUBE_CORNERS, CUBE_FACES).data})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(path, link=True) as (source, target):
        target.meshes = source.meshes
    for mesh in target.meshes:
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(f"My {mesh.name}", mesh))
    with pytest.raises(BakeError, match=r"linked from another file.*make it local"):
        laid_out()
    bpy.data.objects.remove(bpy.data.objects["My Bare"])
    layout, _ = laid_out(uv_map="UVMap")
    assert [place.object_name for place in layout.places] == ["My Linked"]


CUBE_CORNERS = [(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]


def linked(name, data):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("ARRAY", {"count": 3}),
        ("MIRROR", {}),
        ("SOLIDIFY", {"thickness": 0.1}),
        ("WIREFRAME", {}),
        ("REMESH", {"octree_depth": 3}),
        ("SKIN", {}),
    ],
)
def test_copies_get_what_modifiers_copy(empty_scene, kind, settings):
    add_plane("Floor", size=3.0)
    cube = add_mesh("Cube", [(0, 0, 0), (0, 0, 2)], []) if kind == "SKIN" else add_cube()
    if kind == "SKIN":  # a mesh without faces
        cube.data.edges.add(1)
        cube.data.edges[0].vertices = (0, 1)
    modifier = cube.modifiers.new("Modifier", kind)
    for name, value in settings.items():
        setattr(modifier, name, value)
    warnings = []
    layout, _ = laid_out(warnings, density=8.0, atlas="shared")
    assert [place.object_name for place in layout.places] == ["Floor"]
    assert len(warnings) == 1 and "'Cube' has modifiers ('Modifier')" in warnings[0] and "Bake Copies" in warnings[0]
    warnings.clear()
    layout, meshes = laid_out(warnings, copies=True, density=8.0, atlas="shared")
    assert sorted(place.object_name for place in layout.places) == ["Cube", "Floor"] and not warnings
    cube_mesh = next(mesh for mesh in meshes if mesh.object_name == "Cube")
    assert len(cube_mesh.uv) == in_graph(lambda graph: count_triangles(cube.evaluated_get(graph).data))
    share = len(overlapping(np.concatenate([mesh.uv for mesh in meshes]), layout.sizes[0])) / len(cube_mesh.uv)
    assert share < 0.02


def test_copies_of_all_that_is_no_mesh(empty_scene):
    linked("Text", bpy.data.curves.new("Text", "FONT")).data.body = "Light"
    add_plane("Floor", size=3.0)
    group = bpy.data.collections.new("Group")
    group.objects.link(add_cube("Stone"))
    for i in range(2):
        instancer = linked(f"Instancer {i}", None)
        instancer.instance_type, instancer.instance_collection = "COLLECTION", group
        instancer.location.x = 3 + 3 * i
    warnings = []
    assert [place.object_name for place in laid_out(warnings)[0].places] == ["Floor", "Stone"]
    assert any("'Text'" in one for one in warnings) and any("'Instancer 0'" in one for one in warnings)
    layout, _ = laid_out(copies=True, atlas="shared")
    names = sorted(place.object_name for place in layout.places)
    assert names == ["Floor", "Instancer 0", "Instancer 1", "Stone", "Text"]


def test_objects_have_factors_of_density(empty_scene):
    add_plane("Floor", size=3.0)
    add_plane("Table", size=3.0)
    layout, meshes = laid_out(density=10.0, density_of={"Table": 2.0})
    assert densities(layout, meshes[:1]) == pytest.approx([10, 10], rel=0.02)
    assert densities(layout, meshes[1:]) == pytest.approx([20, 20], rel=0.02)


def test_charts_that_do_not_fit_leave_their_object_out(empty_scene):
    add_plane("Floor", size=3.0)
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    corners = [(3 * (i % 10) + x, 3 * (i // 10) + y, 0) for i in range(100) for x, y in square]
    add_mesh("Tiles", corners, [tuple(range(4 * i, 4 * i + 4)) for i in range(100)])
    for atlas in ("per_object", "shared"):
        warnings = []
        layout, _ = laid_out(warnings, size=32, atlas=atlas)
        assert [place.object_name for place in layout.places] == ["Floor"]
        assert len(warnings) == 1 and "The charts of 'Tiles' do not fit" in warnings[0]


def test_a_mesh_without_area_leaves_its_object_out(empty_scene):
    add_plane("Floor", size=3.0)
    add_mesh("Flat", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)])
    warnings = []
    layout, _ = laid_out(warnings)
    assert [place.object_name for place in layout.places] == ["Floor"] and "'Flat' have no area" in warnings[0]


def test_an_object_in_edit_mode_is_mapped(empty_scene):
    add_plane("Floor", size=3.0)
    cube = add_cube()
    cube.modifiers.new("Solidify", "SOLIDIFY")
    bpy.context.view_layer.objects.active = cube
    cube.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    warnings = []
    layout, meshes = laid_out(warnings, copies=True)
    assert sorted(place.object_name for place in layout.places) == ["Cube", "Floor"] and not warnings
    assert min(np.ptp(mesh.uv, axis=(0, 1)).min() for mesh in meshes) > 0.4
