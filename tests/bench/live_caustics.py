"""Measures live light's photons: which of them an edit touches in Larsen and Christensen's two rooms, and caustics.

    python tests/bench/run.py --only live_caustics

The rooms are those of their Figure 5: divided with two lamps each, connected by a door, and connected with the lamps of
the east one turned off. A ball of glass and a mirror in each make the caustics that photons are for. The ball of glass
and the ring of gold are those of --only caustics; there live light is compared with bakes as by --only live.
"""

from dataclasses import replace

import caustics
import live
import numpy as np
from figures import rendered_scene, table
from light_volume import material
from photon_bake.addon.pipeline.live import LampsChanged, Live, ObjectMoved, live_surfaces
from photon_bake.addon.pipeline.live.transport.links import KEPT as LINK_KEPT
from photon_bake.addon.settings.live import LiveSettings
from scene_parts import ball, box, bpy, lamp, matte, room, wall_with_hole

WALL = 4.0  # m, x of the wall between the rooms
HEAD = ["Rooms", "Edit in the west room", "Groups of photons: west", "east", "Photons", "Links: west", "east"]
HEAD += ["Vertices whose direct light changed: west", "east"]
live.EDITED["ball and ring"] = ("Point", "Sphere", "Diffuse")


def rooms(connected, lit=(True, True)):
    """Two rooms of 4 × 4 × 3 m, side by side along x; each with two lamps, if it is lit."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    white, red, blue = matte("White", 0.75, 0.75, 0.72), matte("Red", 0.6, 0.12, 0.08), matte("Blue", 0.1, 0.2, 0.55)
    glass = material("Glass", Roughness=0, IOR=1.5)
    mirror = material("Anisotropic", Color=(0.9, 0.9, 0.9, 1), Roughness=0)
    room((8, 4, 3), floor=white, walls=white, west=red, east=blue)
    if connected:
        wall_with_hole("Between", 0, (WALL - 0.05, WALL + 0.05), (0, 4), (0, 3), (1.5, 2.5, 0, 2.1), white)
    else:
        box("Between", (WALL - 0.05, 0, 0), (WALL + 0.05, 4, 3), white)
    for k, (name, is_lit) in enumerate(zip(("West", "East"), lit, strict=True)):
        x = k * WALL
        ball(f"{name} Ball", (x + 1.3, 1.2, 0.9), 0.25, glass, 64, 31)
        box(f"{name} Foot", (x + 1.15, 1.05, 0), (x + 1.45, 1.35, 0.62), white)
        box(f"{name} Mirror", (x + 0.8, 3.9, 0.5), (x + 2.8, 3.95, 2.3), mirror)
        box(f"{name} Box", (x + 2.6, 0.8, 0), (x + 3.1, 1.3, 0.8), red)
        if is_lit:
            lamp(f"{name} Lamp 1", "POINT", (x + 1.2, 1.0, 2.6), 60, (1, 0.9, 0.8), shadow_soft_size=0.05)
            lamp(f"{name} Lamp 2", "POINT", (x + 2.8, 2.8, 2.6), 60, (0.8, 0.9, 1), shadow_soft_size=0.05)
    return rendered_scene()


def edits_in_the_west(scene):
    """What is edited there, one after the other."""
    names = scene.objects.names
    move = np.eye(4)
    move[:3, 3] = 0.3, 0.4, 0
    yield "box moved", ObjectMoved(names.index("West Box"), move)
    yield "ball of glass moved", ObjectMoved(names.index("West Ball"), move)
    i, position = scene.lights.names.index("West Lamp 1"), scene.lights.position.copy()
    position[i, 1] += 0.3
    yield "lamp moved", LampsChanged(replace(scene.lights, position=position))
    emission = scene.lights.emission.copy()
    emission[i] *= 0.5
    yield "lamp dimmed", LampsChanged(replace(scene.lights, position=position, emission=emission))


def converge(state):
    while state.step():
        pass


def rows_of_rooms(name, scene):
    """Rows of `HEAD`: each edit's, made when all light has converged."""
    settings = LiveSettings(n_vertices=live.N_VERTICES, n_links=256)
    surfaces = live_surfaces(scene, settings)
    state = Live(scene, surfaces, settings)
    converge(state)
    solver = state._solver
    photons, west = solver._caustics, solver._receivers.position[:, 0] < WALL
    for edit, what in edits_in_the_west(scene):
        left = np.array([scene.lights.position[lamp, 0] < WALL for _, lamp, _ in photons._tracing._kinds])
        firsts = photons._groups.turn(0)  # a photon of each group
        groups = left[np.searchsorted(photons._tracing._first, firsts, side="right") - 1]
        state.edit(what)
        state.step()
        links = (solver._linking.vertices.arrays.state != LINK_KEPT).mean(axis=1)
        traced = photons.n_touched / photons._tracing.n
        converge(state)
        changed = solver._lighting.vertices.arrays.touched
        shares = [photons.touched[of].mean() if of.any() else np.nan for of in (groups, ~groups)]
        shares += [traced, links[west].mean(), links[~west].mean(), changed[west].mean(), changed[~west].mean()]
        yield [name, edit, *("–" if np.isnan(share) else f"{share:.1%}" for share in shares)]


def tables(scenes, options):
    """Markdown tables."""
    of_states = {"divided": (False,), "connected": (True,), "connected, east dark": (True, (True, False))}
    found = [row for name, how in of_states.items() for row in rows_of_rooms(name, rooms(*how))]
    caustics.build()
    bpy.data.objects["Plane"].scale = 0.25, 0.25, 1  # 3 m, so that vertices are close enough for what is sharp
    bpy.context.view_layer.update()
    beside = list(live.rows("ball and ring", rendered_scene()))
    title = "Two rooms (Larsen and Christensen, Figure 5): what an edit touches"
    return [table(title, HEAD, found), table("Caustics of live light after edits", live.HEAD, beside)]
