"""Probes in files: how long they take, how noisy they are, and how near harmonics come to the irradiance of six sides.

python tests/bench/probes.py FILE.blend… [--spacing METRES]
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from photon_bake.addon.core.sampling.spherical_harmonics import sh_cosine_lobe
from photon_bake.addon.gather.rays.probe_light import SIDES

ROOT = Path(__file__).resolve().parents[2]


def row(path, spacing):
    """Figures of one file, as a line of a Markdown table."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        options = ["--target", "probes", "--harmonics", "l2", "--probe-spacing", str(spacing), "--output", folder]
        command = [sys.executable, ROOT / "tools" / "blender_stand_in.py", "-b", path, "-c", "photon_bake", *options]
        subprocess.run([*command, "--report", report], check=True, stderr=subprocess.DEVNULL)
        done = json.loads(report.read_text())
        (content,) = Path(folder).glob("*_probes.json")
        grids = json.loads(content.read_text())["grids"]
    valid = np.concatenate([grid["valid"] for grid in grids])
    sh, sides = (np.concatenate([grid[name] for grid in grids])[valid] for name in ("radiance", "irradiance"))
    off = {}
    for bands in (2, 3):
        n = bands**2
        by_harmonics = np.maximum(np.einsum("sk,pkc->psc", sh_cosine_lobe(SIDES, bands), sh[:, :n]), 0)
        off[bands] = np.sqrt(np.mean((by_harmonics - sides) ** 2)) / sides.mean()
    seconds, counts = done["stage_seconds"]["Lighting probes"], done["counts"]
    cells = [path.stem, counts["probes"], counts["probes_inside"], f"{done['total_seconds']:.1f}", f"{seconds:.1f}"]
    cells += [f"{done['relative_noise']:.1%}", f"{off[2]:.1%}", f"{off[3]:.1%}"]
    return "| " + " | ".join(map(str, cells)) + " |"


def main():
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--spacing", type=float, default=1.0)
    given = parser.parse_args()
    print("| File | Probes | In solids | Seconds | of them lighting probes | Noise | L1 off | L2 off |")
    print("|---|---|---|---|---|---|---|---|")
    for path in given.files:
        print(row(path, given.spacing), flush=True)


if __name__ == "__main__":
    main()
