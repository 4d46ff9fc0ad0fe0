"""What only Cycles can evaluate: values of sockets all over an object, baked into a small picture.

The values are wired to an Emission shader in a copy of the material, on a copy of the mesh, in a scene of their own;
all of it is removed afterwards.
"""

from dataclasses import dataclass
from math import prod

import bpy
import numpy as np

from ...lightmap.atlas import Atlas
from ...temporary import CyclesError, Temporary, cycles_scene, frozen_copy
from ..content_key import mesh_key, scene_key, tree_key
from ..meshes.object_values import Reading
from ..recent import Recent
from .nodes import FROM_FRONT, Place, View, all_nodes, output_node, socket, source

N_SAMPLES = 1
"""A texel holds the value at one point in it: many look-ups average them, as light does."""

CACHE_BYTES = 256 * 2**20
"""What is kept of earlier bakes."""

VIEW_DEPENDENT = {"LIGHT_PATH", "NEW_GEOMETRY", "FRESNEL", "LAYER_WEIGHT"}
"""Nodes some of whose outputs are taken for constants, since a bake looks along the normals as a camera does."""

OF_THE_OBJECT = {"NEW_GEOMETRY", "TEX_COORD", "CAMERA", "VECT_TRANSFORM", "AMBIENT_OCCLUSION", "BEVEL"}
OF_THE_OBJECT |= {"PARTICLE_INFO", "SCRIPT", "NORMAL_MAP", "DISPLACEMENT", "VECTOR_DISPLACEMENT"}
"""Nodes that may see where an object is; other trees look the same on every instance but for their `readings_in`."""


@dataclass(frozen=True)
class BakeRequest:
    """Values of a material's sockets that are wanted over an object.

    Attributes
    ----------
    material : bpy.types.Material
        Original, not evaluated.
    places : list of Place
        Sockets, in the material or its evaluated copy.
    mesh : bpy.types.Mesh
        Evaluated.
    obj : bpy.types.Object
        Original, whose mesh it is.
    matrix : (4, 4) float64
        Local to world.
    atlas : Atlas
    values : dict of Reading to (4,) float32
        What the material reads of the object.
    view : View
    """

    material: "bpy.types.Material"
    places: list[Place]
    mesh: "bpy.types.Mesh"
    obj: "bpy.types.Object"
    matrix: np.ndarray
    atlas: Atlas
    values: dict[Reading, np.ndarray]
    view: View = FROM_FRONT

    def key(self) -> tuple:
        """Equal for requests that give equal pictures."""
        where: tuple = ()
        if sees_object(self.material.node_tree):
            where = (self.obj.name_full, self.matrix.tobytes())
        names = tuple(path_of(place) for place in self.places)
        tree = tree_key(self.material.node_tree)
        frame = scene_key(self.material, bpy.context.scene)
        read = tuple((reading, value.tobytes()) for reading, value in sorted(self.values.items()))
        return tree, frame, mesh_key(self.mesh), self.atlas.uvs.tobytes(), names, where, read, self.view


_baked = Recent(CACHE_BYTES, lambda values: sum(value.nbytes for value in values))


def bake_values(request: BakeRequest) -> list[np.ndarray]:
    """The value of each socket at the atlas' texels, (side, side, 1 or 3) float32; kept for the next time.

    What is the same all over comes as (1, 1, 1 or 3).

    Raises
    ------
    CyclesError
    """
    return _baked.found(request.key(), lambda: _bake(request))


def bake_at_corners(
    material: "bpy.types.Material",
    places: list[Place],
    mesh: "bpy.types.Mesh",
    obj: "bpy.types.Object",
    matrix: np.ndarray | None = None,
) -> dict[Place, np.ndarray]:
    """The values of sockets at the corners of a mesh, (c, 1 or 3) float32.

    Parameters
    ----------
    material : bpy.types.Material
        Original.
    mesh : bpy.types.Mesh
        Evaluated.
    obj : bpy.types.Object
        Original, whose mesh it is.
    matrix : (4, 4) float64, optional
        Local to world, instead of its own.

    Raises
    ------
    CyclesError
    """
    values: dict[Place, np.ndarray] = {}
    if not places:
        return values
    with Temporary() as temporary:
        copy = frozen_copy(material, VIEW_DEPENDENT, temporary)
        sources = {place: _exposed(copy.node_tree, place) for place in places}
        corners = temporary.copy(mesh)
        corners.materials.clear()
        corners.materials.append(copy)
        colors = corners.color_attributes.new("Photon Bake", "FLOAT_COLOR", "CORNER")
        corners.color_attributes.active_color = colors
        stand_in = temporary.add(bpy.data.objects.new(obj.name, corners))
        stand_in.matrix_world = obj.matrix_world if matrix is None else matrix.T.tolist()
        emission, scene = _shown_as_light(copy), _scene(stand_in, temporary)
        for some in _passes(places):
            _show(copy.node_tree, emission, [sources[place] for place in some])
            _run(scene, stand_in, target="VERTEX_COLORS")
            found = np.empty((len(mesh.loops), 4), np.float32)
            corners.color_attributes["Photon Bake"].data.foreach_get("color", found.reshape(-1))
            found = np.nan_to_num(found, posinf=0.0, neginf=0.0)
            columns = [found[:, :3]] if _is_color(some[0]) else [found[:, i : i + 1] for i in range(3)]
            values |= dict(zip(some, columns, strict=False))
    return values


