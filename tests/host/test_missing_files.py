"""Files that are not there: what Cycles shows of them, with a warning that names file and user."""

import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.read.materials.pictures.missing_files import sequence_frame
from photon_bake.addon.core.errors import kind_of

from . import scenes


@pytest.fixture
def plane(empty_scene):
    """A plane whose diffuse colour an image node gives: the node."""
    material, surface = scenes.add_material("Wall", "ShaderNodeBsdfDiffuse")
    scenes.add_plane(material=material)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    material.node_tree.links.new(node.outputs["Color"], surface.inputs["Color"])
    return node


def image_at(path, source="FILE"):
    image = bpy.data.images.new("Picture", 4, 4)
    image.source, image.filepath = source, str(path)
    return image


def extracted():
    warnings = []
    return scenes.extracted(warnings), warnings


def diffuse(scene):
    """The albedo of the only material, which has no texture that differs from texel to texel."""
    assert not scene.materials.closures.weight.textured
    return scenes.albedo_of(scene.materials)[0]


@pytest.mark.parametrize("alpha", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
@pytest.mark.parametrize("space", ["sRGB", "Non-Color", "Linear Rec.709"])
def test_a_missing_image_is_magenta(plane, tmp_path, alpha, space):
    plane.image = image_at(tmp_path / "wall.png")
    plane.image.alpha_mode, plane.image.colorspace_settings.name = alpha, space
    scene, warnings = extracted()
    np.testing.assert_array_equal(diffuse(scene), (1, 0, 1))
    (warning,) = warnings
    assert kind_of(warning) == "missing"
    assert "'Picture' of material 'Wall' is missing" in warning and str(tmp_path / "wall.png") in warning


def test_what_cycles_makes_of_it(plane, tmp_path):
    plane.image = image_at(tmp_path / "wall.png")
    (obj,) = bpy.context.scene.objects
    np.testing.assert_allclose(scenes.cycles_bake(obj, "COLOR", 1), [[1, 0, 1]] * 4, atol=1e-6)


def test_a_missing_image_is_opaque(plane, tmp_path):
    plane.image = image_at(tmp_path / "wall.png")
    surface = plane.outputs["Color"].links[0].to_node
    plane.id_data.links.new(plane.outputs["Alpha"], surface.inputs["Color"])
    np.testing.assert_array_equal(diffuse(extracted()[0]), (1, 1, 1))


@pytest.mark.parametrize("packed", [False, True])
def test_an_image_that_cannot_be_read_is_magenta(plane, tmp_path, packed):
    plane.image = image_at(tmp_path / "wall.png")
    (tmp_path / "wall.png").write_bytes(b"version https://git-lfs.github.com/spec/v1")
    if packed:
        plane.image.pack(data=b"nonsense", data_len=8)
    scene, (warning,) = extracted()
    np.testing.assert_array_equal(diffuse(scene), (1, 0, 1))
    assert "'Picture' of material 'Wall' cannot be read" in warning and kind_of(warning) == "missing"


def test_an_image_of_a_modifier_is_named(tmp_path):
    texture = bpy.data.textures.new("Waves", "IMAGE")
    texture.image = image_at(tmp_path / "waves.png")
    scenes.add_cube("Box").modifiers.new("Displace", "DISPLACE").texture = texture
    _, (warning,) = extracted()
    assert "'Picture' of object 'Box' is missing" in warning and "renders go on without it" in warning


@pytest.mark.parametrize("source", ["SEQUENCE", "MOVIE"])
def test_films_are_magenta(plane, tmp_path, source):
    plane.image = image_at(tmp_path / "film_0001.png", source)
    plane.image_user.frame_duration = 10
    bpy.context.scene.frame_set(3)
    scene, (warning,) = extracted()
    np.testing.assert_allclose(diffuse(scene), (1, 0, 1), atol=1e-6)
    assert ("film_0003.png" if source == "SEQUENCE" else "film_0001.png") in warning


def test_a_tile_that_is_missing_is_named(plane, tmp_path):
    picture = bpy.data.images.new("Tile", 2, 2)
    picture.filepath_raw, picture.file_format = str(tmp_path / "wall.1001.png"), "PNG"
    picture.save()
    plane.image = image_at(tmp_path / "wall.<UDIM>.png", "TILED")
    plane.image.tiles.new(1002)
    _, (warning,) = extracted()
    assert "wall.1002.png" in warning


def test_one_warning_a_file_names_all_users(plane, tmp_path):
    plane.image = image_at(tmp_path / "wall.png")
    other = bpy.data.materials["Wall"].copy()
    other.name = "Floor"
    scenes.add_plane("Other", material=other)
    other.node_tree.nodes[plane.name].image = image_at(tmp_path / "wall.png")
    _, (warning,) = extracted()
    assert "material 'Floor', material 'Wall'" in warning


def test_what_light_does_not_depend_on_is_not_named(plane, tmp_path):
    image = image_at(tmp_path / "wall.png")
    plane.image = image
    for link in list(plane.outputs["Color"].links):
        plane.id_data.links.remove(link)
    hidden, surface = scenes.add_material("Hidden", "ShaderNodeBsdfDiffuse")
    node = hidden.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    hidden.node_tree.links.new(node.outputs[0], surface.inputs["Color"])
    scenes.add_cube(material=hidden).hide_render = True
    assert extracted()[1] == []


def test_an_image_in_a_group_is_found(plane, tmp_path):
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    inner, end = group.nodes.new("ShaderNodeTexImage"), group.nodes.new("NodeGroupOutput")
    inner.image = image_at(tmp_path / "wall.png")
    group.links.new(inner.outputs[0], end.inputs[0])
    node = plane.id_data.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    plane.id_data.links.new(node.outputs[0], plane.outputs["Color"].links[0].to_socket)
    scene, (warning,) = extracted()
    np.testing.assert_array_equal(diffuse(scene), (1, 0, 1))
    assert "material 'Wall'" in warning


def test_no_image_is_magenta_and_no_file_is_missing(plane):
    scene, (warning,) = extracted()
    np.testing.assert_array_equal(diffuse(scene), (1, 0, 1))
    assert "Material 'Wall'" in warning and kind_of(warning) == "advice"


@pytest.mark.parametrize("there", [False, True])
def test_a_world_picture_that_cannot_be_read_is_magenta(tmp_path, there):
    background = scenes.set_world((1, 1, 1))
    scenes.add_plane()
    tree = background.id_data
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image_at(tmp_path / "sky.hdr")
    if there:
        (tmp_path / "sky.hdr").write_bytes(b"nonsense")
    tree.links.new(node.outputs[0], background.inputs["Color"])
    scene, (warning,) = extracted()
    np.testing.assert_allclose(scene.world.color, (1, 0, 1), atol=1e-3)
    assert "'Picture' of world 'World'" in warning and ("cannot be read" if there else "is missing") in warning


def test_caches_fonts_and_volumes(tmp_path):
    font = tmp_path / "letters.ttf"
    shutil.copy(next(Path(bpy.utils.system_resource("DATAFILES"), "fonts").glob("*.woff2")), font)
    text = bpy.data.curves.new("Letters", "FONT")
    text.font = bpy.data.fonts.load(str(font))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Text", text))
    font.unlink()
    obj = scenes.add_cube("Box")
    obj.modifiers.new("Cache", "MESH_CACHE").filepath = str(tmp_path / "box.pc2")
    obj.modifiers.new("Ocean", "OCEAN").show_viewport = False
    volume = bpy.data.volumes.new("Smoke")
    volume.filepath = str(tmp_path / "smoke.vdb")
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Cloud", volume))
    said = " ".join(one for one in extracted()[1] if kind_of(one) == "missing")
    assert f"A file of object 'Box' is missing ('{tmp_path / 'box.pc2'}')" in said
    assert f"Volume 'Smoke' of object 'Cloud' is missing ('{tmp_path / 'smoke.vdb'}')" in said
    assert f"of object 'Text' is missing ('{font}'): Blender's own font takes its place" in said
    assert said.count("is missing") == 3


def test_a_library_that_is_gone_is_named(tmp_path):
    library, main = tmp_path / "library.blend", tmp_path / "main.blend"
    collection = bpy.data.collections.new("Furniture")
    block = scenes.add_cube("Block")
    collection.objects.link(block)
    bpy.data.libraries.write(str(library), {collection})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scenes.add_plane()
    with bpy.data.libraries.load(str(library), link=True) as (_, here):
        here.collections = ["Furniture"]
    empty = bpy.data.objects.new("Furniture", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", here.collections[0]
    bpy.context.scene.collection.objects.link(empty)
    bpy.ops.wm.save_as_mainfile(filepath=str(main))
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(main))
    scene, (warning,) = extracted()
    assert scene.n_triangles == 2
    assert "'library.blend' of collection 'Furniture' is missing" in warning and str(library) in warning


@pytest.mark.parametrize(
    ("frame", "cyclic", "shown"), [(1, False, 1), (3, False, 3), (12, False, 10), (-4, False, 0), (12, True, 2)]
)
def test_the_frame_of_a_sequence(plane, frame, cyclic, shown):
    user = plane.image_user
    user.frame_duration, user.use_cyclic, user.frame_offset = 10, cyclic, 100
    assert sequence_frame(user, frame) == shown + 100
