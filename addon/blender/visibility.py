"""Which objects a render shows.

A dependency graph of the viewport leaves out what is hidden in the viewport, and shows what is hidden from renders.
The second is put right here. The first cannot be: Python can evaluate no other graph without a render, so objects that
a render would show but that are hidden in the viewport are left out of the bake, and a warning names them. So it does
those whose modifiers make something else of them in renders.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import bpy

from .warn import Warnings, listed

RAYS = ("diffuse", "shadow", "glossy", "transmission", "camera")
"""The kinds of rays that an object may be hidden from, in Blender's words. Masks have a bit each, from the lowest."""

ALL_RAYS, LIGHT_RAYS = 0b11111, 0b01111
"""Masks of all, and of those that light goes along: what the camera alone sees, lights nothing."""

NOT_READ = {"CURVES", "POINTCLOUD", "VOLUME"}
"""Types of objects, and of what geometry nodes make, that Cycles renders and no bake shows."""


@dataclass(frozen=True)
class ObjectVisibility:
    """What all instances of an object, or all that it instances, have in common.

    Attributes
    ----------
    original : bpy.types.Object
    shown : bool
        Renders show it, or what it instances.
    solid : bool
        Its own geometry counts, and not only what it instances.
    instances_collection : bool
        It is an instance of a collection, and shows what renders show of the collection.
    rays : int
        Mask of the `RAYS` that see it.
    """

    original: "bpy.types.Object"
    shown: bool
    solid: bool
    instances_collection: bool
    rays: int

    @cached_property
    def in_collection(self) -> bool:
        """Whether renders show its own geometry in instances of its collections."""
        homes = self.original.users_collection
        hidden = bool(homes) and all(home.hide_render for home in homes)
        return self.solid and not self.original.hide_render and not hidden

    @cached_property
    def instanced_by_parent(self) -> bool:
        """Whether its parent instances it on vertices or faces; renders then show the instances and not it itself."""
        parent = self.original.parent
        return parent is not None and parent.instance_type in {"VERTS", "FACES"}

    def rays_through(self, parent: "ObjectVisibility | None") -> int | None:
        """Mask of the `RAYS` that see an instance made by `parent`; None where renders do not show it at all."""
        if parent is None or parent.original == self.original:
            return self.rays if self.shown and self.solid and not self.instanced_by_parent else None
        # A collection's instance shows what renders show of the collection; points and particles show even the
        # instances of an object that is hidden itself.
        if not parent.shown or (parent.instances_collection and not self.in_collection):
            return None
        return self.rays & parent.rays


class RenderVisibility:
    """What a render of a dependency graph's view layer shows.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
        The original one, not its evaluated copy.
    """

    def __init__(self, view_layer: "bpy.types.ViewLayer") -> None:
        self._in_view_layer = _render_visible(view_layer.layer_collection)

    def shows(self, obj: "bpy.types.Object") -> bool:
        """Whether renders show an original object of the view layer."""
        return not obj.hide_render and obj.as_pointer() in self._in_view_layer

    def of(self, obj: "bpy.types.Object") -> ObjectVisibility:
        """The visibility of an evaluated object."""
        instancer = obj.is_instancer or len(obj.particle_systems) > 0
        return ObjectVisibility(
            original=obj.original,
            shown=self.shows(obj.original),
            solid=not instancer or obj.show_instancer_for_render,
            instances_collection=obj.original.instance_type == "COLLECTION",
            rays=sum(getattr(obj, f"visible_{ray}") << bit for bit, ray in enumerate(RAYS)),
        )

    def warn_of_missing(self, view_layer: "bpy.types.ViewLayer", warnings: Warnings) -> None:
        """Name the objects that renders show and the viewport hides."""
        kinds = {"MESH", "LIGHT", "CURVE", "SURFACE", "FONT", "META", "EMPTY"}
        objects = [
            obj
            for obj in view_layer.objects
            if obj.type in kinds and self.shows(obj) and hidden_in_viewport(obj, view_layer)
        ]
        objects = [obj for obj in objects if obj.type != "EMPTY" or obj.is_instancer]
        if objects:
            names = listed([f"'{obj.name}'" for obj in objects])
            warnings.add(
                f"{len(objects)} object(s) that renders show are hidden in the viewport and were left out of the "
                f"bake ({names}): show them in the viewport to bake with them."
            )


def warn_of_modifiers(objects: Iterable["bpy.types.Object"], scene: "bpy.types.Scene", warnings: Warnings) -> None:
    """Name the modifiers of original objects that do something else in renders than in the viewport."""
    names = [
        f"'{modifier.name}' of '{obj.name}'"
        for obj in objects
        for modifier in obj.modifiers
        if _differs(modifier, scene.render)
    ]
    if names:
        warnings.add(
            f"{len(names)} modifier(s) differ in renders and were baked as the viewport shows them ({listed(names)}): "
            "give them the same visibility, levels and amounts in both."
        )


def _differs(modifier: "bpy.types.Modifier", render: "bpy.types.RenderSettings") -> bool:
    """Whether a modifier does something else in renders than in the viewport."""
    if modifier.show_render != modifier.show_viewport:
        return True
    if not modifier.show_render:
        return False
    if modifier.type in {"SUBSURF", "MULTIRES"}:
        levels, render_levels = modifier.levels, modifier.render_levels
        if render.use_simplify:
            levels = min(levels, render.simplify_subdivision)
            render_levels = min(render_levels, render.simplify_subdivision_render)
        return levels != render_levels
    return modifier.type == "PARTICLE_SYSTEM" and _shows_fewer(modifier.particle_system.settings)


def _shows_fewer(particles: "bpy.types.ParticleSettings") -> bool:
    """Whether the viewport shows other numbers of instances of a particle system than renders."""
    if particles.render_type not in {"OBJECT", "COLLECTION"}:
        return False
    children = particles.child_type != "NONE" and particles.child_percent != particles.rendered_child_count
    return children or particles.display_percentage < 100


def warn_of_hair(objects: Iterable["bpy.types.Object"], warnings: Warnings) -> None:
    """Name the objects whose hair, points or volume is not baked."""
    names = [f"'{obj.name}'" for obj in objects]
    if names:
        warnings.add(
            f"{len(names)} object(s) have hair, points or a volume that is not baked ({listed(names)}): make meshes "
            "of them to bake with them."
        )


def has_hair(obj: "bpy.types.Object") -> bool:
    """Whether renders show hair of an object's particle systems."""
    systems = [one.particle_system for one in obj.modifiers if one.type == "PARTICLE_SYSTEM" and one.show_render]
    return any(one.settings.type == "HAIR" and one.settings.render_type == "PATH" for one in systems)


def hidden_in_viewport(obj: "bpy.types.Object", view_layer: "bpy.types.ViewLayer") -> bool:
    """Whether a view layer's viewport, and so its dependency graph, leaves an object out."""
    return not obj.visible_get(view_layer=view_layer)


def _render_visible(root: "bpy.types.LayerCollection") -> set[int]:
    """Pointers of the objects in collections that renders show."""
    found: set[int] = set()
    stack = [root]
    while stack:
        layer = stack.pop()
        if layer.collection.hide_render:
            continue
        if not layer.exclude:
            found.update(obj.as_pointer() for obj in layer.collection.objects)
        stack.extend(layer.children)
    return found
