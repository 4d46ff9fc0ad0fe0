"""Measures how much of what is seen of an object that moves is noise: from frame to frame, beside independent numbers.

    python tests/bench/run.py --only live

An object is dragged, a step a frame, and each frame is the first light after that. All frames of one sequence are of
one seed, as those of live light are; each frame of the other is the last of a sequence of its own seed. With d and d′
how far light moves from frame to frame in either, E[d d′] is the square of the real change, as their noise is
independent, and E[d²] − E[d d′] is the variance of the noise in d.
"""

import caustics
import numpy as np
from figures import rendered_scene, table
from photon_bake.addon.pipeline.live import Live, ObjectMoved, live_surfaces
from photon_bake.addon.settings.live import LiveSettings
from scene_parts import box, bpy, lamp, matte, room

N_VERTICES, N_FRAMES, STEP = 20_000, 6, 0.01  # of the scene; of each sequence; m that the object moves in each
HEAD = [
    "Scene",
    "Vertices looked at",
    "Real change",
    "Noise of a change",
    "with independent numbers",
    "Variance of theirs",
]


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
    surfaces = live_surfaces(scene, LiveSettings(n_vertices=N_VERTICES))
    positions = np.concatenate([mesh.position for mesh in surfaces.meshes])
    seen = looked_at(positions, names[surfaces.object_of_vertex])

    def dragged(seed, n_frames):
        """The first light of each frame."""
        live = converged(Live(scene, surfaces, LiveSettings(n_vertices=N_VERTICES, seed=seed)))
        for frame in range(n_frames):
            live.edit(ObjectMoved(number, shifted(STEP * (frame + 1))))
            live.step()
            yield live.light.indirect[seen].astype(float)

    coherent = list(dragged(0, N_FRAMES))
    independent = [list(dragged(frame + 1, frame + 1))[-1] for frame in range(N_FRAMES)]
    of_one, of_others = (np.diff(np.array(frames), axis=0) for frames in (coherent, independent))
    real = np.mean(of_one * of_others)
    noises = [np.mean(change**2) - real for change in (of_one, of_others)]
    shares = [f"{np.sqrt(max(change, 0)) / np.mean(independent):.2%}" for change in (real, *noises)]
    return [title, f"{seen.sum():,}", *shares, f"{noises[0] / noises[1]:.1%}"]


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
