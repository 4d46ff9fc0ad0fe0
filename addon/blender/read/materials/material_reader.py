"""One Blender material as closures with constant or textured channels."""

from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np

from ....scene import N_VIEWS
from ...lightmap.atlas import make_atlas
from ...temporary import CyclesError
from ...warn import Warnings
from ..media.volume_shaders import VolumeShader, has_volume
from ..meshes.meshes import attribute
from ..meshes.object_values import Reading, Values, readings_in
from ..shortcomings import shortcomings
from .angles import seen_at
from .closures import Closure, combine, read_closures
from .columns import Seen, Surface
from .cycles_bake import BakeRequest, bake_values, sees_object
from .expressions import Evaluator, UnreadableError, default_value, no_images
from .nodes import FROM_FRONT, Place, Value, View, differing_views, output_node, source, uses_nodes
from .own_normals import Normals, OwnNormal
from .pictures.images import ImageTable
from .pictures.strands import picture_of_strands
from .pictures.texture_grid import Coordinates, Grid, Picture, coordinates_of
from .shaders.hair import HAIR, on_fibres, on_surfaces
from .shaders.subsurface import is_body
from .stretches import TangentSource, tangent_sources
from .sums import ShaderSum, matte

DEFAULT_GREY = 0.8
"""Cycles' albedo where there is no material."""