def sees_object(tree: "bpy.types.NodeTree") -> bool:
    """Whether a material may look different on two objects with the same mesh, where it reads the same of both."""
    return any(node.type in OF_THE_OBJECT for node in all_nodes(tree))


def path_of(place: Place) -> tuple[str, ...]:
    """Where a socket is in any copy of its node tree."""
    return (*(group.name for group in place.groups), place.socket.node.name, place.socket.identifier)


def _bake(request: BakeRequest) -> list[np.ndarray]:
    passes = _passes(request.places)
    with Temporary() as temporary:
        material = frozen_copy(request.material, VIEW_DEPENDENT, temporary, request.values.get, request.view)
        sources = {place: _exposed(material.node_tree, place) for place in request.places}
        stage = _Stage.build(request, material, temporary)
        pictures: dict[Place, np.ndarray] = {}
        for places in passes:
            stage.show([sources[place] for place in places])
            picture = stage.bake()
            columns = [picture] if _is_color(places[0]) else [picture[..., i : i + 1] for i in range(3)]
            pictures |= {place: _compact(column) for place, column in zip(places, columns, strict=False)}
    return [pictures[place] for place in request.places]


def _compact(picture: np.ndarray) -> np.ndarray:
    """One texel of a picture that is the same all over."""
    varies = (np.abs(picture - picture[:1, :1]) > 1e-5).any()
    return np.ascontiguousarray(picture) if varies else picture[:1, :1].copy()


def _is_color(place: Place) -> bool:
    return place.socket.type in {"RGBA", "VECTOR"}


def _passes(places: list[Place]) -> list[list[Place]]:
    """What each bake shows: one colour, or up to three numbers."""
    numbers = [place for place in places if not _is_color(place)]
    threes = [numbers[i : i + 3] for i in range(0, len(numbers), 3)]
    return [[place] for place in places if _is_color(place)] + threes


def _exposed(tree: "bpy.types.NodeTree", place: Place) -> "bpy.types.NodeSocket":
    """An output at the top of a material's tree that has the value of a socket in one of its groups."""
    *names, node_name, identifier = path_of(place)
    groups = []
    for name in names:
        groups.append(tree.nodes[name])
        tree = groups[-1].node_tree
    node = tree.nodes[node_name]
    end = socket(node.outputs, identifier) if place.socket.is_output else source(socket(node.inputs, identifier))
    assert end is not None  # a socket without a link is constant
    if node.type == "OUTPUT_MATERIAL":
        return _bent(tree, end)
    for group in reversed(groups):
        inner = group.node_tree
        kind = "NodeSocketColor" if _is_color(place) else "NodeSocketFloat"
        added = inner.interface.new_socket("Baked", in_out="OUTPUT", socket_type=kind)
        output = next(one for one in inner.nodes if one.type == "GROUP_OUTPUT" and one.is_active_output)
        inner.links.new(end, socket(output.inputs, added.identifier))
        end = socket(group.outputs, added.identifier)
    return end


def _bent(tree: "bpy.types.NodeTree", displacement: "bpy.types.NodeSocket") -> "bpy.types.NodeSocket":
    """Normals that a displacement bends, as Cycles has it: by its height over the surface as that of a bump."""
    normal, height = tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], tree.nodes.new("ShaderNodeVectorMath")
    bump = tree.nodes.new("ShaderNodeBump")
    height.operation = "DOT_PRODUCT"
    tree.links.new(displacement, height.inputs[0])
    tree.links.new(normal, height.inputs[1])
    tree.links.new(height.outputs["Value"], bump.inputs["Height"])
    bump.inputs["Strength"].default_value = bump.inputs["Distance"].default_value = 1.0
    return bump.outputs["Normal"]


