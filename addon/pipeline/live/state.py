"""A scene as live light holds it: what edits change, and what of it stays as it was."""

from dataclasses import fields, replace
from typing import Any

import numpy as np

from ...core.progress import Progress
from ...scene import Channel, Lights, Materials, Scene, SceneObjects, World
from ...tracing import EmbreeTracer, TransparencyTracer

OF_SURFACES = ("bounds", "diagonal", "_normals_and_areas", "smooth", "packed_normals", "height_errors")
"""What a scene has found out about its triangles alone."""


def lit_otherwise(scene: Scene, lights: Lights | None = None, world: World | None = None) -> Scene:
    """The same surfaces under other lamps, or another world."""
    lights = scene.lights if lights is None else lights  # of no lamps is false, too
    changed = replace(scene, lights=lights, world=world or scene.world)
    return _knowing(changed, scene, (*OF_SURFACES, "arrays", "shines"))


def made_otherwise(scene: Scene, materials: Materials) -> Scene:
    """The same triangles of other materials, in the same rows."""
    return _knowing(replace(scene, materials=materials), scene, OF_SURFACES)


def with_objects(scene: Scene, objects: SceneObjects) -> Scene:
    """The same triangles of objects that are seen, or shine, otherwise."""
    return _knowing(replace(scene, objects=objects), scene, OF_SURFACES)


def _knowing(scene: Scene, other: Scene, names: tuple[str, ...]) -> Scene:
    for name in names:
        if name in other.__dict__:
            scene.__dict__[name] = other.__dict__[name]
    return scene


def paths_stay(old: Materials, new: Materials) -> bool:
    """Whether rays go the same ways through new materials: where light passes straight through and is mirrored.

    Colours of what is matte and emission may differ.
    """
    if len(old) != len(new) or (old.directional | new.directional | old.see_through | new.see_through).any():
        return _same(old, new)
    return bool((old.seen_as == new.seen_as).all())


def _same(old: Materials, new: Materials) -> bool:
    """Whether all is as it was but for the colours of materials that neither mirror nor let light through."""
    if len(old) != len(new) or (old.seen_as != new.seen_as).any() or len(old.closures.kind) != len(new.closures.kind):
        return False
    a, b = old.closures, new.closures
    narrow = old.narrow[a.material] | new.narrow[b.material]
    columns: list[tuple[np.ndarray, np.ndarray]] = [(a.kind, b.kind), (a.material, b.material)]
    for channel in ("coverage", "tint"):
        one, other = getattr(old, channel), getattr(new, channel)
        columns += [(one.value, other.value), (one.texture, other.texture)]
    for channel in ("weight", "roughness", "f0", "f90"):
        columns.append((getattr(a, channel).value[narrow], getattr(b, channel).value[narrow]))
    return all(x.shape == y.shape and bool((x == y).all()) for x, y in columns)


def lights_stay(old: Materials, new: Materials) -> bool:
    """Whether direct light on surfaces is the same under new materials where `paths_stay`."""
    return not (old.emits | new.emits | old.perturbed | new.perturbed).any()


def painted(old: Materials, new: Materials) -> np.ndarray:
    """Which materials may look otherwise than before, (m,) bool."""
    every, a, b = np.ones(len(new), bool), old.closures, new.closures
    if old.textures is not new.textures or len(old) != len(new) or not np.array_equal(a.start, b.start):
        return every
    if (old.seen_as != new.seen_as).any() or not np.array_equal(a.angles.curves, b.angles.curves):
        return every
    of_closure = a.angles.of_closure != b.angles.of_closure
    for one, other in ((getattr(a, of.name), getattr(b, of.name)) for of in fields(a) if of.name != "start"):
        for x, y in _columns(one, other):
            of_closure |= (x != y).reshape(len(of_closure), -1).any(axis=1)
    rows = np.bincount(b.material[of_closure], minlength=len(new)) > 0
    for name in ("coverage", "tint"):
        for x, y in _columns(getattr(old, name), getattr(new, name)):
            rows |= (x != y).reshape(len(new), -1).any(axis=1)
    return new.of_any_view(rows)


def _columns(one: Any, other: Any) -> list[tuple[np.ndarray, np.ndarray]]:
    if isinstance(one, Channel):
        return [(one.value, other.value), (one.texture, other.texture)]
    return [(one, other)] if isinstance(one, np.ndarray) else []


def tracer_of(scene: Scene, progress: Progress) -> TransparencyTracer:
    """What rays are traced with, built anew."""
    return TransparencyTracer(scene, EmbreeTracer(scene), progress)