class MaterialReader:
    """Reads one material.

    Attributes
    ----------
    readings : list of Reading
        What it reads of the object that it is on.
    pictures : dict
        The images that its values depend on, by node.
    varying : dict of Place to None
        The sockets whose values are not constant.
    views : list of View
        How it is seen in ways that differ.
    as_seen : tuple of int
        Which of them each of `VIEWS` is.
    needs_bake : bool
        Whether only Cycles can evaluate some of them.
    normals : Normals
    volume : VolumeShader or None
        What fills the meshes that it is on.
    stretched : TangentSource or None
        See `Tangents`.
    """

    def __init__(
        self,
        material: "bpy.types.Material | None",
        identity: int,
        images: ImageTable,
        warnings: Warnings,
        for_camera: bool,
        on_fibres: bool,
    ) -> None:
        self.material, self.identity, self.on_fibres = material, identity, on_fibres
        self.name = material.name if material else "Default"
        self.images = images
        self.warnings = warnings
        self.closures: list[Closure] = []
        self.pictures: dict[tuple, Picture] = {}
        self.varying: dict[Place, None] = {}
        self.readings: list[Reading] = []
        self.needs_bake = False
        self.views, self.as_seen = [FROM_FRONT], (0,) * N_VIEWS
        self.stretched: TangentSource | None = None
        self.normals = Normals(material if material and uses_nodes(material) else None)
        self.volume = VolumeShader.of(material) if material and not on_fibres else None
        if material and uses_nodes(material):
            self.readings = readings_in(material.node_tree)
            self.closures = read_closures(material)
            for what in shortcomings(material, self.closures, on_fibres):
                self.warn(what)
            has_bodies = any(is_body(closure.node) for closure in self.closures)
            self.views, self.as_seen = differing_views(material.node_tree, for_camera, has_bodies)
            for view in self.views:
                probe = partial(self.probe, view)
                normal = partial(self.probe_normal, probe)
                combine(self.closures, probe, normal, seen_at(view, self.stand_in), view.walks)
            sources = tangent_sources(closure.shader for closure in self.closures)
            self.stretched = (sources[0] or TangentSource()) if sources else None
            if on_fibres and any(closure.kind in HAIR for closure in self.closures):
                self.stretched = TangentSource()
            self.needs_bake |= bool(self.pictures) and Grid.of(list(self.pictures.values())) is None
            if self.needs_bake:
                self.pictures = {key: one.mean for key, one in self.pictures.items()}

    def warn(self, what: str) -> None:
        self.warnings.add(f"Material '{self.name}': {what}.")

    def probe(self, view: View, place: Place) -> np.ndarray:
        """The value of a socket if it is constant; otherwise ½, having taken note of what it depends on."""
        depends: list[Place] = []
        try:
            value = Evaluator(lambda image: self.note(image, depends), self.stand_in, view).value(place)
        except UnreadableError:
            self.needs_bake = True
            depends.append(place)
            value = np.full_like(default_value(place.socket), 0.5)
        if depends:
            self.varying[place] = None
        return value

    def probe_normal(self, probe: Value, place: Place) -> OwnNormal | None:
        """A stand-in for the normals of a socket, having taken note of what they depend on."""
        noted = Evaluator(lambda image: self.note(image, []), self.stand_in).value
        try:
            return self.normals.probe(place, probe, noted)
        except UnreadableError:
            self.needs_bake = True
            return None

    def read(self, values: Values) -> dict[Reading, np.ndarray]:
        """What it reads of an object; zero where that is not known."""
        found = {}
        for one in self.readings:
            value = values(one)
            if self.material and one == _MATERIAL_INDEX:
                value = np.full(4, self.material.pass_index, np.float32)
            found[one] = np.zeros(4, np.float32) if value is None else value
        return found

    @staticmethod
    def stand_in(reading: Reading) -> np.ndarray:
        """A value that an object may have."""
        return np.full(4, 0.5, np.float32)

    def note(self, image: Place, depends: list[Place]) -> np.ndarray:
        """A stand-in for an image's pixels."""
        depends.append(image)
        if _key(image) not in self.pictures:
            self.pictures[_key(image)] = self.picture(image)
        return np.full((1, 1, 4), 0.5, np.float32)

    def picture(self, image: Place) -> Picture:
        """What an image node shows, or a Hair Info node on hair; on meshes Cycles bakes what that says."""
        node = image.socket.node
        if node.type == "HAIR_INFO":
            if not self.on_fibres:
                raise UnreadableError(node)
            return picture_of_strands()
        coordinates = coordinates_of(image)
        alpha_is_used = node.outputs["Alpha"].is_linked
        pixels = self.images.read(node.image, alpha_is_used, node.interpolation, node.extension)
        return Picture(pixels, node.extension, coordinates)

    def seen(self, read: dict[Reading, np.ndarray]) -> Seen:
        """The material without a bake, on an object of which it reads some values."""
        seen = Seen([self.surface(read, view) for view in self.views], self.as_seen, self.on_fibres, self.volume)
        if not self.readings:
            self.pictures.clear()
        return seen

    def surface(self, read: dict[Reading, np.ndarray], view: View) -> Surface:
        """One of its views without a bake."""
        if not self.closures:
            return self.made_of(self.without_closures())
        grid = Grid.of(list(self.pictures.values())) if self.pictures and not self.needs_bake else None
        if grid is None:

            def guess(place: Place) -> np.ndarray:
                return self.guess(place, read, view)

            def normal(place: Place) -> OwnNormal | None:
                return self.normals.read(place, guess, True)

            return self.made_of(combine(self.closures, guess, normal, seen_at(view, read.get), view.walks))
        evaluator = Evaluator(lambda image: grid.look_up(self.pictures[_key(image)]), read.get, view)
        coordinates = grid.place(next(iter(self.pictures.values())).coordinates)
        value, extends = evaluator.value, grid.extends

        def normal_of(place: Place) -> OwnNormal | None:
            return self.normals.read(place, value, extends)

        total = combine(self.closures, value, normal_of, seen_at(view, read.get), view.walks)
        return self.made_of(total, coordinates, extends)

    def made_of(self, total: ShaderSum, coordinates: Coordinates | None = None, extends: bool = False) -> Surface:
        """The material of what its shaders add up to."""
        stand_in = on_fibres if self.on_fibres else on_surfaces
        total.terms = [other for term in total.terms for other in stand_in(term)]
        return Surface.of(self.name, total, self.images, coordinates, extends)

    def without_closures(self) -> ShaderSum:
        """Cycles' grey without a material, its viewport colour without nodes, and black with an empty output."""
        if self.material is None:
            return matte((DEFAULT_GREY,) * 3)
        if not uses_nodes(self.material):
            return matte(self.material.diffuse_color[:3])
        output = output_node(self.material)
        volume_alone = output and has_volume(self.material) and not source(output.inputs["Surface"])
        return ShaderSum(transparent=np.full((1, 1, 3), float(bool(volume_alone)), np.float32))

    def guess(self, place: Place, read: dict[Reading, np.ndarray], view: View) -> np.ndarray:
        """The value of a socket, or what its own field says where nodes that cannot be read make it."""
        try:
            return Evaluator(self.mean_of_picture, read.get, view).value(place)
        except UnreadableError:
            return default_value(place.socket)

    def mean_of_picture(self, image: Place) -> np.ndarray:
        if _key(image) not in self.pictures:
            raise UnreadableError(image.socket.node)
        return self.pictures[_key(image)].pixels

    def appearance(self, obj: "bpy.types.Object", mesh: "bpy.types.Mesh") -> tuple:
        """Equal for objects on which the material looks the same."""
        assert self.material is not None
        sees = sees_object(self.material.node_tree)
        return mesh.as_pointer(), obj.original.session_uid if sees else 0

    def pending(
        self, obj: "bpy.types.Object", mesh: "bpy.types.Mesh", read: dict[Reading, np.ndarray]
    ) -> "PendingMaterial | Seen":
        """The material on an object of which it reads some values, to be baked later."""
        assert self.material is not None
        matrix = np.array(obj.matrix_world, np.float64)
        atlas = make_atlas(mesh, _faces_of(obj, mesh, self.material), matrix)
        if atlas is None:
            self.warn_of_guess(f"the mesh of '{obj.name}' has too many faces to bake its nodes")
            return self.seen(read)
        wanted = [*self.varying, *self.normals.to_bake]
        request = BakeRequest(self.material.original, wanted, mesh, obj.original, matrix, atlas, read)
        return PendingMaterial(self, request)

    def warn_of_guess(self, why: str) -> None:
        self.warn(f"{why}, so the fields of its sockets are baked instead")

    def baked(self, request: BakeRequest) -> Seen:
        """The material as Cycles evaluates it on an object."""
        try:
            rows = [self.baked_view(replace(request, view=view)) for view in self.views]
        except CyclesError as error:
            self.warn_of_guess(f"its nodes cannot be baked ({error})")
            return self.seen(request.values)
        return Seen(rows, self.as_seen, volume=self.volume)

    def baked_view(self, request: BakeRequest) -> Surface:
        """One of its views as Cycles evaluates it on an object."""
        values = dict(zip(request.places, bake_values(request), strict=True))
        evaluator = Evaluator(no_images, request.values.get, request.view)

        def value(place: Place) -> np.ndarray:
            return values[place] if place in values else evaluator.value(place)

        def normal(place: Place) -> OwnNormal | None:
            return self.normals.baked(place, values, value, request.matrix)

        view = request.view
        total = combine(self.closures, value, normal, seen_at(view, request.values.get), view.walks)
        return self.made_of(total, Coordinates(atlas=request.atlas), extends=True)


@dataclass(frozen=True)
class PendingMaterial:
    """A material that has to be baked."""

    reader: MaterialReader
    request: BakeRequest

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(atlas=self.request.atlas)

    def seen(self) -> Seen:
        return self.reader.baked(self.request)


_MATERIAL_INDEX = Reading("INFO", "Material Index")


def _key(image: Place) -> tuple:
    return image.socket.node, image.groups


def _faces_of(obj: "bpy.types.Object", mesh: "bpy.types.Mesh", material: "bpy.types.Material") -> np.ndarray:
    """Which faces of an evaluated object have a material, (f,) bool; all where it is not in a slot."""
    slot = attribute(mesh, "material_index", "value", (len(mesh.polygons),), np.int32)
    has = np.array([one.material == material for one in obj.material_slots], bool)
    return has[np.clip(slot, 0, len(has) - 1)] if has.any() else np.ones(len(slot), bool)
