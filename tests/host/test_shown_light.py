"""Light is shown where it belongs, whatever modifiers a mesh has: each that can be added, by a light that is known."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender import bake_objects, receiver_meshes, write_color_attribute
from photon_bake.addon.blender.read.as_read import AsRead
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.receivers import vertex_receivers
from photon_bake.tests.host import scenes
from photon_bake.tests.host.test_receiver_mesh_modifiers import geometry_nodes, scrambled_grid

SLOPE = np.array([[0.5, 0.1, 0.0], [0.2, 0.6, 0.1], [0.0, 0.3, 0.4]])
LEVEL = np.array([4.0, 5.0, 6.0])


def light_at(positions):
    """A light that changes evenly with the place, (n, 3)."""
    return positions @ SLOPE + LEVEL


def shown(obj, name="Indirect"):
    """What an object's corners show after its modifiers, and where they are: (c, 3) each."""
    return scenes.in_graph(lambda graph: _shown(obj.evaluated_get(graph).data, name))


def _shown(mesh, name):
    vertex = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", positions.reshape(-1))
    attribute = mesh.attributes[name]
    values = np.empty((len(attribute.data), 4), np.float32)
    attribute.data.foreach_get("color", values.reshape(-1))
    return (values if attribute.domain == "CORNER" else values[vertex])[:, :3], positions[vertex]


def bake_light_at(obj):
    """Write the light that changes evenly; returns the warnings."""
    warnings = []

    def read(graph):
        return receiver_meshes(bake_objects(graph, None, warnings), graph, warnings, all_of_them=False)

    receivers = vertex_receivers(scenes.in_graph(read))
    meanwhile = [AsRead.of(bpy.data.objects[target.object_name]) for target in receivers.targets]
    warnings += write_color_attribute(light_at(receivers.position) * np.pi, receivers, "Indirect", meanwhile)
    return warnings


def errors(obj):
    values, positions = shown(obj)
    return np.abs(values - light_at(positions)).max(axis=1)


# Of the types that are not deforming, with settings: how far off what is shown may be (the light's slope is about 0.7
# a metre, and receivers lie 2 % of the way into their faces), or what the warning says.
LEFT_OUT, SEVERAL = "makes a new mesh that shows no attribute", "same light in several places"
EXACT = 0.02
CASES = [
    ("ARRAY", {}, SEVERAL),
    ("BEVEL", {"limit_method": "NONE", "width": 0.05}, EXACT),
    ("BEVEL", {"limit_method": "NONE", "width": 0.05, "segments": 3}, EXACT),
    ("BEVEL", {"affect": "VERTICES", "width": 0.05}, 0.04),  # 5.2 shows a corner's own value a little beside it
    ("BUILD", {"frame_start": -50, "frame_duration": 100}, EXACT),
    ("DECIMATE", {"ratio": 0.5}, EXACT),
    ("DECIMATE", {"decimate_type": "UNSUBDIV", "iterations": 2}, EXACT),
    ("DECIMATE", {"decimate_type": "DISSOLVE", "angle_limit": 0.5}, EXACT),
    ("EDGE_SPLIT", {"split_angle": 0.0}, EXACT),
    ("EXPLODE", {}, EXACT),
    ("FLUID", {}, EXACT),
    ("MASK", {"vertex_group": "Group"}, EXACT),
    ("MIRROR", {}, SEVERAL),
    ("MIRROR", {"use_bisect_axis": (True, False, False)}, SEVERAL),
    ("MULTIRES", {}, EXACT),
    ("OCEAN", {}, LEFT_OUT),
    ("OCEAN", {"geometry_mode": "DISPLACE"}, EXACT),
    ("PARTICLE_INSTANCE", {}, EXACT),
    ("REMESH", {"mode": "BLOCKS"}, LEFT_OUT),
    ("REMESH", {"mode": "VOXEL", "voxel_size": 0.3}, LEFT_OUT),
    ("SCREW", {}, SEVERAL),
    ("SKIN", {}, LEFT_OUT),
    ("SOLIDIFY", {}, SEVERAL),
    ("SOLIDIFY", {"solidify_mode": "NON_MANIFOLD"}, SEVERAL),
    ("SUBSURF", {}, 0.04),
    ("TRIANGULATE", {}, EXACT),
    ("VOLUME_DISPLACE", {}, EXACT),
    ("WELD", {"merge_threshold": 0.45}, EXACT),
    ("WIREFRAME", {}, SEVERAL),
]


