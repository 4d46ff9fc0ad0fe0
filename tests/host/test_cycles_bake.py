"""Materials that only Cycles can evaluate, baked by it."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.lightmap.atlas import make_atlas
from photon_bake.addon.blender.read.materials import cycles_bake
from photon_bake.addon.blender.read.materials.material_reader import DEFAULT_GREY
from photon_bake.addon.blender.temporary import CyclesError
from photon_bake.tests.host import scenes

pytestmark = pytest.mark.usefixtures("empty_cache")


def procedural(kind, socket="Base Color", output=0, name="Procedural"):
    """A material with a procedural texture on a socket; returns it, the texture and the shader."""
    material, surface = scenes.add_material(name)
    texture = material.node_tree.nodes.new(kind)
    material.node_tree.links.new(texture.outputs[output], surface.inputs[socket])
    return material, texture, surface


def tiles(material, n=8):
    """A plane of n × n quads with a UV map, 2 m wide."""
    at = np.linspace(-1, 1, n + 1)
    vertices = [(x, y, 0.1 * x * y) for y in at for x in at]
    faces = [(i, i + 1, i + n + 2, i + n + 1) for row in range(n) for i in range(row * (n + 1), row * (n + 1) + n)]
    obj = scenes.add_mesh("Tiles", vertices, faces, material)
    uv = np.array([vertices[v][:2] for face in faces for v in face]) / 2 + 0.5
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.ravel())
    return obj


def near_corners(scene, inset=1e-3):
    """Albedo near the corners of every quad's first triangle, (quads, 3, 3)."""
    triangle = np.repeat(np.arange(0, scene.n_triangles, 2), 3)
    u, v = (
        np.tile(one, scene.n_triangles // 2) for one in ((inset, 1 - 2 * inset, inset), (inset, inset, 1 - 2 * inset))
    )
    return scene.albedo(triangle, u.astype(np.float32), v.astype(np.float32)).reshape(-1, 3, 3)


def data_blocks():
    kinds = ("meshes", "materials", "objects", "scenes", "images", "node_groups", "worlds", "collections", "shape_keys")
    return {kind: sorted(one.name_full for one in getattr(bpy.data, kind)) for kind in kinds}


def count_bakes(monkeypatch):
    baked = []
    true_bake = cycles_bake._bake
    monkeypatch.setattr(cycles_bake, "_bake", lambda request: baked.append(request) or true_bake(request))
    return baked


@pytest.mark.parametrize("coordinates", ["Generated", "Object", "UV", None])
@pytest.mark.parametrize("kind", ["ShaderNodeTexNoise", "ShaderNodeTexVoronoi", "ShaderNodeTexWave"])
def test_procedural_textures_as_cycles_sees_them(kind, coordinates):
    material, texture, _ = procedural(kind)
    texture.inputs["Scale"].default_value = 0.3 if kind == "ShaderNodeTexWave" else 1
    if coordinates:
        node = material.node_tree.nodes.new("ShaderNodeTexCoord")
        material.node_tree.links.new(node.outputs[coordinates], texture.inputs["Vector"])
    obj = tiles(material)
    obj.location, obj.rotation_euler = (1, 2, 3), (0.2, 0.4, 0.6)
    warnings = []
    baked = near_corners(scenes.extracted(warnings))
    cycles = scenes.cycles_bake(obj, "COLOR", samples=16).reshape(-1, 4, 3)[:, :3]
    assert np.ptp(cycles) > 0.1
    assert np.abs(baked - cycles).mean() < 0.03
    np.testing.assert_allclose(baked.mean((0, 1)), cycles.mean((0, 1)), atol=5e-3)
    assert not warnings


def test_checks_keep_their_edges():
    material, texture, _ = procedural("ShaderNodeTexChecker")
    node = material.node_tree.nodes.new("ShaderNodeTexCoord")
    material.node_tree.links.new(node.outputs["UV"], texture.inputs["Vector"])
    texture.inputs["Scale"].default_value = 8
    texture.inputs["Color1"].default_value = (0.7, 0.2, 0.1, 1)
    tiles(material)  # one a check
    scene = scenes.extracted()
    u, v = np.random.default_rng(1).uniform(0.05, 0.45, (2, scene.n_triangles)).astype(np.float32)
    albedo = scene.albedo(np.arange(scene.n_triangles), u, v).reshape(8, 8, 2, 3)
    dark = (np.arange(8)[:, None] + np.arange(8)) % 2 == 0
    np.testing.assert_allclose(albedo[dark], 0.2, atol=1e-5)
    np.testing.assert_allclose(albedo[~dark], np.broadcast_to([0.7, 0.2, 0.1], (32, 2, 3)), atol=1e-5)


def test_nothing_is_left_behind_and_nothing_else_changes():
    material, _, _ = procedural("ShaderNodeTexNoise")
    obj, other = tiles(material), scenes.add_cube("Other")
    other.select_set(True)
    bpy.context.view_layer.objects.active = other
    bpy.context.view_layer.update()
    before = data_blocks()
    scenes.extracted()
    assert data_blocks() == before
    assert bpy.context.view_layer.objects.active == other
    assert [one.name for one in bpy.context.selected_objects] == ["Other"]
    assert bpy.context.scene.name == "Scene"
    assert len(obj.data.uv_layers) == 1


def test_same_content_is_baked_once(monkeypatch):
    baked = count_bakes(monkeypatch)
    material, texture, _ = procedural("ShaderNodeTexNoise")
    first = tiles(material)
    for i in range(3):  # they share a mesh
        copy = first.copy()
        copy.location.x = 3 * i
        bpy.context.scene.collection.objects.link(copy)
    scene = scenes.extracted()
    assert len(baked) == 1 and len(scene.materials) == 1
    scenes.extracted()
    assert len(baked) == 1
    texture.inputs["Scale"].default_value = 3
    scenes.extracted()
    assert len(baked) == 2
    first.data.vertices[0].co.z += 1
    scenes.extracted()
    assert len(baked) == 3


def sequence(folder, material, socket):
    """Frame 1 of a picture is dark, frame 2 bright; noise tells where on it a point looks."""
    tree = material.node_tree
    for frame, value in ((1, 0.25), (2, 0.75)):
        image = bpy.data.images.new("Frame", 4, 4, float_buffer=True, is_data=True)
        image.pixels.foreach_set(np.full(64, value, np.float32))
        image.file_format, image.filepath_raw = "OPEN_EXR", str(folder / f"frame{frame:04}.exr")
        image.save()
    node, noise = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexNoise")
    node.image = bpy.data.images.load(str(folder / "frame0001.exr"))
    node.image.source = "SEQUENCE"
    node.image_user.frame_duration, node.image_user.use_auto_refresh = 2, True
    tree.links.new(noise.outputs["Color"], node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], socket)


