"""Refine: what of meshes survives, and how scripts and the command ask for it."""

import json

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.refinement import split_meshes
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.findings import grouped
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.pipeline.refinement import Refinement
from photon_bake.addon.ui.state import bake_state
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob

from .scenes import add_cube, add_lamp, add_material, add_mesh, add_plane


def last_warnings():
    return bake_state.outcome_of(bpy.context.scene.session_uid).warnings


def column(values, name, width):
    found = np.empty(len(values) * width, np.float32)
    values.foreach_get(name, found)
    return found.reshape(-1, width)


def split(obj, ends, cut, on_copy=False):
    name = obj.data.name
    refinement = Refinement({name: np.array(ends, np.int32)}, {name: np.array(cut, np.int32)}, 0.0, 0.0)
    return split_meshes({name: obj.data}, refinement, on_copy, Progress())[0]


@pytest.fixture
def laden(empty_scene):
    """Two quads and a pentagon beside them, with all that a mesh may hold; quad 0 is split in its middle."""
    vertices = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (4, 0, 0), (4, 2, 0), (3, 3, 0)]
    obj = add_mesh("Laden", vertices, [(0, 1, 2, 3), (1, 4, 5, 6, 2)], material=add_material("One")[0])
    mesh = obj.data
    mesh.materials.append(add_material("Two")[0])
    mesh.polygons[1].material_index = 1
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1, *np.linspace(2, 3, 10)])
    mesh.attributes.new("Heat", "FLOAT", "POINT").data.foreach_set("value", [0, 2, 4, 6, 8, 10, 12])
    edge = mesh.edges[mesh.edge_keys.index((1, 2))]
    edge.use_seam = edge.use_edge_sharp = True
    obj.vertex_groups.new(name="Group").add([0, 1], 1.0, "REPLACE")
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Up")
    key.data[0].co.z, key.data[2].co.z = 1.0, 3.0
    return obj


def test_what_meshes_hold_is_interpolated(laden):
    mesh = split(laden, [(0, 2), (1, 2)], [0])
    assert column(mesh.vertices, "co", 3)[7:].tolist() == [[1, 1, 0], [2, 1, 0]]
    assert column(mesh.attributes["Heat"].data, "value", 1)[7:, 0].tolist() == [2, 3]
    assert column(mesh.shape_keys.key_blocks["Up"].data, "co", 3)[7:].tolist() == [[1, 1, 2], [2, 1, 1.5]]
    weight = {vertex.index: [group.weight for group in vertex.groups] for vertex in mesh.vertices}
    assert weight[7] == [0.5] and weight[8] == [0.5] and not weight[3]
    uv = dict(zip(column(mesh.loops, "vertex_index", 1)[:, 0], column(mesh.uv_layers[0].uv, "vector", 2), strict=True))
    assert uv[7].tolist() == [0.5, 0.5]
    halves = [edge for edge in mesh.edges if 8 in edge.vertices[:]]
    assert sorted(edge.use_seam for edge in halves) == sorted(edge.use_edge_sharp for edge in halves)
    assert sum(edge.use_seam for edge in halves) == 2
    assert [len(face.vertices) for face in mesh.polygons if face.material_index == 1] == [6]
    assert {len(face.vertices) for face in mesh.polygons if face.material_index == 0} == {3}
    assert sum(face.area for face in mesh.polygons) == pytest.approx(4 + 5)


def test_vertices_keep_their_numbers(laden):
    before = column(laden.data.vertices, "co", 3)
    mesh = split(laden, [(0, 2), (7, 1)], [0])
    assert np.array_equal(column(mesh.vertices, "co", 3)[:7], before)


def test_custom_normals_are_kept(empty_scene):
    obj = add_plane("Bent")
    slanted = np.array([(-0.6, 0, 0.8), (0.6, 0, 0.8), (0.6, 0, 0.8), (-0.6, 0, 0.8)])
    obj.data.normals_split_custom_set(slanted)
    mesh = split(obj, [(0, 2), (0, 1)], [0])
    assert mesh.has_custom_normals and "photon_bake_normal" not in mesh.attributes
    normals, x = column(mesh.corner_normals, "vector", 3), column(mesh.vertices, "co", 3)[:, 0]
    vertex = column(mesh.loops, "vertex_index", 1)[:, 0].astype(int)
    assert normals[:, 0] == pytest.approx(0.6 * x[vertex], abs=0.02)
    assert len(mesh.polygons) == 5


def test_a_copy_takes_the_meshs_place_and_gives_it_back(empty_scene):
    first, second = add_plane("First"), bpy.data.objects.new("Second", bpy.data.objects["First"].data)
    bpy.context.scene.collection.objects.link(second)
    before = first.data
    mesh = split(first, [(0, 2)], [0], on_copy=True)
    assert first.data == second.data == mesh != before and len(before.vertices) == 4 and len(mesh.vertices) == 5
    assert bpy.ops.photon_bake.restore_meshes() == {"FINISHED"}
    assert first.data == second.data == before and list(bpy.data.meshes) == [before]
    assert not bpy.ops.photon_bake.restore_meshes.poll()