def prepared(flat):
    obj = scrambled_grid(flat)
    obj.vertex_groups.new(name="Group").add(list(range(18)), 1, "ADD")
    return obj


def check(obj, expected):
    warnings = bake_light_at(obj)
    print(f"error {errors(obj).max():.4f}, {warnings}")
    if expected == SEVERAL:
        assert [SEVERAL in warning for warning in warnings] == [True]
    else:
        assert warnings == []
        assert errors(obj).max() < expected
    return warnings


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize(("kind", "settings", "expected"), CASES)
def test_modifiers(kind, settings, expected, flat):
    obj = prepared(flat)
    modifier = obj.modifiers.new("Modifier", kind)
    if modifier is None:
        pytest.skip(f"meshes take no {kind}")
    for key, value in settings.items():
        setattr(modifier, key, value)
    if expected == LEFT_OUT:
        with pytest.raises(BakeError, match=f"'Grid': its modifier 'Modifier' {LEFT_OUT}.*Bake Copies"):
            bake_light_at(obj)
    else:
        check(obj, expected)


def test_every_other_modifier():
    """Those without a case above deform, as they are when they are new, or cannot be added to a mesh."""
    tried = {"BOOLEAN", "NODES", "VOLUME_TO_MESH", *(kind for kind, _, _ in CASES)}
    for item in bpy.types.Modifier.bl_rna.properties["type"].enum_items:
        if item.identifier in tried:
            continue
        obj = prepared(flat=True)
        if obj.modifiers.new("Modifier", item.identifier) is not None:
            check(obj, EXACT)
        bpy.data.objects.remove(obj)


NODES = [
    ("GeometryNodeBoundBox", LEFT_OUT),
    ("GeometryNodeConvexHull", LEFT_OUT),
    ("GeometryNodeDualMesh", EXACT),
    ("GeometryNodeExtrudeMesh", SEVERAL),
    ("GeometryNodeMergeByDistance", EXACT),
    ("GeometryNodeSplitEdges", EXACT),
    ("GeometryNodeSubdivideMesh", EXACT),
    ("GeometryNodeSubdivisionSurface", 0.04),
    ("GeometryNodeTriangulate", EXACT),
]


@pytest.mark.parametrize(("node", "expected"), NODES)
def test_geometry_nodes(node, expected):
    obj = prepared(flat=True)
    geometry_nodes(obj, node)
    if expected == LEFT_OUT:
        with pytest.raises(BakeError, match=f"'Grid': its modifier 'Nodes' {LEFT_OUT}"):
            bake_light_at(obj)
    else:
        check(obj, expected)


def test_copies_of_fluid_domains_are_never_evaluated():
    """Blender 4.5 ends on them."""
    obj = prepared(flat=True)
    obj.modifiers.new("Bevel", "BEVEL").limit_method = "NONE"
    obj.modifiers.new("Fluid", "FLUID").fluid_type = "DOMAIN"
    with pytest.raises(BakeError, match=f"'Grid': its modifier 'Bevel' {LEFT_OUT}"):
        bake_light_at(obj)
    obj.modifiers["Fluid"].fluid_type = "EFFECTOR"
    obj.modifiers["Bevel"].width = 0.05
    obj.modifiers.new("Particles", "PARTICLE_SYSTEM")
    check(obj, EXACT)
    assert len(bpy.data.particles) == 1


def test_no_faces_are_left():
    obj = prepared(flat=True)
    obj.modifiers.new("Volume", "VOLUME_TO_MESH")
    with pytest.raises(BakeError, match="'Grid' has no faces"):
        bake_light_at(obj)


def test_instances_on_particles():
    emitter = scenes.add_plane("Emitter")
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end = 5, 0, 0
    emitter.hide_render = True
    obj = scenes.add_cube()
    modifier = obj.modifiers.new("Instances", "PARTICLE_INSTANCE")
    modifier.object, modifier.show_unborn = emitter, True
    warnings = bake_light_at(obj)
    assert scenes.in_graph(lambda graph: len(obj.evaluated_get(graph).data.vertices)) == 40
    assert [SEVERAL in warning for warning in warnings] == [True]


def add_cut(obj, cutter):
    modifier = obj.modifiers.new("Cut", "BOOLEAN")
    modifier.object = cutter
    return modifier