def test_image_sequences_are_baked_at_each_frame(tmp_path, monkeypatch):
    baked = count_bakes(monkeypatch)
    material, surface = scenes.add_material()
    sequence(tmp_path, material, surface.inputs["Base Color"])
    tiles(material)
    for frame, value in ((1, 0.25), (2, 0.75), (1, 0.25)):
        bpy.context.scene.frame_set(frame)
        materials = scenes.extracted().materials
        np.testing.assert_allclose(scenes.albedo_of(materials), value, atol=1e-3)
    assert len(baked) == 2


def test_objects_that_a_material_tells_apart_are_baked_each(monkeypatch):
    baked = count_bakes(monkeypatch)
    material, mix, _ = procedural("ShaderNodeMixRGB")
    mix.inputs[0].default_value = 0
    for kind, end in (("ObjectInfo", mix.inputs[1]), ("TexNoise", mix.inputs[2])):
        node = material.node_tree.nodes.new(f"ShaderNode{kind}")
        material.node_tree.links.new(node.outputs["Color"], end)
    first = tiles(material)
    second = first.copy()
    first.color, second.color = (1, 0, 0, 1), (0, 0, 1, 1)
    bpy.context.scene.collection.objects.link(second)
    values = scenes.albedo_of(scenes.extracted().materials)
    assert len(baked) == 2
    np.testing.assert_allclose(sorted(values.tolist()), [[0, 0, 1], [1, 0, 0]], atol=1e-5)