@dataclass(frozen=True)
class _Stage:
    """A scene with one object, lit by nothing, whose material shows values as light."""

    scene: "bpy.types.Scene"
    obj: "bpy.types.Object"
    image: "bpy.types.Image"
    material: "bpy.types.Material"
    emission: "bpy.types.Node"
    uv_map: str

    @staticmethod
    def build(request: BakeRequest, material: "bpy.types.Material", temporary: Temporary) -> "_Stage":
        tree, side = material.node_tree, request.atlas.side
        mesh = _mesh(request, temporary)
        mesh.materials.append(material)
        image = bpy.data.images.new("Photon Bake", side, side, alpha=True, float_buffer=True, is_data=True)
        temporary.add(image)
        obj = temporary.add(bpy.data.objects.new(request.obj.name, mesh))
        obj.matrix_world = request.matrix.T.tolist()
        target = tree.nodes.new("ShaderNodeTexImage")
        target.image = image
        tree.nodes.active = target
        emission = _shown_as_light(material)
        return _Stage(_scene(obj, temporary), obj, image, material, emission, mesh.uv_layers[-1].name)

    def show(self, values: "list[bpy.types.NodeSocket]") -> None:
        """Wire values to the emission: one colour, or up to three numbers."""
        _show(self.material.node_tree, self.emission, values)

    def bake(self) -> np.ndarray:
        """The picture, (side, side, 3) float32; where no face is it has the mean of the rest."""
        image = {"save_mode": "INTERNAL", "margin": 2, "margin_type": "EXTEND", "uv_layer": self.uv_map}
        _run(self.scene, self.obj, target="IMAGE_TEXTURES", **image)
        pixels = np.empty(prod(self.image.size) * self.image.channels, np.float32)
        self.image.pixels.foreach_get(pixels)
        pixels = np.nan_to_num(pixels.reshape(*self.image.size, 4), posinf=0.0, neginf=0.0)
        color, shown = pixels[..., :3], pixels[..., 3] > 0
        color[~shown] = color[shown].mean(axis=0) if shown.any() else 0
        return color


def _shown_as_light(material: "bpy.types.Material") -> "bpy.types.Node":
    """An Emission shader that takes the place of all that a material is."""
    tree, output = material.node_tree, output_node(material)
    assert output is not None  # closures or displacement hang on it
    for one in output.inputs:
        for link in list(one.links):
            tree.links.remove(link)
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return emission


def _show(tree: "bpy.types.NodeTree", emission: "bpy.types.Node", values: "list[bpy.types.NodeSocket]") -> None:
    """Wire values to an emission: one colour, or up to three numbers."""
    if len(values) > 1:
        combined = tree.nodes.new("ShaderNodeCombineColor")
        for value, channel in zip(values, combined.inputs, strict=False):
            tree.links.new(value, channel)
        values = [combined.outputs[0]]
    tree.links.new(values[0], emission.inputs["Color"])


def _run(scene: "bpy.types.Scene", obj: "bpy.types.Object", **how: object) -> None:
    """Have Cycles bake what an object emits."""
    active = {"active_object": obj, "object": obj, "selected_objects": [obj], "selected_editable_objects": [obj]}
    try:
        with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0], **active):
            bpy.ops.object.bake(type="EMIT", use_selected_to_active=False, use_clear=True, **how)
    except RuntimeError as error:
        raise CyclesError(str(error).strip()) from error


def _mesh(request: BakeRequest, temporary: Temporary) -> "bpy.types.Mesh":
    """A copy of the evaluated mesh whose last UV map is the atlas."""
    mesh = temporary.copy(request.mesh)
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = request.mesh.texspace_location, request.mesh.texspace_size
    mesh.materials.clear()
    layer = mesh.uv_layers.new(name="Photon Bake", do_init=False)
    if layer is None:
        raise CyclesError("its mesh has as many UV maps as a mesh can have")
    layer.uv.foreach_set("vector", request.atlas.uvs.ravel())
    return mesh


def _scene(obj: "bpy.types.Object", temporary: Temporary) -> "bpy.types.Scene":
    """A scene that holds only `obj`, selected and active, at the frame of the user's."""
    scene = cycles_scene(bpy.context.scene, temporary)
    scene.cycles.samples = N_SAMPLES
    scene.collection.objects.link(obj)
    layer = scene.view_layers[0]
    obj.select_set(True, view_layer=layer)
    layer.objects.active = obj
    return scene