def add_cutter():
    cutter = scenes.add_cube("Cutter")
    cutter.scale, cutter.location = (0.5, 0.5, 0.5), (1, 0, 0)
    return cutter


def test_boolean_shows_light_on_what_is_left_and_names_what_is_new():
    """A cutter that renders show has light of its own."""
    obj = scenes.add_cube()
    add_cut(obj, add_cutter())
    (warning,) = bake_light_at(obj)
    assert "'Cube': 12% of its surface shows no light, as its modifier 'Cut'" in warning  # 3 m² of 24 − 1 + 3
    assert (np.sort(errors(obj))[:28] < EXACT).all()


def test_little_that_shows_no_light_is_named_too():
    """It is white, Blender's default, and seen as such however small it is."""
    obj, cutter = scenes.add_cube(), add_cutter()
    add_cut(obj, cutter)
    cutter.scale = (0.05, 0.05, 0.05)
    (warning,) = bake_light_at(obj)
    assert "'Cube': under 1% of its surface shows no light, as its modifier 'Cut'" in warning


@pytest.mark.parametrize("solver", ["EXACT", "FLOAT" if bpy.app.version >= (5, 0, 0) else "FAST"])
def test_a_hidden_cutter_holds_the_light_of_its_cuts(solver):
    """Also of what it cuts into two objects, and with modifiers of its own."""
    one, other, cutter = scenes.add_cube(), scenes.add_cube("Other"), add_cutter()
    other.location, cutter.hide_render = (2.25, 0, 0), True
    if solver == "EXACT":
        bevel = cutter.modifiers.new("Bevel", "BEVEL")
        bevel.limit_method, bevel.width = "NONE", 0.05
    for obj in (one, other):
        add_cut(obj, cutter).solver = solver
    warnings = bake_light_at(one)
    assert warnings == []
    assert "Indirect" in cutter.data.attributes
    assert errors(one).max() < 0.05
    values, positions = shown(other)
    assert np.abs(values - light_at(positions + np.array([2.25, 0, 0]))).max() < 0.05


def test_vertices_without_faces_hold_light_too():
    obj = scenes.add_mesh("Profile", [(1, 0, 0), (1.2, 0, 1), (1, 0, 2)], [])
    obj.data.edges.add(2)
    obj.data.edges.foreach_set("vertices", [0, 1, 1, 2])
    obj.data.update()
    obj.modifiers.new("Screw", "SCREW")
    (warning,) = bake_light_at(obj)
    assert SEVERAL in warning
    values, positions = shown(obj)
    mean = light_at(np.column_stack([0 * positions[:, 2], 0 * positions[:, 2], positions[:, 2]]))
    np.testing.assert_allclose(values, mean, atol=0.05)


def test_no_stored_value_is_black_where_a_modifier_takes_faces_away():
    obj = prepared(flat=True)
    obj.modifiers.new("Mask", "MASK").vertex_group = "Group"
    bake_light_at(obj)
    values = np.empty(len(obj.data.loops) * 4, np.float32)
    obj.data.attributes["Indirect"].data.foreach_get("color", values)
    assert values.min() > 0.9


def test_modifiers_in_a_row():
    obj = prepared(flat=True)
    obj.modifiers.new("Bevel", "BEVEL").limit_method = "NONE"
    obj.modifiers["Bevel"].width = 0.02
    obj.modifiers.new("Weld", "WELD")
    obj.modifiers.new("Bend", "SIMPLE_DEFORM").deform_method = "BEND"
    obj.modifiers.new("Decimate", "DECIMATE").ratio = 0.8
    check(obj, 0.1)


def test_large_faces_and_shared_meshes_with_shape_keys_leave_nothing_behind():
    angle = np.linspace(0, 2 * np.pi, 30, endpoint=False)
    obj = scenes.add_mesh("Disk", np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [tuple(range(30))])
    obj.shape_key_add(name="Basis")
    obj.shape_key_add(name="Up")
    other = bpy.data.objects.new("Other", obj.data)
    bpy.context.scene.collection.objects.link(other)
    for one in (obj, other):
        modifier = one.modifiers.new("Bevel", "BEVEL")
        modifier.affect, modifier.limit_method, modifier.width = "VERTICES", "NONE", 0.01
    before = {kind: len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "scenes", "shape_keys", "actions")}
    (warning,) = bake_light_at(obj)
    assert "shared" in warning
    assert {kind: len(getattr(bpy.data, kind)) for kind in before} == before
    assert errors(obj).max() < 0.05
