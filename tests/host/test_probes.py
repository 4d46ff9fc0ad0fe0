"""Probes by the command and the button: where they lie, their files, bad input."""

import json
import re
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
import pytest
from mathutils import Matrix, Vector
from photon_bake.addon.gather.rays.probe_light import SIDES
from photon_bake.addon.settings.probes import ProbeSettings
from photon_bake.operators.command_line.command import run
from photon_bake.tests.host.camera_scenes import build_room, coloured
from photon_bake.tests.host.cases.cycles import set_cycles
from photon_bake.tests.host.scenes import add_mesh, cycles_bake

QUICK = ["--quality", "draft", "--photons", "10000", "--probe-rays", "64"]


def add_volume(name, counts, matrix):
    data = bpy.data.lightprobes.new(name, "VOLUME")
    data.resolution_x, data.resolution_y, data.resolution_z = counts
    return add(name, data, matrix)


def add(name, data, matrix):
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = matrix
    bpy.context.scene.collection.objects.link(obj)
    return obj


def bake(folder, *more):
    return run(["--target", "probes", "--output", str(folder), *QUICK, *more])


def read(folder, scene="Scene"):
    return json.loads((folder / f"{scene}_probes.json").read_text())


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: np.array(c.pixels, np.float32) for name, c in file.channels().items()}


def test_volumes_of_the_scene_are_filled(empty_scene, tmp_path):
    """As many probes as EEVEE's, in its cells' middles; three files hold E/π of them as the JSON's harmonics say it."""
    build_room(empty_scene, (8, 8))
    matrix = Matrix.Translation((0.1, 0, 0.2)) @ Matrix.Rotation(0.3, 4, "Z") @ Matrix.Diagonal((0.8, 0.6, 0.5, 1))
    add_volume("Light/Volume", (3, 2, 2), matrix)
    assert bake(tmp_path, "--report", str(tmp_path / "r.json")) == 0
    files = [f"Scene_Light_Volume_probes_{color}.exr" for color in "RGB"]
    content, report = read(tmp_path), json.loads((tmp_path / "r.json").read_text())
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*files, "Scene_probes.json", "r.json"])
    assert report["counts"]["probes"] == 12 and report["relative_noise"] > 0
    (grid,) = content["grids"]
    assert grid["counts"] == [3, 2, 2] and list(grid["files"].values()) == files and content["light"] == "indirect"
    first = matrix @ Vector((-2 / 3, -0.5, -0.5))
    assert grid["position"][0] == pytest.approx(list(first), abs=1e-5)
    inside = np.array(grid["world_to_texture"]) @ [*grid["position"][-1], 1]
    assert inside[:3] == pytest.approx([5 / 6, 3 / 4, 3 / 4], abs=1e-5)
    sh = np.array(grid["radiance"])
    assert sh.shape == (12, 4, 3) and (sh[:, 0] > 0).all() and all(grid["valid"])
    for i, name in enumerate(files):
        texels = channels(tmp_path / name)
        assert sorted(texels) == ["A", "B", "G", "R"] and texels["R"].shape == (4, 3)
        assert texels["R"].ravel() == pytest.approx(sh[:, 0, i] * 0.282095, rel=2e-3)
        assert texels["A"].ravel() == pytest.approx(sh[:, 3, i] * 0.488603 * 2 / 3, rel=2e-3, abs=1e-4)


def test_axes_of_gltf(empty_scene, tmp_path):
    """What is up in Blender is y there: the same light on that side."""
    build_room(empty_scene, (8, 8))
    add_volume("Volume", (1, 1, 2), Matrix.Translation((0.2, 0.1, 0.1)) @ Matrix.Scale(0.5, 4))
    assert bake(tmp_path / "b", "--harmonics", "l2") == 0
    assert bake(tmp_path / "g", "--harmonics", "l2", "--axes", "gltf") == 0
    ours, theirs = read(tmp_path / "b")["grids"][0], read(tmp_path / "g")["grids"][0]
    x, y, z = ours["position"][1]
    assert theirs["position"][1] == pytest.approx([x, z, -y], abs=1e-5)
    e, f = np.array(ours["irradiance"][1]), np.array(theirs["irradiance"][1])
    assert f == pytest.approx(e[[0, 1, 4, 5, 3, 2]], rel=1e-5)
    c, d = np.array(ours["radiance"][1]), np.array(theirs["radiance"][1])
    assert d[:4] == pytest.approx(np.array([c[0], c[1], c[3], -c[2]]), rel=1e-4, abs=1e-5)
    assert d.shape == (9, 3) and d[7] == pytest.approx(-c[4], rel=1e-4, abs=1e-5)  # xz there is −xy here
    assert len(channels(tmp_path / "g" / "Scene_Volume_probes_R.exr")) == 9


def test_empties_of_a_collection(empty_scene, tmp_path):
    build_room(empty_scene, (8, 8))
    spots = bpy.data.collections.new("Spots")
    empty_scene.collection.children.link(spots)
    for name, place in (("Here", (0, 0, 0)), ("There", (0.5, 0, 0.2))):
        spots.objects.link(empty := bpy.data.objects.new(name, None))
        empty.location = place
    assert bake(tmp_path, "--probes-at", "Spots") == 0
    points = read(tmp_path)["points"]
    assert points["names"] == ["Here", "There"] and points["position"][1] == pytest.approx([0.5, 0, 0.2])
    assert len(list(tmp_path.iterdir())) == 1 and points["irradiance"][0][0][1] > 0


