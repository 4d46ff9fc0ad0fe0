"""A trial on .blend files that other people made and published: does each bake, whole, and how long does it take?

    python tests/bench/public_files.py FOLDER                        all of tests/bench/public_files.tsv, and the table
    python tests/bench/public_files.py FOLDER --only room            those whose repository or path has "room" in it
    python tests/bench/public_files.py FOLDER --pictures build/files Cycles' picture of each beside one of its bake
    python tests/bench/public_files.py A.blend B.blend               any other files
    python tests/bench/public_files.py FOLDER --lightmaps            the same with lightmaps, and their table

FOLDER holds a clone of each repository of the list, as OWNER/NAME. The files were chosen by what they hold (five mesh
objects and two materials at least; rooms, levels and assets first, then files with missing images, objects left in edit
mode, particles, instances, drivers and many kinds of modifiers), before any was baked. None is part of this project.

Every file is baked by the command, at draft, onto vertices, in a process of its own that has --limit seconds; nothing
is saved over it. Where a mesh gets no light, the file is baked once more, with Bake Copies. A second process asks
Blender, by a render of its own, which mesh objects with faces renders show. Where the bake took over 60 s, a third one
bakes the same meshes by Cycles with 16 samples. Results are kept in a JSON file as they come, so that a trial goes on
where it was stopped; --anew forgets them. The table goes to docs/public_files.md.

With --lightmaps the light goes to lightmaps in shared images, at the density at which all surfaces together have
100,000 texels, and the table to docs/public_lightmaps.md.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LIST = HERE / "public_files.tsv"
TABLE = ROOT / "docs" / "public_files.md"
LIGHTMAP_TABLE = ROOT / "docs" / "public_lightmaps.md"
STAND_IN = ROOT / "tools" / "blender_stand_in.py"
LOOK = HERE / "look_at_file.py"

N_TEXELS = 100_000  # of a file's lightmaps, about
LONG = 60  # s, over which Cycles' own bake is asked how long it takes
TIMED_OUT = "timed out"
HEAD = [
    "Repository",
    "File",
    "Blender",
    "Meshes",
    "With light",
    "Points",
    "Read, s",
    "All, s",
    "Processor, s",
    "Cycles, s",
    "MB",
    "",
]


def main():
    options = parse()
    files = listed(options.files, options.only)
    kept = Path(options.results)
    results = {} if options.anew or not kept.exists() else json.loads(kept.read_text())
    kept.parent.mkdir(parents=True, exist_ok=True)
    for number, (repository, path, file) in enumerate(files, 1):
        key = f"{repository}/{path}"
        if key in results:
            continue
        results[key] = {"repository": repository, "path": path, **trial(file, options)}
        kept.write_text(json.dumps(results, indent=1) + "\n")
        print(f"{number}/{len(files)} {key}: {in_a_line(results[key])}", flush=True)
    rows = [results[f"{repository}/{path}"] for repository, path, _ in files]
    print(summary(rows))
    if options.table:
        Path(options.table).write_text((lightmap_page if options.lightmaps else page)(rows))


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", metavar="FOLDER|FILE", help="where the clones are, or .blend files")
    parser.add_argument("--only", default="", metavar="TEXT", help="files of the list with this in their name")
    parser.add_argument("--limit", type=float, default=240, metavar="SECONDS", help="for one bake; default %(default)s")
    parser.add_argument("--lightmaps", action="store_true", help="bake lightmaps")
    parser.add_argument(
        "--results", metavar="FILE.json", help="default build/public_files.json or public_lightmaps.json"
    )
    parser.add_argument("--anew", action="store_true", help="forget earlier results")
    parser.add_argument("--pictures", metavar="DIR", help="render each file and its bake, small")
    parser.add_argument("--table", metavar="FILE.md", help=f"the page; for the whole list default {TABLE.name}")
    options = parser.parse_args()
    whole = not options.only and all(Path(file).is_dir() for file in options.files)
    kind = "lightmaps" if options.lightmaps else "files"
    options.results = options.results or str(ROOT / "build" / f"public_{kind}.json")
    options.table = options.table or ((LIGHTMAP_TABLE if options.lightmaps else TABLE) if whole else None)
    return options


def listed(given, only):
    """Repository, path and file of all that is asked for."""
    files = [("", file, Path(file)) for file in given if not Path(file).is_dir()]
    for folder in (Path(file) for file in given if Path(file).is_dir()):
        for line in LIST.read_text().splitlines()[1:]:
            repository, path = line.split("\t")
            if only.lower() in f"{repository}/{path}".lower():
                files.append((repository, path, folder / repository / path))
    return files


def trial(file, options):
    """What became of one file."""
    if not file.is_file():
        return {"status": None, "n_shown": 0, "message": f"{file} is not there."}
    with tempfile.TemporaryDirectory() as folder:
        found = look("shown", file, folder, options.limit)
        names = found.pop("shown", ())
        found["n_shown"] = len(names)
        targets = lightmap_arguments(folder, found.get("area")) if options.lightmaps else []
        result = found | bake(file, Path(folder), options, names, targets)
        if result.get("unlit"):
            result["without_copies"] = [len(result["unlit"]), result["seconds"]]
            result = result | bake(file, Path(folder), options, names, [*targets, "--copies"])
        if (result["seconds"] > LONG or result["status"] == TIMED_OUT) and not options.lightmaps:
            result |= look("cycles", file, folder, 2 * options.limit)
    return result


def lightmap_arguments(folder, area):
    """What asks for lightmaps of surfaces of some area, m²."""
    density = min(max((N_TEXELS / area) ** 0.5, 0.01), 4096) if area else 4.0
    return ["--target", "lightmap", "--atlas", "shared", "--density", f"{density:.4g}", "--output", f"{folder}/maps"]


def bake(file, folder, options, names, targets=()):
    """Bake a file by the command; what its report says, its end, and which of the meshes of some names got no light."""
    report, arguments = folder / "report.json", [*targets]
    report.unlink(missing_ok=True)
    if options.pictures:
        saved = folder / "baked.blend"
        arguments += ["--direct", "--save", saved]
    command = [sys.executable, STAND_IN, "-b", file, "-c", "photon_bake", "--quality", "draft", "--report", report]
    started, cpu = perf_counter(), cpu_seconds()
    try:
        done = subprocess.run([*command, *arguments], capture_output=True, text=True, timeout=options.limit)
    except subprocess.TimeoutExpired:
        seconds = perf_counter() - started
        return {"status": TIMED_OUT, "seconds": seconds, "message": f"It did not end in {options.limit:.0f} s."}
    result = {"status": done.returncode, "seconds": perf_counter() - started, "cpu_seconds": cpu_seconds() - cpu}
    if not report.exists():
        return result | {"message": last_line(done.stderr), "status": done.returncode or "no report"}
    said = json.loads(report.read_text())
    if options.pictures and done.returncode == 0:
        pictures(file, saved, Path(options.pictures), options.limit)
    return result | {
        "message": said["message"],
        "warnings": said["warnings"],
        "unlit": sorted(set(names) - set(said["objects"])) if done.returncode == 0 else [],
        "copies": said["counts"].get("baked_copies", 0),
        "receivers": said["counts"].get("receivers", 0),
        "lightmaps": said["counts"].get("lightmaps", 0),
        "texels": said["counts"].get("lightmap_texels", 0),
        "covered": said["counts"].get("covered_texels", 0),
        "triangles": said["counts"].get("triangles", 0),
        "read_seconds": said["stage_seconds"].get("Reading the scene"),
        "map_seconds": said["stage_seconds"].get("Unwrapping", 0) + said["stage_seconds"].get("Packing", 0),
        "bake_seconds": said["total_seconds"],
        "memory_mb": said["peak_memory_mb"],
        "traceback": done.stderr if "Traceback" in done.stderr else "",
    }


def cpu_seconds():
    """Of all processes so far that were started here and have ended: on a busy machine it says more than the clock."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def look(what, file, folder, limit):
    """What `look_at_file.py` says of a file."""
    answer = Path(folder) / f"{what}.json"
    try:
        done = subprocess.run([sys.executable, LOOK, what, file, answer], capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return {f"{what}_message": f"It did not end in {limit:.0f} s."}
    return json.loads(answer.read_text()) if answer.exists() else {f"{what}_message": last_line(done.stderr)}


def pictures(file, saved, folder, limit):
    """Cycles' picture of a file, and one in which its light is what the bake says, beside each other."""
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / f"{file.parent.name}-{file.stem}.png".replace(" ", "_")
    subprocess.run([sys.executable, LOOK, "picture", file, picture, saved], capture_output=True, timeout=4 * limit)


def last_line(text):
    """The last line of a program's output."""
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def in_a_line(result):
    """A result, for the console."""
    unlit = f", without light: {', '.join(result['unlit'])}" if result.get("unlit") else ""
    return f"{result['status']} in {result.get('seconds', 0):.1f} s: {result['message']}{unlit}"


def is_whole(row):
    """Whether a file ended well, with light for every mesh that renders show."""
    return row["status"] == 0 and row["n_shown"] > 0 and not row["unlit"]


def is_slow(row):
    """Whether a file took over a minute, and longer than Cycles' bake of it, by the processor.

    That is at least what an idle machine's clock would show, and no more where other work runs beside it.
    """
    if row["status"] == TIMED_OUT:
        return True
    return row.get("cpu_seconds", 0) > max(LONG, row.get("cycles_cpu_seconds") or 0)


def summary(rows):
    """The trial in a sentence."""
    whole, ended = sum(map(is_whole, rows)), sum(row["status"] == 0 for row in rows)
    slow, unlit = sum(map(is_slow, rows)), sum(len(row.get("unlit", ())) for row in rows)
    return (
        f"Of {len(rows)} files {ended} end with status 0, {whole} of them with light on every mesh that renders show "
        f"({unlit} meshes of the others get none); {slow} take over {LONG} s and longer than Cycles' bake with 16 "
        f"samples."
    )


def page(rows):
    """The trial as a page of the docs."""
    lines = [
        "# Files by other people",
        "",
        f"{summary(rows)} Made by `python tests/bench/public_files.py FOLDER`, whose docstring says how the files were "
        "chosen and what is measured: baked at draft onto vertices by the command, each in a process of its own on two "
        "cores, from public repositories, none of them part of this project. *Meshes* are the mesh objects with faces "
        "that a render shows; where one got no light, the file was baked again with Bake Copies. *Blender* is the "
        "version that saved the file, *All* the whole command with Blender's start by the clock, and *Processor* by "
        "all cores together, which other work beside it does not slow. *Cycles* is its own bake of the same meshes "
        f"with 16 samples, taken where ours took over {LONG} s.",
        "",
        "| " + " | ".join(HEAD) + " |",
        "|" + "|".join(["---"] * 3 + ["--:"] * 8 + ["---"]) + "|",
    ]
    return "\n".join([*lines, *map(table_row, rows)]) + "\n"


def table_row(row):
    """A result as a row of the table."""
    n_lit = row["n_shown"] - len(row["unlit"]) if row["status"] == 0 else 0
    cells = [
        row["repository"],
        row["path"],
        row.get("version", ""),
        str(row.get("n_shown", "")),
        str(n_lit),
        f"{row.get('receivers', 0):,}",
        figure(row.get("read_seconds")),
        figure(row.get("seconds")),
        figure(row.get("cpu_seconds")),
        figure(row.get("cycles_seconds")),
        f"{row['memory_mb']:.0f}" if row.get("memory_mb") else "",
        outcome(row),
    ]
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


LIGHTMAP_HEAD = ["Repository", "File", "Meshes", "Mapped", "Images", "Texels", "Use", "Maps, s", "All, s", ""]


def lightmap_page(rows):
    """The trial of lightmaps as a page of the docs."""
    whole, ended = sum(map(is_whole, rows)), sum(row["status"] == 0 for row in rows)
    frozen = sum(row["status"] == TIMED_OUT for row in rows)
    lines = [
        "# Lightmaps of files by other people",
        "",
        f"Of {len(rows)} files {ended} end with status 0, {whole} of them with a lightmap for every mesh that renders "
        f"show; {frozen} did not end in time. Made by `python tests/bench/public_files.py FOLDER --lightmaps`: baked "
        f"at draft by the command into shared images, with about {N_TEXELS:,} texels a file, each in a process of its "
        "own. The files are those of [the trial on vertices](public_files.md). *Meshes* are the mesh objects with "
        "faces that a render shows; where one got no lightmap, as its modifiers copy faces, the file was baked again "
        "with Bake Copies, which alone stands in the table. *Use* is the share of texels that charts cover, *Maps* the "
        "seconds of making and packing UV maps, *All* the whole command with Blender's start, by the clock.",
        "",
        "| " + " | ".join(LIGHTMAP_HEAD) + " |",
        "|" + "|".join(["---"] * 2 + ["--:"] * 7 + ["---"]) + "|",
    ]
    return "\n".join([*lines, *map(lightmap_row, rows)]) + "\n"


def lightmap_row(row):
    """A result as a row of the table of lightmaps."""
    texels = row.get("texels", 0)
    cells = [
        row["repository"],
        row["path"],
        str(row.get("n_shown", "")),
        str(row["n_shown"] - len(row["unlit"]) if row["status"] == 0 else 0),
        str(row.get("lightmaps", "")),
        f"{texels:,}",
        f"{row['covered'] / texels:.0%}" if texels else "",
        figure(row.get("map_seconds")),
        figure(row.get("seconds")),
        outcome(row),
    ]
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def outcome(row):
    """What a row says last."""
    if row["status"] != 0:
        return row["message"]
    if "shown_message" in row:
        return "Blender itself does not render it"
    without = f"without light: {', '.join(row['unlit'])}" if row["unlit"] else "whole"
    if row["copies"]:
        without += f" with {row['copies']:,} Bake Copies"
    n = len(row["warnings"])
    return without + (f"; {n} warning{'s' if n > 1 else ''}" if n else "")


def figure(seconds):
    """Seconds, for the table."""
    return "" if seconds is None else f"{seconds:.1f}"


if __name__ == "__main__":
    main()
