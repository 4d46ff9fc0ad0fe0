"""What the benchmarks share: scenes with their receivers, figures against truth, tables."""

import bpy
import numpy as np
from photon_bake.addon.blender import bake_objects, extract_scene, receiver_meshes
from photon_bake.addon.receivers import vertex_receivers


def load(path):
    """Scene, receivers of all objects, and those of the probes where there are some."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    objects = bake_objects(depsgraph)

    def receivers(chosen):
        return vertex_receivers(receiver_meshes(chosen, depsgraph))

    everything = receivers([o for o in objects if o.name != "Probes"])
    return extract_scene(depsgraph), everything, receivers([o for o in objects if o.name == "Probes"])


def relative_rmse(value, truth):
    """RMS error over the mean, the truth's own noise taken out; value and truth are E/π at the probes."""
    keep = truth["keep"]
    error2 = np.mean((value[keep] - truth["mean"][keep]) ** 2) - np.mean(truth["stderr"][keep] ** 2)
    return float(np.sqrt(max(error2, 0)) / truth["mean"][keep].mean())


def figures(value, truth):
    """Cells: relative RMSE, deviation of the mean, and the median of a probe's error over its own truth."""
    got, mean = value[truth["keep"]], truth["mean"][truth["keep"]]
    own = np.linalg.norm(got - mean, axis=1) / np.maximum(np.linalg.norm(mean, axis=1), 1e-9)
    return f"{relative_rmse(value, truth):.2%}", f"{got.mean() / mean.mean() - 1:+.2%}", f"{np.median(own):.1%}"


def table(title, head, rows):
    lines = [f"## {title}", "", "| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    text = "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows), ""])
    print(text, flush=True)
    return text
