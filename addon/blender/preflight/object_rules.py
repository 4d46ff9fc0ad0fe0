"""What keeps objects from light, or from light of their own."""

from collections import Counter
from collections.abc import Callable, Iterator
from itertools import groupby

import bpy
import numpy as np

from ...settings.lightmap import MADE_UV_MAP
from ..lightmap.meshes import MAX_UV_MAPS
from ..read.materials.nodes import all_nodes
from ..read.meshes.modifiers import COPIES_FACES, active_modifiers
from ..write.baked_copies import HIDE_RENDER
from .asked import Asked
from .found import Found, of_objects

NOT_MESHES = {"CURVE", "SURFACE", "FONT", "META"}
"""Types of objects that renders make meshes of."""

_NEW_MESH = {"REMESH", "SKIN"}
"""Modifiers that leave nothing of the mesh that they are given."""

_FEW_FACES = 100
_LARGE = 0.4
"""An object of fewer faces whose size is more than this share of the scene's is too coarse for light on vertices."""

_SPARE_NODES = {"GeometryNodeRealizeInstances"}


def is_copied(obj: "bpy.types.Object") -> bool:
    """Whether an object that is no mesh gets light in a copy, if copies are made."""
    return _shows_surface(obj) or _is_instancer(obj)


def _shows_surface(obj: "bpy.types.Object") -> bool:
    """Whether renders make a mesh of an object that is none: a curve may be but a path."""
    if obj.type != "CURVE":
        return obj.type in NOT_MESHES
    curve = obj.data
    filled = curve.dimensions == "2D" and curve.fill_mode != "NONE"
    return bool(filled or curve.bevel_depth or curve.extrude or curve.bevel_object or obj.modifiers)


def _is_instancer(obj: "bpy.types.Object") -> bool:
    if obj.instance_type == "COLLECTION":
        return obj.instance_collection is not None
    if obj.instance_type in {"VERTS", "FACES"}:
        return bool(obj.children)
    for modifier in obj.modifiers:
        if not modifier.show_render:
            continue
        if modifier.type == "PARTICLE_SYSTEM":
            if modifier.particle_system.settings.render_type in {"OBJECT", "COLLECTION"}:
                return True
        elif modifier.type == "NODES" and modifier.node_group:
            kinds = {node.bl_idname for node in all_nodes(modifier.node_group)}
            if "GeometryNodeInstanceOnPoints" in kinds and not kinds & _SPARE_NODES:
                return True
    return False


def _no_faces(asked: Asked) -> list[Found]:
    objects = [obj for obj in asked.meshes if not len(obj.data.polygons) and not obj.modifiers]
    return of_objects(objects, "no faces", "There is no surface to light.", get="no light")


def _no_scale(asked: Asked) -> list[Found]:
    flat = [obj for obj in asked.meshes if abs(obj.matrix_world.determinant()) < 1e-12]
    return of_objects(flat, "no scale along an axis", "Give them a scale (N panel > Item > Scale).", get="no light")


def _not_meshes(asked: Asked) -> list[Found]:
    if asked.copies and asked.targets == {"vertex"}:
        return []
    objects = [obj for obj in asked.chosen if _shows_surface(obj)]
    remedies = ("bake_copies", "convert") if "vertex" in asked.targets else ("convert",)
    return of_objects(
        objects,
        "not a mesh",
        "Texts, curves and metaballs store no light: they need a mesh.",
        *remedies,
        get="no light",
    )


def _instancers(asked: Asked) -> list[Found]:
    if asked.copies and "vertex" in asked.targets:
        return []
    objects = [obj for obj in asked.chosen if _is_instancer(obj)]
    why = "Instances show the light of the object that they are made of."
    return of_objects(objects, "instances", why, *_copies(asked))


def _shared(asked: Asked) -> list[Found]:
    if asked.copies or "vertex" not in asked.targets:
        return []
    users = Counter(obj.data for obj in asked.meshes)
    objects = [obj for obj in asked.meshes if users[obj.data] > 1]
    why = "A mesh has one light: objects that share it get the mean of theirs."
    return of_objects(objects, "shared meshes", why, "bake_copies", "single_user")


def _modifiers(asked: Asked) -> list[Found]:
    if asked.copies or "vertex" not in asked.targets:
        return []
    pairs: list[tuple[str, bpy.types.Object]] = []
    new: list[tuple[str, bpy.types.Object]] = []
    for obj in asked.meshes:
        for modifier in active_modifiers(obj, "RENDER"):
            label = modifier.bl_rna.name.removesuffix(" Modifier")
            if modifier.type in _NEW_MESH or (modifier.type == "OCEAN" and modifier.geometry_mode == "GENERATE"):
                new.append((label, obj))
                break
            if modifier.type in COPIES_FACES:
                pairs.append((label, obj))
                break
    found: list[Found] = []
    for label, objects in _by_label(new):
        why = f"{label} makes a new mesh that shows no light of the old one: copies do, or apply it."
        found += of_objects(objects, label, why, "bake_copies", get="no light")
    for label, objects in _by_label(pairs):
        why = f"{label} copies faces, which show the same light in several places; copies have their own."
        found += of_objects(objects, label, why, "bake_copies")
    return found