def test_custom_properties_of_objects():
    material, node, _ = procedural("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "OBJECT", "paint"
    obj = tiles(material)
    for value in ((0.3, 0.2, 0.1), (0.1, 0.2, 0.3)):
        obj["paint"] = value
        obj.update_tag()
        materials = scenes.extracted().materials
        np.testing.assert_allclose(scenes.albedo_of(materials), [value], atol=1e-5)


def test_numbers_and_colours_of_one_material():
    """Roughness, metallic and transmission share a bake; each arrives where it belongs."""
    material, _, surface = procedural("ShaderNodeObjectInfo", output="Color")
    tree = material.node_tree
    for name in ("Roughness", "Metallic", "Alpha", "Emission Strength"):
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = name
        tree.links.new(attribute.outputs["Fac"], surface.inputs[name])
    obj = tiles(material)
    obj.color = (0.5, 0.25, 0.125, 1)
    for name, value in (("Roughness", 0.3), ("Metallic", 1.0), ("Alpha", 0.5), ("Emission Strength", 7.0)):
        obj.data.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", np.full(81, value, np.float32))
    materials = scenes.extracted().materials
    np.testing.assert_allclose(materials.closures.roughness.value[0], 0.3, atol=1e-3)
    np.testing.assert_allclose(materials.coverage.value[0], 0.5, atol=1e-3)
    np.testing.assert_allclose(materials.closures.f0.value[0], [0.5, 0.25, 0.125], atol=1e-3)
    np.testing.assert_allclose(materials.emission.value[0], 7, atol=1e-2)
    np.testing.assert_allclose(scenes.albedo_of(materials)[0], 0, atol=1e-6)


def test_colour_attribute():
    material, node, _ = procedural("ShaderNodeVertexColor")
    node.layer_name = "Paint"
    obj = tiles(material)
    paint = obj.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    colors = np.random.default_rng(1).uniform(0.2, 0.8, (81, 4)).astype(np.float32)
    paint.data.foreach_set("color", colors.ravel())
    baked = near_corners(scenes.extracted())
    corners = np.array([face.vertices[:3] for face in obj.data.polygons])
    assert np.abs(baked - colors[corners][..., :3]).mean() < 0.02


def test_nested_groups():
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Scale", in_out="INPUT", socket_type="NodeSocketFloat").default_value = 2
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    nodes = inner.nodes
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    noise, diffuse = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeBsdfDiffuse")
    inner.links.new(start.outputs[0], noise.inputs["Scale"])
    inner.links.new(noise.outputs["Color"], diffuse.inputs["Color"])
    inner.links.new(diffuse.outputs[0], end.inputs[0])
    material, _ = scenes.add_material("Grouped")
    tree = material.node_tree
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    group.inputs[0].default_value = 1
    output = tree.get_output_node("CYCLES")
    tree.links.new(group.outputs[0], output.inputs["Surface"])
    obj = tiles(material)
    before = data_blocks()
    baked = near_corners(scenes.extracted())
    assert data_blocks() == before
    cycles = scenes.cycles_bake(obj, "COLOR", samples=16).reshape(-1, 4, 3)[:, :3]
    assert np.abs(baked - cycles).mean() < 0.01


@pytest.mark.parametrize("modifier", ["SUBSURF", "SOLIDIFY", "ARRAY"])
def test_evaluated_meshes(modifier):
    """Generated coordinates of a mesh with modifiers go by the texture space that it has without."""
    material, _, _ = procedural("ShaderNodeTexGradient")
    tiles(material, 4).modifiers.new("M", modifier)
    scene = scenes.extracted()
    triangle, third = np.arange(scene.n_triangles), np.full(scene.n_triangles, 1 / 3, np.float32)
    generated = (scene.points(triangle, third, third)[:, :1] + 1) / 2
    flat = np.abs(scene.normals[:, 2]) > 0.5  # not the thin rims
    expected = np.broadcast_to(np.clip(generated, 0, 1), (scene.n_triangles, 3))
    np.testing.assert_allclose(scene.albedo(triangle, third, third)[flat], expected[flat], atol=0.01)


@pytest.mark.parametrize("modifier", ["", "SUBSURF", "ARMATURE"])
def test_shape_keys(modifier, tmp_path):
    """The mesh is baked in its shape; no key stays behind, which would keep the file from being saved."""
    material, _, _ = procedural("ShaderNodeTexGradient")
    node = material.node_tree.nodes.new("ShaderNodeTexCoord")
    material.node_tree.links.new(node.outputs["Object"], material.node_tree.nodes["Gradient Texture"].inputs["Vector"])
    obj = tiles(material, 4)
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Aside")
    for point in key.data:
        point.co.x = point.co.x / 4 + 0.5
    key.value = 1
    if modifier:
        obj.modifiers.new("M", modifier)
    before = data_blocks()
    scene = scenes.extracted()
    assert data_blocks() == before
    triangle, third = np.arange(scene.n_triangles), np.full(scene.n_triangles, 1 / 3, np.float32)
    x = scene.points(triangle, third, third)[:, :1]
    assert 0.2 < x.min() < 0.35 and 0.65 < x.max() < 0.8
    np.testing.assert_allclose(scene.albedo(triangle, third, third), np.repeat(x, 3, axis=1), atol=0.01)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"), copy=True)


def test_curves_and_instances(monkeypatch):
    """Meshes that Blender makes while it evaluates, and one bake for all instances."""
    baked = count_bakes(monkeypatch)
    material, _, _ = procedural("ShaderNodeTexNoise")
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.splines.new("NURBS").points.add(4)
    for i, point in enumerate(curve.splines[0].points):
        point.co = (i, i % 2, 0, 1)
    curve.bevel_depth = 0.2
    curve.materials.append(material)
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(bpy.data.objects.new("Curve", curve))
    for x in range(2):
        empty = bpy.data.objects.new("Empty", None)
        empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", collection, 5 * x
        bpy.context.scene.collection.objects.link(empty)
    before = data_blocks()
    scene = scenes.extracted()
    assert data_blocks() == before
    assert len(baked) == 1 and len(scene.objects.names) == 2
    triangle, third = np.arange(scene.n_triangles), np.full(scene.n_triangles, 1 / 3, np.float32)
    albedo = scene.albedo(triangle, third, third).reshape(2, -1, 3)
    np.testing.assert_array_equal(albedo[0], albedo[1])
    assert albedo.std() > 0.05 and 0.4 < albedo.mean() < 0.6


def test_what_depends_on_the_ray_is_constant():
    """A bake looks as a camera does, along the normals; photons do not."""
    material, surface = scenes.add_material()
    tree = material.node_tree
    noise, path, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "LightPath", "MixRGB"))
    mix.blend_type, mix.inputs[0].default_value = "MULTIPLY", 1
    tree.links.new(noise.outputs["Color"], mix.inputs[1])
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[2])
    tree.links.new(mix.outputs[0], surface.inputs["Base Color"])
    tiles(material)
    np.testing.assert_allclose(scenes.albedo_of(scenes.extracted().materials), 0)
    tree.links.new(path.outputs["Is Diffuse Ray"], mix.inputs[2])
    materials = scenes.extracted().materials
    assert materials.textures.pixels.mean() == pytest.approx(0.5, abs=0.1)


