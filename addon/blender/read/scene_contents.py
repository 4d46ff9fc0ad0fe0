"""What a dependency graph shows: its lamps, and its meshes with their materials and instances."""

from dataclasses import dataclass, field
from functools import partial

import bpy
import numpy as np

from ...core.progress import Progress
from ...scene import Lights
from ..warn import Warnings
from .hair.particles import hair_systems
from .hair.shapes import Fibres, fibres_of_curves, fibres_of_particles, fibres_of_points
from .lamps.lamp_nodes import LampNodes
from .lamps.lamps import in_light_group, light_group_of, read_lamp
from .lamps.light_links import Placed
from .materials.materials import READING, MaterialTable
from .meshes.instance_groups import alike, reads_by_instance
from .meshes.meshes import LocalMesh, count_triangles, evaluated_mesh, read_mesh, used_slots
from .meshes.object_values import ObjectValues, Reading, Values, random_of_name
from .render_graph import is_stand_in
from .visibility import ALL_RAYS, HAIR_OR_POINTS, LIGHT_RAYS, VOLUMES, rays_that_see

_SURFACES = {"MESH", *HAIR_OR_POINTS}
_ROWS = 256  # of instances, between two looks at the progress


@dataclass
class Source:
    """A mesh with its materials, and its instances; the lists have one entry an instance.

    Attributes
    ----------
    mesh : bpy.types.Mesh or Fibres
        With faces, or strands and points that stand for them.
    material_of_slot : dict of int to int
        Of the slots that faces use.
    rows : list of int
        Which of the dependency graph's instances they are.
    names : list of str
    rays : list of int
        Masks of the `RAYS` that see them.
    placed_by : list of Placed
    moves : list of bool
        Whether their own Motion Blur is on.
    """

    mesh: "bpy.types.Mesh | Fibres"
    material_of_slot: dict[int, int]
    rows: list[int] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    rays: list[int] = field(default_factory=list)
    placed_by: list[Placed] = field(default_factory=list)
    moves: list[bool] = field(default_factory=list)

    @property
    def n_vertices(self) -> int:
        return self.mesh.n_vertices if isinstance(self.mesh, Fibres) else len(self.mesh.vertices)

    @property
    def n_triangles(self) -> int:
        return self.mesh.n_triangles if isinstance(self.mesh, Fibres) else count_triangles(self.mesh)

    def place(self, row: int, name: str, rays: int, placed_by: Placed, moves: bool) -> None:
        """Add an instance."""
        self.rows.append(row)
        self.names.append(name)
        self.rays.append(rays)
        self.placed_by.append(placed_by)
        self.moves.append(moves)

    def local_mesh(self) -> LocalMesh:
        """Its triangles in its own space."""
        return self.mesh.read() if isinstance(self.mesh, Fibres) else read_mesh(self.mesh)


@dataclass
class _Look:
    """What the instances of an object with one data-block have in common.

    `source` is known once rays see one, and so is `hair`, that of its particle systems, where it `is_hairy`.

    Attributes
    ----------
    original : bpy.types.Object
    rays : int
        Mask of the `RAYS` that see it.
    moves : bool
        Whether its own Motion Blur is on.
    """

    kind: str
    name: str
    original: "bpy.types.Object"
    rays: int
    moves: bool = True
    known: bool = False
    source: Source | None = None
    is_hairy: bool = False
    hair: list[Source] | None = None


