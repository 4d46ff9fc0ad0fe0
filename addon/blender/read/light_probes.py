"""Where a scene wants light probes: in its light probe volumes, at empties, or all over."""

from collections.abc import Sequence

import bpy
import numpy as np

from ...core.errors import Advice, BakeError
from ...receivers import ProbeGrid, ProbePlaces, grid_in_box, without_surroundings
from ...settings.probes import ProbeSettings
from ..warn import Warnings, listed
from .visibility import objects_of, shown_objects

_OF_VOLUME = np.array([[2, 0, 0, -1], [0, 2, 0, -1], [0, 0, 2, -1], [0, 0, 0, 1]], np.float64)
"""From a texture's coordinates to those of a light probe volume, which reaches from −1 to 1."""


def probe_places(
    depsgraph: "bpy.types.Depsgraph", names: list[str] | None, settings: ProbeSettings, warnings: Warnings
) -> ProbePlaces:
    """Where the scene that a graph shows wants probes.

    Parameters
    ----------
    names : list of str or None
        Objects whose bounds are filled where there is nothing that says where probes lie; None: all that are shown.

    Raises
    ------
    BakeError
        If there is nothing of the name that the settings give, or nothing to fill.
    """
    layer = objects_of(depsgraph.view_layer)
    if settings.place:
        return _named(depsgraph, layer, settings, warnings)
    volumes = [obj for obj in layer if _is_volume(obj) and not obj.hide_render]
    if volumes:
        return _of_volumes(depsgraph, volumes)
    shown = [obj for obj in shown_objects(depsgraph) if obj.type == "MESH" and (names is None or obj.name in names)]
    if not shown:
        raise BakeError(
            "No mesh object is rendered, so there is nothing that probes could fill: add a light probe volume."
        )
    return _filling("Scene", depsgraph, shown, settings, warnings)


def _named(
    depsgraph: "bpy.types.Depsgraph",
    layer: "Sequence[bpy.types.Object]",
    settings: ProbeSettings,
    warnings: Warnings,
) -> ProbePlaces:
    """Probes where an object or a collection says."""
    name = settings.place
    objects = [obj for obj in layer if obj.name == name]
    if not objects and name in bpy.data.collections:
        inside = set(bpy.data.collections[name].all_objects)
        objects = [obj for obj in layer if obj in inside]
    if not objects:
        raise BakeError(
            f"There is no object or collection '{name}' with objects in the view layer for probes to lie at: "
            "give another name."
        )
    volumes = [obj for obj in objects if _is_volume(obj)]
    if volumes:
        return _of_volumes(depsgraph, volumes)
    boxes = [obj for obj in objects if obj.type == "EMPTY" and obj.empty_display_type == "CUBE"]
    if boxes and len(boxes) == len(objects):
        return ProbePlaces(tuple(_cube(depsgraph, obj, settings, warnings) for obj in boxes), (), np.zeros((0, 3)))
    empties = [obj for obj in objects if obj.type == "EMPTY"]
    if empties:
        at = np.array([_matrix(depsgraph, obj)[:3, 3] for obj in empties], np.float32)
        return ProbePlaces((), tuple(obj.name for obj in empties), at)
    return _filling(name, depsgraph, objects, settings, warnings)


def _is_volume(obj: "bpy.types.Object") -> bool:
    return bool(obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME")


def _matrix(depsgraph: "bpy.types.Depsgraph", obj: "bpy.types.Object") -> np.ndarray:
    return np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)


def _of_volumes(depsgraph: "bpy.types.Depsgraph", volumes: "Sequence[bpy.types.Object]") -> ProbePlaces:
    """As many probes as the volumes have themselves, where EEVEE has its own."""
    grids = []
    for obj in volumes:
        data = obj.data
        counts = (int(data.resolution_x), int(data.resolution_y), int(data.resolution_z))
        grids.append(ProbeGrid(obj.name, _matrix(depsgraph, obj) @ _OF_VOLUME, counts))
    return ProbePlaces(tuple(grids), (), np.zeros((0, 3), np.float32))


def _cube(
    depsgraph: "bpy.types.Depsgraph", obj: "bpy.types.Object", settings: ProbeSettings, warnings: Warnings
) -> ProbeGrid:
    """Probes in an empty that is drawn as a cube."""
    half = np.diag([*3 * [obj.empty_display_size], 1.0])
    matrix = _matrix(depsgraph, obj) @ half @ _OF_VOLUME
    sides = np.linalg.norm(matrix[:3, :3], axis=0)
    counts = grid_in_box(obj.name, (0, 0, 0), tuple(sides), settings.spacing, settings.max_probes).counts
    _warn_of_spacing(obj.name, sides, counts, settings, warnings)
    return ProbeGrid(obj.name, matrix, counts)


def _filling(
    name: str,
    depsgraph: "bpy.types.Depsgraph",
    objects: "Sequence[bpy.types.Object]",
    settings: ProbeSettings,
    warnings: Warnings,
) -> ProbePlaces:
    """Probes in the box around objects."""
    bounds = np.array([obj.evaluated_get(depsgraph).bound_box for obj in objects], np.float64)  # (objects, 8, 3)
    matrices = np.array([_matrix(depsgraph, obj) for obj in objects])
    corners = bounds @ matrices[:, :3, :3].swapaxes(1, 2) + matrices[:, None, :3, 3]
    keep = without_surroundings(corners.min(axis=1), corners.max(axis=1))
    left_out = [f"'{obj.name}'" for obj, kept in zip(objects, keep, strict=True) if not kept]
    if left_out:
        warnings.add(
            Advice(
                f"Probes do not fill all of {listed(left_out)}, which is far wider than the rest: "
                "add a light probe volume to have them elsewhere."
            )
        )
    low, high = corners[keep].min(axis=(0, 1)), corners[keep].max(axis=(0, 1))
    grid = grid_in_box(name, tuple(low), tuple(high), settings.spacing, settings.max_probes)
    _warn_of_spacing(name, high - low, grid.counts, settings, warnings)
    return ProbePlaces((grid,), (), np.zeros((0, 3), np.float32))


def _warn_of_spacing(
    name: str, sides: np.ndarray, counts: Sequence[int], settings: ProbeSettings, warnings: Warnings
) -> None:
    spacing = float((sides / np.array(counts)).max())
    if spacing > 1.01 * settings.spacing:
        warnings.add(
            Advice(
                f"Probes in '{name}' lie {spacing:.3g} m apart instead of {settings.spacing:.3g} m, as more than Max "
                "Probes would fill it: add a light probe volume where they are wanted, or raise Max Probes."
            )
        )
