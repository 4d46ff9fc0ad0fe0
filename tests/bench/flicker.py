"""Measures how much the light of what does not move changes from frame to frame."""

import bpy
import numpy as np
from figures import table

N_EMITTED, N_FRAMES, STEP = 200_000, 4, 0.03  # photons; frames; m that the ring moves in each
HEAD = ["Photons", "Change from frame to frame", "Noise said"]


def flicker_table(make_bench):
    """RMS change of the glass ball's caustic while the ring beside it moves, over the caustic's own RMS.

    With random numbers by path, and with a seed a frame.
    """
    rows = []
    for name, seeds in (("a seed each frame", range(N_FRAMES)), ("numbers of their own", [0] * N_FRAMES)):
        lights, noises = zip(
            *(caustic_of_frame(make_bench, frame, seed) for frame, seed in enumerate(seeds)), strict=True
        )
        lights, noise = np.array(lights), np.array(noises)
        scale = np.sqrt(np.mean(lights**2))
        change = np.sqrt(np.mean(np.diff(lights, axis=0) ** 2)) / scale
        rows.append([name, f"{change:.1%}", f"{np.sqrt(np.mean(noise**2)) / scale:.1%}"])
    return table("A caustic that does not move, beside a ring that does", HEAD, rows)


def caustic_of_frame(make_bench, frame, seed):
    """Irradiance of the pixels around the ball's caustic, and its standard error, (n,) each."""

    def move():
        bpy.data.objects["Cylinder"].location.x += STEP * frame

    bench = make_bench(move)
    photons, _ = bench.caustic(N_EMITTED, seed)
    light, stderr, _ = bench.light(photons)
    near = (bench.floor.position[:, 0] < -0.5) & (np.abs(bench.floor.position[:, 1] + 0.6) < 0.6)
    place = np.zeros(bench.camera.n_pixels), np.zeros(bench.camera.n_pixels)
    for picture, values in zip(place, (light, stderr), strict=True):
        picture[bench.floor.pixel[near]] = values[near]
    return place
