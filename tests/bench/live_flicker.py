"""Measures how much of what is seen of an object that moves is noise: from frame to frame, beside independent numbers.

    python tests/bench/run.py --only live

An object moves a step a frame, and each frame is the first light after that. The variance of a vertex's indirect
light from frame to frame is the mean of (Lₜ₊₁ − Lₜ)²; that of light whose numbers are independent from frame to frame
is found by fresh starts of other seeds, each converged. What really changes is in both, so that the quotient is too
large rather than too small.
"""

import caustics
import numpy as np
from figures import rendered_scene, table
from photon_bake.addon.pipeline.live import Live, ObjectMoved, live_surfaces
from photon_bake.addon.settings.live import LiveSettings
from scene_parts import box, bpy, lamp, matte, room

N_VERTICES, N_FRAMES, STEP = 20_000, 6, 0.01  # of the scene; of each sequence; m that the object moves in each
HEAD = ["Scene", "Vertices looked at", "Change from frame to frame", "with independent numbers", "Variance of theirs"]


def box_in_front_of_a_wall():
    """A box that moves along a wall, under a lamp; the vertices of that wall."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    white, red, blue = matte("White", 0.75, 0.75, 0.72), matte("Red", 0.6, 0.12, 0.08), matte("Blue", 0.1, 0.2, 0.55)
    room((4, 4, 3), floor=white, walls=white, west=red, east=blue)
    box("Moves", (1.4, 3.0, 0.3), (2.2, 3.6, 1.5), red)
    lamp("Lamp", "POINT", (2.2, 1.2, 2.5), 100, (1, 0.9, 0.8), shadow_soft_size=0.1)
    scene = rendered_scene()
    return scene, "Moves", lambda at, name: (name == "North") & (np.abs(at[:, 1] - 4) < 1e-3)


def ring_beside_a_caustic():
    """A ring of gold that moves beside a ball of glass; the vertices where the ball's light is."""
    caustics.build()
    bpy.data.objects["Plane"].scale = 0.25, 0.25, 1
    bpy.context.view_layer.update()
    scene = rendered_scene()
    return scene, "Cylinder", lambda at, name: (name == "Plane") & (np.hypot(at[:, 0] + 1.1, at[:, 1] + 0.4) < 0.4)


def row(title, scene, moves, looked_at):
    """A row of `HEAD`."""
    number, names = scene.objects.names.index(moves), np.array(scene.objects.names)
    chosen = LiveSettings(n_vertices=N_VERTICES)
    surfaces = live_surfaces(scene, chosen)
    positions = np.concatenate([mesh.position for mesh in surfaces.meshes])
    seen = looked_at(positions, names[surfaces.object_of_vertex])
    edits = [ObjectMoved(number, shifted(STEP * frame)) for frame in range(N_FRAMES)]
    live = converged(Live(scene, surfaces, chosen))
    coherent, independent = [], []
    for frame, edit in enumerate(edits):
        live.edit(edit)
        live.step()
        coherent.append(live.light.indirect[seen])
        other = Live(scene, surfaces, LiveSettings(n_vertices=N_VERTICES, seed=frame + 1))
        other.edit(edit)
        independent.append(converged(other).light.indirect[seen])
    mean = np.mean(independent)
    changes = [np.mean(np.diff(np.array(frames), axis=0) ** 2) for frames in (coherent, independent)]
    shares = [f"{np.sqrt(change) / mean:.2%}" for change in changes]
    return [title, f"{seen.sum():,}", *shares, f"{changes[0] / changes[1]:.1%}"]


def shifted(x):
    """A translation along x."""
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def converged(live):
    """The same, once it stays as it is."""
    while live.step():
        pass
    return live


def tables():
    """A Markdown table."""
    rows = [
        row("a wall behind a box that moves", *box_in_front_of_a_wall()),
        row("a caustic beside a ring that moves", *ring_beside_a_caustic()),
    ]
    return [table("Live light from frame to frame", HEAD, rows)]