def _by_label(pairs: "list[tuple[str, bpy.types.Object]]") -> "Iterator[tuple[str, list[bpy.types.Object]]]":
    for label, group in groupby(sorted(pairs, key=lambda pair: pair[0]), key=lambda pair: pair[0]):
        yield label, [obj for _, obj in group]


def _linked(asked: Asked) -> list[Found]:
    objects = [obj for obj in asked.meshes if not obj.data.is_editable]
    makes_uv = "lightmap" in asked.targets and not asked.lightmap.uv_map
    if not objects or not (makes_uv or ("vertex" in asked.targets and not asked.copies)):
        return []
    why = "Meshes of other files cannot store light: make them local, or bake copies."
    return of_objects(objects, "linked", why, "make_local", *_copies(asked), get="no light")


def _coarse(asked: Asked) -> list[Found]:
    if "vertex" not in asked.targets or not asked.meshes:
        return []
    sizes = np.array([max(obj.dimensions) for obj in asked.meshes])
    corners = np.array([obj.matrix_world.translation for obj in asked.meshes])
    whole = max(float(sizes.max()), float(np.ptp(corners, axis=0).max()))
    objects = [
        obj
        for obj, size in zip(asked.meshes, sizes, strict=True)
        if 0 < len(obj.data.polygons) < _FEW_FACES and size > _LARGE * whole and not obj.modifiers
    ]
    why = "Light is stored at vertices and fades evenly between: large faces need more of them, or lightmaps."
    return of_objects(objects, "few vertices", why, "refine", "to_lightmaps")


def _uv_maps(asked: Asked) -> list[Found]:
    name = asked.lightmap.uv_map
    if "lightmap" not in asked.targets:
        return []
    if name:
        objects = [obj for obj in asked.meshes if len(obj.data.polygons) and name not in obj.data.uv_layers]
        why = f"They have no UV map '{name}'."
        return of_objects(objects, f"no UV map '{name}'", why, "make_uv_map", get="refused")
    full = [
        obj for obj in asked.meshes if len(obj.data.uv_layers) >= MAX_UV_MAPS and MADE_UV_MAP not in obj.data.uv_layers
    ]
    return of_objects(full, f"{MAX_UV_MAPS} UV maps", "There is no room for one more: remove one.", get="no light")


def _attribute(asked: Asked) -> list[Found]:
    if "vertex" not in asked.targets:
        return []
    objects = [obj for obj in asked.meshes if asked.attribute in obj.vertex_groups]
    why = f"They have a vertex group '{asked.attribute}': choose another name for the attribute."
    return of_objects(objects, "name is taken", why, get="refused")


def _hidden(asked: Asked) -> list[Found]:
    if not asked.targets:
        return []
    shown = set(asked.shown)
    objects = [
        obj
        for obj in asked.view_layer.objects
        if obj is not None
        and obj.type == "MESH"
        and obj not in shown
        and obj.display_type not in {"WIRE", "BOUNDS"}
        and HIDE_RENDER not in obj
        and len(obj.data.polygons)
        and obj.visible_get(view_layer=asked.view_layer)
        and (not asked.selected_only or obj.select_get(view_layer=asked.view_layer))
    ]
    why = "The viewport shows them and renders do not: they neither get light nor block it."
    return of_objects(objects, "hidden in renders", why, "show_in_renders", get="no light")


def _no_material(asked: Asked) -> list[Found]:
    objects = [
        obj for obj in asked.meshes if len(obj.data.polygons) and not any(slot.material for slot in obj.material_slots)
    ]
    return of_objects(objects, "no material", "They are baked as 0.8 gray.", "add_material")


def _copies(asked: Asked) -> tuple[str, ...]:
    return ("bake_copies",) if "vertex" in asked.targets else ()


def _of_objects(rule: Callable[[Asked], list[Found]]) -> Callable[[Asked], list[Found]]:
    """A rule that says nothing of a camera alone."""
    return lambda asked: rule(asked) if asked.targets & {"vertex", "lightmap"} else []


RULES: tuple[Callable[[Asked], list[Found]], ...] = (
    *map(_of_objects, (_no_faces, _no_scale, _not_meshes, _linked, _uv_maps, _attribute, _hidden, _modifiers)),
    *map(_of_objects, (_instancers, _shared, _coarse)),
    _no_material,
)