@pytest.fixture
def room(empty_scene):
    """A floor of one quad, a bright cube on it and a lamp."""
    add_plane("Floor", size=8.0)
    add_cube("Box", material=add_material("Red")[0]).location.z = 1.001
    add_lamp("POINT", location=(2.5, 0.5, 3), energy=1000)
    return bpy.context.scene.photon_bake


def refine(*names, **options):
    return bpy.ops.photon_bake.refine(objects=[{"name": name} for name in names], **options)


def test_the_floor_beside_a_cube_is_refined_in_one_undo_step(room):
    assert refine("Floor", budget=200) == {"FINISHED"}
    floor = bpy.data.objects["Floor"].data
    assert 40 < len(floor.vertices) <= 204 and len(bpy.data.objects["Box"].data.vertices) == 8
    assert np.mean(column(floor.vertices, "co", 3)[4:, 0] > 0.5) > 0.6  # in front of the cube's lit side
    assert "Refined 1 mesh by" in bake_state.result
    assert column(floor.uv_layers[0].uv, "vector", 2).min() >= 0


def test_without_names_all_meshes_are_refined_within_the_budget(room):
    assert refine(budget=60, on_copy=True) == {"FINISHED"}
    assert sum(len(bpy.data.objects[name].data.vertices) for name in ("Floor", "Box")) <= 60 + 4 + 8
    assert bpy.data.objects["Floor"].data.name == "Floor (Refined)" and len(bpy.data.meshes["Floor"].vertices) == 4


def test_modifiers_that_would_change_the_shape_are_named(room):
    bpy.data.objects["Box"].modifiers.new("Round", "SUBSURF")
    with pytest.raises(
        RuntimeError, match="'Box': new vertices would change the shape that its modifier 'Round' makes"
    ):
        refine("Box")
    assert refine(budget=20) == {"FINISHED"}
    assert any("Left out: Object 'Box'" in warning for warning in last_warnings())


def test_what_a_bake_finds_too_coarse_has_a_remedy(room):
    room.n_photons, room.n_cache_elements = 20_000, 2_000
    bpy.ops.photon_bake.bake_indirect()
    (found,) = [one for one in grouped(last_warnings()) if "refine" in one.remedies]
    assert found.names[0] == "Floor" and found.line.endswith("too few vertices")  # and the box's, which noise decides
    refine("Floor", budget=1500)
    bpy.ops.photon_bake.bake_indirect()
    assert not any("Floor" in one.names for one in grouped(last_warnings()) if "refine" in one.remedies)


COMMAND = ["--quality", "draft", "--photons", "5000", "--objects", "Floor"]


def test_the_command_refines_copies_and_saves_them(room, tmp_path, capfd):
    blend, report = tmp_path / "baked.blend", tmp_path / "report.json"
    options = ["--refine", "0.02", "--refine-budget", "50", "--save", str(blend), "--report", str(report)]
    assert run([*COMMAND, *options]) == 0
    counts = json.loads(report.read_text())["counts"]
    assert counts["refined_meshes"] == 1 and 20 < counts["added_vertices"] <= 50
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    floor = bpy.data.objects["Floor"].data
    assert floor.name == "Floor (Refined)" and "Indirect" in floor.attributes
    assert len(floor.vertices) == 4 + counts["added_vertices"] and len(bpy.data.meshes["Floor"].vertices) == 4
    assert run([*COMMAND, "--refine", "1", "--save"]) == 0  # again, on what is fine enough
    assert [mesh.name for mesh in bpy.data.meshes if mesh.users] == ["Box", "Floor", "Floor (Refined)"]


def test_the_command_leaves_meshes_where_the_bake_fails(room, monkeypatch):
    monkeypatch.setattr(BakeJob, "check_strict", lambda self: (_ for _ in ()).throw(BakeError("No.")))
    before = bpy.data.objects["Floor"].data
    monkeypatch.setattr(BakeJob, "solve", BakeJob.solve)
    assert run([*COMMAND, "--refine", "--refine-budget", "20"]) == 1
    assert bpy.data.objects["Floor"].data == before


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--refine", "--target", "lightmap", "--output", "x"], "--refine is for light on vertices"),
        (["--refine-budget", "50"], "give --refine too"),
        (["--refine", "--refine-budget", "0"], "choose a number from 1 to 10,000,000"),
        (["--refine", "-1"], "choose a number from 0.0001 to 1"),
    ],
)
def test_bad_usage_of_the_command_is_refused(room, options, said, capfd):
    assert run(options) == 2 and said in capfd.readouterr().err


def test_a_cancelled_refinement_changes_nothing(room, monkeypatch):
    from photon_bake.operators.targets import refine as refine_target

    def cancelled(meshes, light, options, seed, progress):
        progress.cancel()
        progress.update("Refining meshes", 0.5)

    monkeypatch.setattr(refine_target, "refine", cancelled)
    assert refine("Floor") == {"CANCELLED"}
    assert len(bpy.data.objects["Floor"].data.vertices) == 4 and not bake_state.running