class SceneContents:
    """The lamps and meshes of a dependency graph, and the table that their materials are in.

    Of its instances there may be very many, and asking Blender is slow: what they have in common is asked once.
    """

    def __init__(
        self,
        depsgraph: "bpy.types.Depsgraph",
        materials: MaterialTable,
        light_group: str,
        for_camera: bool,
        warnings: Warnings,
    ) -> None:
        self.lights: list[Lights] = []
        self.lamps: list[bpy.types.Object] = []
        self.groups_of_lamps: list[str] = []
        self.nodes_of_lamps: list[LampNodes | None] = []
        self.clouds: list[tuple[bpy.types.Object, int]] = []
        self._depsgraph = depsgraph
        self._light_group = light_group
        self._counted_rays = ALL_RAYS if for_camera else LIGHT_RAYS
        self.materials = materials
        self._warnings = warnings
        self._looks: dict[tuple[bpy.types.Object, bpy.types.ID | None, int], _Look | None] = {}
        self._values_of_row: dict[int, dict[Reading, np.ndarray]] = {}
        self._parents: dict[bpy.types.Object, tuple[bpy.types.Object, int, bool]] = {}
        self._used_slots: dict[bpy.types.Mesh, list[int]] = {}
        self._for_render = depsgraph.mode == "RENDER"
        self._drawn = getattr(getattr(depsgraph.scene_eval, "cycles_curves", None), "shape", "RIBBONS")
        self._fibres: dict[bpy.types.ID, Fibres | None] = {}
        self._sources: dict[bpy.types.Mesh | Fibres, dict[tuple[int, ...], Source]] = {}

    @property
    def sources(self) -> list[Source]:
        """The sources of one mesh follow each other."""
        return [source for of_mesh in self._sources.values() for source in of_mesh.values()]

    def walk(self, progress: Progress, wanted: set[int] | None = None) -> None:
        """Find all there is, or what objects of some session ids are and instance."""
        self._tell_instances_apart()
        n = len(self._depsgraph.object_instances)
        for row, instance in enumerate(self._depsgraph.object_instances):
            if row % _ROWS == 0:
                progress.update(READING, row / n)
            if wanted is not None and not _is_of(instance, wanted):
                continue
            known = self._values_of_row.get(row, {})
            look = self._look(instance.object, known)
            if look is None or not (instance.show_self or look.is_hairy):
                continue
            parent, rays, moves = self._of_parent(instance.parent)
            placed_by, rays = (look.original, parent), look.rays & rays
            if look.is_hairy and instance.show_particles and rays & self._counted_rays:
                look.hair = self._hair(instance.object) if look.hair is None else look.hair
                for source in look.hair:
                    source.place(row, look.name, rays, placed_by, look.moves and moves)
            if not instance.show_self:
                continue
            if look.kind == "LIGHT":
                self._add_lamp(instance, look.name, placed_by)
            elif look.kind in VOLUMES and rays & self._counted_rays:
                self.clouds.append((look.original, row))
            elif look.kind in _SURFACES and rays & self._counted_rays:
                if not look.known:
                    values = ObjectValues.of(instance, dict(known))
                    look.known, look.source = True, self._source(instance.object, values)
                if look.source is not None:
                    look.source.place(row, look.name, rays, placed_by, look.moves and moves)

    def _look(self, obj: "bpy.types.Object", known: dict[Reading, np.ndarray]) -> _Look | None:
        """What is known of an evaluated object of which materials read some values; None where it is our own."""
        key = (obj.original, obj.data, id(known) if known else 0)
        if key not in self._looks:
            rays = rays_that_see(obj, self._depsgraph.view_layer)
            look = _Look(obj.type, obj.name, obj.original, rays, _moves(obj))
            look.is_hairy = obj.type == "MESH" and any(hair_systems(obj, self._for_render))
            self._looks[key] = None if is_stand_in(obj.original) else look
        return self._looks[key]

    def _tell_instances_apart(self) -> None:
        """Find what materials read that differs by instance; objects with very many values are told of."""
        if not reads_by_instance(bpy.data.materials):
            return
        for original, n, values_of_row in alike(self._depsgraph, self._differing):
            self._values_of_row |= values_of_row
            n_groups = len({id(values) for values in values_of_row.values()})
            if n > n_groups:
                self._warnings.add(
                    f"The instances of '{original.name}' look different by {n} values that their material reads of "
                    f"each, and are baked in {n_groups} groups that have the mean of theirs."
                )

    def _differing(self, obj: "bpy.types.Object") -> tuple[list[Reading], int]:
        """What the materials of an evaluated object read that differs by instance, and as how many it may be held."""
        of_slots = [self.materials.differing(material) for material in self._slots(obj)]
        readings = sorted({reading for readings, _ in of_slots for reading in readings})
        return readings, min((most for readings, most in of_slots if readings), default=0)

    def _add_lamp(self, instance: "bpy.types.DepsgraphObjectInstance", name: str, placed_by: Placed) -> None:
        if in_light_group(*placed_by, self._light_group):
            lamp = read_lamp(instance.object, np.array(instance.matrix_world, np.float64), name, self._warnings)
            n = len(lamp.lights)
            self.lights.append(lamp.lights)
            self.nodes_of_lamps += [lamp.nodes] * n
            self.lamps += [placed_by[0]] * n
            self.groups_of_lamps += [light_group_of(*placed_by)] * n

    def _of_parent(self, parent: "bpy.types.Object | None") -> "tuple[bpy.types.Object | None, int, bool]":
        """The original of an instance's parent, the mask of the `RAYS` that see what it instances, and whether that
        moves.
        """
        if parent is None:
            return None, ALL_RAYS, True
        if parent not in self._parents:
            rays = rays_that_see(parent, self._depsgraph.view_layer)
            self._parents[parent] = parent.original, rays, _moves(parent)
        return self._parents[parent]

    def _source(self, obj: "bpy.types.Object", values: Values) -> Source | None:
        """The source that an object's instances share with those of all others like it; None without surfaces."""
        if obj.type in HAIR_OR_POINTS:
            fibres = self._fibres_of(obj)
            return self._fibrous(obj, fibres, 0, values) if fibres is not None else None
        mesh = evaluated_mesh(obj, self._depsgraph)
        if not len(mesh.polygons):
            return None
        material_of_slot = self._material_of_slot(obj, mesh, values)
        return self._shared(mesh, material_of_slot)

    def _shared(self, mesh: "bpy.types.Mesh | Fibres", material_of_slot: dict[int, int]) -> Source:
        of_mesh = self._sources.setdefault(mesh, {})
        return of_mesh.setdefault(tuple(material_of_slot.values()), Source(mesh, material_of_slot))

    def _fibres_of(self, obj: "bpy.types.Object") -> Fibres | None:
        """What stands for an object's hair curves or point cloud; read once of each data-block."""
        if obj.data not in self._fibres:
            of = partial(fibres_of_curves, drawn=self._drawn) if obj.type == "CURVES" else fibres_of_points
            self._fibres[obj.data] = of(obj.data, obj.name, self._warnings)
        return self._fibres[obj.data]

    def _fibrous(self, obj: "bpy.types.Object", fibres: Fibres, slot: int, values: Values) -> Source:
        """The source of fibres with the material of an object's slot."""
        slots = self._slots(obj)
        material = self.materials.add_on_fibres(slots[min(slot, len(slots) - 1)], fibres.values(values))
        return self._shared(fibres, {0: material})

    def _hair(self, obj: "bpy.types.Object") -> list[Source]:
        """The sources of an object's particle systems."""
        found = []
        for modifier in hair_systems(obj, self._for_render):
            fibres = fibres_of_particles(obj, modifier, self._for_render, self._drawn, self._warnings)
            if fibres is not None:
                slot = max(modifier.particle_system.settings.material - 1, 0)
                values = ObjectValues(obj, tuple(obj.matrix_world.translation), random_of_name(obj.name))
                found.append(self._fibrous(obj, fibres, slot, values))
        return found

    def _slots(self, obj: "bpy.types.Object") -> "list[bpy.types.Material | None]":
        """The materials of an evaluated object's slots."""
        override = self._depsgraph.view_layer.material_override
        return [override] if override else [slot.material for slot in obj.material_slots] or [None]

    def _material_of_slot(self, obj: "bpy.types.Object", mesh: "bpy.types.Mesh", values: Values) -> dict[int, int]:
        """Material of each slot that an object's faces use. Slots past the last one mean the last."""
        if mesh not in self._used_slots:
            self._used_slots[mesh] = used_slots(mesh)
        slots = self._slots(obj)
        return {
            used: self.materials.add(slots[min(used, len(slots) - 1)], obj, mesh, values)
            for used in self._used_slots[mesh]
        }


def _is_of(instance: "bpy.types.DepsgraphObjectInstance", wanted: set[int]) -> bool:
    """Whether an instance is an object of some session ids, or one of them has it."""
    by = instance.parent
    return instance.object.original.session_uid in wanted or (by is not None and by.original.session_uid in wanted)


def _moves(obj: "bpy.types.Object") -> bool:
    """Whether the Motion Blur of an evaluated object is on; asking an original would store its defaults in the file."""
    return bool(getattr(getattr(obj, "cycles", None), "use_motion_blur", True))