def test_faces_of_each_slot():
    material, _, _ = procedural("ShaderNodeTexNoise")
    red, surface = scenes.add_material("Red")
    surface.inputs[0].default_value = (1, 0, 0, 1)
    obj = tiles(red)
    obj.data.materials.append(material)
    obj.data.polygons.foreach_set("material_index", np.arange(64, dtype=np.int32) % 2)
    baked = near_corners(scenes.extracted())
    cycles = scenes.cycles_bake(obj, "COLOR", samples=16).reshape(-1, 4, 3)[:, :3]
    np.testing.assert_allclose(baked[::2], np.broadcast_to([1, 0, 0], (32, 3, 3)), atol=1e-6)
    assert np.abs(baked - cycles).mean() < 0.03


def test_failing_bake_warns_and_takes_the_sockets_own_value(monkeypatch):
    material, _, _ = procedural("ShaderNodeTexNoise", name="Wall")
    tiles(material)

    def fail(request):
        raise CyclesError("no Cycles here")

    monkeypatch.setattr(cycles_bake, "_bake", fail)
    warnings = []
    before = data_blocks()
    materials = scenes.extracted(warnings).materials
    np.testing.assert_allclose(scenes.albedo_of(materials), DEFAULT_GREY, atol=1e-6)
    assert len(warnings) == 1 and "'Wall'" in warnings[0] and "no Cycles here" in warnings[0]
    assert data_blocks() == before


@pytest.mark.parametrize("n_corners", [3, 4, 7])
def test_atlas_gives_every_face_texels_of_its_own(n_corners):
    angle = np.arange(n_corners) / n_corners * 2 * np.pi
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    sizes = np.random.default_rng(2).uniform(0.01, 3, 50)
    vertices = np.concatenate([ring * size for size in sizes])
    obj = scenes.add_mesh("Rings", vertices, np.arange(len(vertices)).reshape(-1, n_corners))
    atlas = make_atlas(obj.data, np.ones(50, bool), np.eye(4))
    low, high = atlas.uvs.reshape(50, -1, 2).min(1), atlas.uvs.reshape(50, -1, 2).max(1)
    assert (low >= 0).all() and (high <= 1).all()
    overlaps = ((low[:, None] < high) & (low < high[:, None])).all(2)
    np.testing.assert_array_equal(overlaps, np.eye(50, dtype=bool))
