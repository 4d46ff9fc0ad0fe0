"""A scene as live light holds it: what edits change, and what of it stays as it was."""

from dataclasses import replace

import numpy as np

from ...core.progress import Progress
from ...scene import Lights, Materials, Scene, World
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


def tracer_of(scene: Scene, progress: Progress) -> TransparencyTracer:
    """What rays are traced with, built anew."""
    return TransparencyTracer(scene, EmbreeTracer(scene), progress)
