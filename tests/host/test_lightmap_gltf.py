"""glTF files with the lightmap's texture coordinates as TEXCOORD_1."""

import json
import struct

import bpy
import numpy as np
import pytest

from .lightmap_scenes import add_room, bake, uv_of


@pytest.fixture(autouse=True)
def room(empty_scene):
    add_room()


def read_glb(path):
    """A .glb file's JSON and its buffer."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[20 + length + 8 :]


def texcoords(gltf, buffer, node_name, which):
    """Texture coordinates of a node's mesh, (n, 2), as glTF has them: v counts from the top."""
    node = next(node for node in gltf["nodes"] if node["name"] == node_name)
    (primitive,) = gltf["meshes"][node["mesh"]]["primitives"]
    accessor = gltf["accessors"][primitive["attributes"][f"TEXCOORD_{which}"]]
    view = gltf["bufferViews"][accessor["bufferView"]]
    values = np.frombuffer(buffer, np.float32, accessor["count"] * 2, view["byteOffset"])
    return values.reshape(-1, 2)


@pytest.mark.parametrize("atlas", ["per_object", "shared"])
def test_texcoord_1_looks_the_lightmap_up(tmp_path, atlas):
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Box"].data)
    bpy.context.scene.collection.objects.link(twin)
    twin.location = (2.5, 2, 1)
    bake(tmp_path, atlas=atlas)
    meshes = {obj.name: obj.data for obj in bpy.data.objects if obj.type == "MESH"}
    before = {name: [layer.name for layer in mesh.uv_layers] for name, mesh in meshes.items()}
    path = tmp_path / "scene.glb"
    assert bpy.ops.photon_bake.export_gltf(filepath=str(path)) == {"FINISHED"}
    assert {name: [layer.name for layer in mesh.uv_layers] for name, mesh in meshes.items()} == before
    assert all(bpy.data.objects[name].data == mesh for name, mesh in meshes.items())
    gltf, buffer = read_glb(path)
    for name in ("Floor", "Box", "Twin"):
        obj = bpy.data.objects[name]
        sx, sy, ox, oy = obj["lightmap_scale_offset"]
        wanted = uv_of(obj) * (sx, sy) + (ox, oy)
        got = texcoords(gltf, buffer, name, 1) * (1, -1) + (0, 1)
        apart = np.linalg.norm(wanted[:, None] - got[None], axis=2)
        assert apart.min(axis=1).max() < 1e-5 and apart.min(axis=0).max() < 1e-5
        node = next(node for node in gltf["nodes"] if node["name"] == name)
        assert node["extras"]["lightmap_image"] == obj["lightmap_image"]
    assert texcoords(gltf, buffer, "Floor", 0).max() == pytest.approx(1)


def test_it_comes_back_by_importing(tmp_path):
    bake(tmp_path)
    wanted = uv_of(bpy.data.objects["Box"])
    path = tmp_path / "scene.glb"
    bpy.ops.photon_bake.export_gltf(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    box = bpy.data.objects["Box"]
    assert len(box.data.uv_layers) == 2
    got = uv_of(box, box.data.uv_layers[1].name)
    assert np.linalg.norm(wanted[:, None] - got[None], axis=2).min(axis=1).max() < 1e-5


def test_without_lightmaps_it_says_so(tmp_path):
    with pytest.raises(RuntimeError, match="bake lightmaps or vertices first"):
        bpy.ops.photon_bake.export_gltf(filepath=str(tmp_path / "scene.glb"))
    assert not (tmp_path / "scene.glb").exists()


def test_a_place_that_takes_no_files_is_said(tmp_path):
    bake(tmp_path)
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.photon_bake.export_gltf(filepath=str(tmp_path / "missing" / "scene.glb"))


def add_sun():
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = 3.0
    bpy.context.scene.collection.objects.link(sun)


def accessor(gltf, buffer, index):
    """Values of an accessor of floats."""
    found = gltf["accessors"][index]
    n = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[found["type"]]
    offset = gltf["bufferViews"][found["bufferView"]]["byteOffset"]
    return np.frombuffer(buffer, np.float32, found["count"] * n, offset).reshape(-1, n)


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
def test_light_on_vertices_is_a_custom_attribute(tmp_path, domain):
    """Not COLOR_0, which engines multiply base colors by; another color of the mesh's stays out of it too."""
    mesh = bpy.data.objects["Floor"].data
    mesh.color_attributes.new("Indirect.Key", "FLOAT_COLOR", domain)
    light = mesh.color_attributes.new("Indirect", "FLOAT_COLOR", domain)
    values = np.random.default_rng(1).uniform(0, 3, (len(light.data), 4)).astype(np.float32)
    light.data.foreach_set("color", values.ravel())
    mesh.color_attributes.active_color = light
    path = tmp_path / "scene.glb"
    assert bpy.ops.photon_bake.export_gltf(filepath=str(path)) == {"FINISHED"}
    gltf, buffer = read_glb(path)
    (found,) = [one for one in gltf["meshes"] if "extras" in one]
    assert found["extras"] == {"light_attribute": "_INDIRECT"}
    attributes = found["primitives"][0]["attributes"]
    assert not any(name.startswith("COLOR") for name in attributes)
    exported = accessor(gltf, buffer, attributes["_INDIRECT"])
    apart = np.abs(exported[:, None] - values[None, :, :3]).max(axis=2)
    assert apart.min(axis=0).max() < 1e-6 and apart.min(axis=1).max() < 1e-6
    assert "_INDIRECT_KEY" in attributes
    assert [one.name for one in mesh.color_attributes] == ["Indirect.Key", "Indirect"] and "light_attribute" not in mesh


def test_images_lie_beside_the_file_and_lamps_have_the_lights_units(tmp_path):
    bake(tmp_path / "maps")
    add_sun()
    (tmp_path / "web").mkdir()
    path = tmp_path / "web" / "scene.gltf"
    assert bpy.ops.photon_bake.export_gltf(filepath=str(path), cameras=True) == {"FINISHED"}
    image = bpy.data.objects["Box"]["lightmap_image"]
    assert (path.parent / image).read_bytes() == (tmp_path / "maps" / image).read_bytes()
    lights = json.loads(path.read_text())["extensions"]["KHR_lights_punctual"]["lights"]
    intensity = {one["type"]: one["intensity"] for one in lights}
    assert intensity["directional"] == pytest.approx(3.0)  # W/m²
    assert intensity["point"] == pytest.approx(1000 / (4 * np.pi))  # W/sr
    assert bpy.ops.photon_bake.export_gltf(filepath=str(path), lights=False) == {"FINISHED"}
    assert "extensions" not in json.loads(path.read_text())


def test_a_lightmap_that_is_gone_is_said(tmp_path):
    bake(tmp_path / "maps")
    (tmp_path / "maps" / bpy.data.objects["Box"]["lightmap_image"]).unlink()
    path = tmp_path / "scene.glb"
    assert bpy.ops.photon_bake.export_gltf(filepath=str(path)) == {"FINISHED"}
    assert path.is_file() and not (tmp_path / bpy.data.objects["Box"]["lightmap_image"]).exists()