def test_bounds_are_filled_and_solids_take_their_neighbours_light(empty_scene, tmp_path):
    build_room(empty_scene, (8, 8))
    assert bake(tmp_path, "--probe-spacing", "0.3") == 0
    (grid,) = read(tmp_path)["grids"]
    assert grid["name"] == "Scene" and grid["counts"] == [7, 7, 7]
    position, valid, e = (np.array(grid[name]) for name in ("position", "valid", "irradiance"))
    box = bpy.data.objects["Box"]
    inside = (
        np.abs(position @ np.array(box.matrix_world.inverted())[:3, :3].T + box.matrix_world.inverted().translation) < 1
    ).all(axis=1)
    assert inside.sum() >= 4 and np.array_equal(valid, ~inside)
    lone = np.flatnonzero(inside)[0]
    near = (np.abs(position - position[lone]).max(axis=1) < 0.3) & valid
    assert e[lone].mean() == pytest.approx(e[near].mean(), rel=0.5) and e[lone].min() > 0


def test_button_and_what_stands_in_its_way(empty_scene, tmp_path):
    build_room(empty_scene, (8, 8))
    properties = empty_scene.photon_bake
    properties.targets, properties.probes.folder = {"probes"}, str(tmp_path)
    properties.quality, properties.n_photons, properties.probes.n_probe_rays = "draft", 10_000, 64
    assert properties.probes.settings() == ProbeSettings(n_probe_rays=64)
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert read(tmp_path)["grids"]
    properties.probes.place = "Nowhere"
    with pytest.raises(RuntimeError, match="no object or collection 'Nowhere'"):
        bpy.ops.photon_bake.bake_indirect()
    properties.probes.place, properties.gather = "", "density"
    with pytest.raises(RuntimeError, match="choose Final Gather"):
        bpy.ops.photon_bake.bake_indirect()


def test_command_says_what_is_missing(empty_scene, capsys):
    assert run(["--probe-spacing", "2"]) == 2
    assert "--probe-spacing is for probes" in capsys.readouterr().err
    assert run(["--target", "probes"]) == 2
    assert "give --output DIR" in capsys.readouterr().err


def test_with_vertices_in_one_solve(empty_scene, tmp_path):
    """Vertices get the light that they get alone, to within noise."""
    build_room(empty_scene, (8, 8))
    assert bake(tmp_path, "--target", "vertex", "--probe-spacing", "1") == 0
    light = np.array([one.color[:3] for one in bpy.data.objects["Floor"].data.attributes["Indirect"].data])
    assert light.mean() > 0.01 and read(tmp_path)["grids"]


def test_reader_of_the_docs(empty_scene, tmp_path):
    """The Python of docs/probes.md reads what was written: a probe's own light where it lies, and the mean between."""
    build_room(empty_scene, (8, 8))
    add_volume("Volume", (2, 2, 3), Matrix.Scale(0.6, 4))
    assert bake(tmp_path) == 0
    page = (Path(__file__).resolve().parents[2] / "docs" / "probes.md").read_text(encoding="utf-8")
    names = {"path": tmp_path / "Scene_probes.json"}
    exec(re.search(r"```python\n(.*?)```", page, re.DOTALL)[1], names)
    (grid,) = names["content"]["grids"]
    low, high = (names["irradiance"](grid, grid["position"][i], (0, 0, 1)) for i in (0, 4))
    between = names["irradiance"](grid, np.mean([grid["position"][i] for i in (0, 4)], axis=0), (0, 0, 1))
    assert between == pytest.approx((low + high) / 2, rel=1e-5)
    texel = [channels(tmp_path / grid["files"]["G"])[name][2, 0] for name in "RGBA"]  # x, y = 0 of the second slice
    assert np.pi * (texel[0] + texel[3]) == pytest.approx(high[1], rel=2e-3) and low[1] != pytest.approx(high[1])


def test_six_sides_as_cycles_bakes_them(empty_scene, tmp_path):
    """Six triangles of 2 mm around one place, which the camera alone sees, baked by Cycles: E/π of each side."""
    build_room(empty_scene, (8, 8))
    place, corners = np.array([0.3, -0.2, 0.1]), []
    for side in SIDES:
        u, v = np.roll(side, 1), np.cross(side, np.roll(side, 1))
        corners += [place + 1e-3 * (side + w) for w in (u, v, -u - v)]
    planes = add_mesh("Planes", corners, np.arange(18).reshape(6, 3), coloured("Plane", (1, 1, 1)))
    for ray in ("diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(planes, f"visible_{ray}", False)
    set_cycles(1)
    truth = cycles_bake(planes, "INDIRECT", 2048).reshape(6, 3, -1)[..., :3]
    stderr = truth.mean(axis=2).std(axis=1, ddof=1) / np.sqrt(3)
    planes.hide_render = True
    add("Here", None, Matrix.Translation(place))
    quality = ["--photons", "300000", "--probe-rays", "4096", "--probes-at", "Here"]
    assert run(["--target", "probes", "--output", str(tmp_path), *quality]) == 0
    points = read(tmp_path)["points"]
    ours = np.array(points["irradiance"][0]) / np.pi
    error = np.hypot(np.sqrt(np.mean(stderr**2)), np.array(points["irradiance_stderr"][0]) / np.pi)
    off = (ours - truth.mean(axis=1)).mean(axis=1)
    assert (np.abs(off) < 4 * error + 0.01 * ours.mean()).all()
