"""Build the extension's zips: one for each Blender and platform, with the wheels it needs.

    python tools/build_zip.py                                   every zip, into dist/
    python tools/build_zip.py --platform linux-x64 --python 3.13
    python tools/build_zip.py --oidn                            with OpenImageDenoise, 50 to 90 MB more each

Run it with an environment that has bpy (`make zip` does): Blender's own tool builds and validates. Wheels are
downloaded once, into build/wheels. A zip whose inputs have not changed is left as it is.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

from photon_bake.addon.core.zips import BLENDER_OF_PYTHON, LACKING, PLATFORMS, zip_name

ROOT = Path(__file__).resolve().parents[1]
MANIFEST = "blender_manifest.toml"
WHEELS = ROOT / "build" / "wheels"
DIST = ROOT / "dist"
DATE = (2026, 1, 1, 0, 0, 0)  # of every file in a zip


@dataclass(frozen=True)
class Target:
    """One Blender: its Python, the versions it spans and the wheels it gets.

    NumPy is Blender's own and never bundled, so each wheel must run with that Blender's: 1.26 in 4.5, 2.x in 5.2.
    Wheels of a release of Numba go with those of one of llvmlite.
    """

    python: str
    version_min: str
    version_max: str | None
    requirements: tuple[str, ...]
    platforms: tuple[str, ...]


OPENEXR = "openexr==3.5.3"
OIDN = ("pyoidn==2.5.1.0", "cffi==2.1.1", "pycparser==3.12")
ENGINE = ("embreex==4.4.0.post1", OPENEXR, "numba==0.68.1", "llvmlite==0.50.0")
TARGETS = (
    Target("3.11", "4.5.0", "5.0.0", ("scipy==1.17.1", *ENGINE), PLATFORMS),
    Target("3.13", "5.2.0", None, ("scipy==1.18.1", *ENGINE), PLATFORMS),
    # Debian builds Blender 5.2 for its own Python.
    Target("3.14", "5.2.0", None, ("scipy==1.18.1", *ENGINE), ("linux-x64",)),
)

# Blender's names for platforms: the wheel tags that run there, best first.
TAGS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_11_0_arm64", "macosx_12_0_arm64", "macosx_13_0_arm64", "macosx_14_0_arm64"),
}


def say(text: str) -> None:
    """Tell on stderr what is being done, unless `make -s` runs this."""
    if not os.environ.get("QUIET"):
        print(text, file=sys.stderr, flush=True)


def target_for(python: str) -> Target:
    """The target with this Python version, as in ``3.13``."""
    for target in TARGETS:
        if target.python == python:
            return target
    raise SystemExit(f"There is no zip for Python {python}: the Blenders are {', '.join(t.python for t in TARGETS)}.")


def pip_selection(target: Target, platform_name: str) -> list[str]:
    """Pip's options that choose wheels for a Python and platform that may not be this one."""
    options = ["--only-binary=:all:", "--implementation=cp", f"--python-version={target.python}"]
    return options + [f"--platform={tag}" for tag in TAGS[platform_name]]


def wheels(target: Target, platform_name: str) -> list[Path]:
    """The target's wheels, downloaded where build/wheels does not have them."""
    folder = WHEELS / f"python{target.python}-{platform_name}"
    wanted = [requirement.replace("==", "-") + "-" for requirement in target.requirements]

    def present() -> list[Path]:
        return [path for name in wanted for path in folder.glob(name + "*.whl")]

    if len(present()) < len(wanted):
        wanted_names = " and ".join(target.requirements)
        say(f"Downloading {wanted_names} for Python {target.python} on {platform_name}")
        folder.mkdir(parents=True, exist_ok=True)
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
        pip += [*pip_selection(target, platform_name), f"--dest={folder}", *target.requirements]
        subprocess.run(pip, check=True, stdout=sys.stderr)
    return present()


def source_files() -> list[Path]:
    """Every file of the checkout that git does not ignore, relative to it and sorted, less the folders left out."""
    left_out = tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))["build"]["paths_exclude_pattern"]
    folders = {pattern.strip("/") for pattern in left_out if pattern[0] == pattern[-1] == "/"}
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    git = subprocess.run(command, cwd=ROOT, capture_output=True, check=False) if shutil.which("git") else None
    if git is not None and git.returncode == 0:
        names = [Path(os.fsdecode(name)) for name in git.stdout.split(b"\0") if name]
    else:
        tops = [top for top in ROOT.iterdir() if not top.name.startswith(".") and top.name not in folders]
        names = [path.relative_to(ROOT) for top in tops for path in (top.rglob("*") if top.is_dir() else [top])]
    return sorted(
        name
        for name in set(names)
        if name.parts[0] not in folders and (ROOT / name).is_file() and name != Path(MANIFEST)
    )


def manifest_for(target: Target, platform_name: str, wheel_paths: list[Path]) -> str:
    """The committed manifest with this zip's wheels, platform and Blender versions."""
    versions = [f'blender_version_min = "{target.version_min}"']
    if target.version_max:
        versions.append(f'blender_version_max = "{target.version_max}"')
    lines = [
        *versions,
        f'platforms = ["{platform_name}"]',
        "wheels = [" + ", ".join(f'"./wheels/{path.name}"' for path in wheel_paths) + "]",
    ]
    committed = (ROOT / MANIFEST).read_text(encoding="utf-8").splitlines()
    places = [number for number, line in enumerate(committed) if line.startswith("blender_version_min")]
    if len(places) != 1:
        raise SystemExit(f"{MANIFEST} must have one line that starts with blender_version_min.")
    committed[places[0] : places[0] + 1] = lines
    return "\n".join(committed) + "\n"


def blender_ext(*arguments: str) -> None:
    """Run Blender's extension tool, which the bpy wheel carries; its output is shown only where it fails."""
    spec = importlib.util.find_spec("bpy")
    found = (
        spec
        and spec.origin
        and sorted(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    )
    if not found:
        raise SystemExit("This Python has no bpy, whose blender_ext.py builds the zip: use `make zip`.")
    run = subprocess.run([sys.executable, str(found[-1]), *arguments], capture_output=True, text=True, check=False)
    if run.returncode:
        raise SystemExit(f"blender_ext.py {arguments[0]} failed:\n{run.stdout}{run.stderr}")


def digest(path: Path) -> str:
    """The SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def repack(source: Path, destination: Path) -> None:
    """Copy a zip with its files sorted and dated alike, so that equal inputs give equal zips."""
    partial = destination.with_suffix(f".{os.getpid()}.partial")
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(partial, "w") as new:
        for info in sorted(old.infolist(), key=lambda info: info.filename):
            compression = zipfile.ZIP_STORED if info.filename.endswith(".whl") else zipfile.ZIP_DEFLATED
            dated = zipfile.ZipInfo(info.filename, DATE)
            dated.external_attr = 0o644 << 16
            new.writestr(dated, old.read(info), compression)
    partial.replace(destination)


def build(target: Target, platform_name: str, dist: Path = DIST, oidn: bool = False) -> Path:
    """Build and validate one zip, with OpenImageDenoise or without, and return its path."""
    if oidn:
        target = replace(target, requirements=target.requirements + OIDN)
    if platform_name not in target.platforms:
        raise SystemExit(f"There is no zip for Blender {BLENDER_OF_PYTHON[target.python]} on {platform_name}.")
    version = tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))["version"]
    dist.mkdir(parents=True, exist_ok=True)
    path = dist / zip_name(target.python, platform_name, version)
    path = path.with_stem(path.stem + "-oidn" * oidn)
    wheel_paths = wheels(target, platform_name)
    manifest = manifest_for(target, platform_name, wheel_paths)
    files = source_files()

    inputs = hashlib.sha256(manifest.encode())
    for name in (Path(__file__).relative_to(ROOT), *files):
        inputs.update(str(name).encode() + b"\0" + (ROOT / name).read_bytes())
    stamp = ROOT / "build" / "zip" / f"{path.name}.inputs"
    if path.exists() and stamp.exists() and stamp.read_text() == inputs.hexdigest():
        return path

    with tempfile.TemporaryDirectory() as folder:
        stage = Path(folder)
        for name in files:
            (stage / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, stage / name)
        (stage / MANIFEST).write_text(manifest, encoding="utf-8", newline="\n")
        (stage / "wheels").mkdir()
        for wheel in wheel_paths:
            shutil.copyfile(wheel, stage / "wheels" / wheel.name)
        for file in stage.rglob("*"):
            if file.is_file():
                file.chmod(0o644)
        built = stage / "built.zip"
        blender_ext("build", f"--source-dir={stage}", f"--output-filepath={built}")
        repack(built, path)
    blender_ext("validate", str(path))
    stamp.parent.mkdir(parents=True, exist_ok=True)
    stamp.write_text(inputs.hexdigest())
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description="Build the extension's zips into dist/.")
    parser.add_argument("--platform", action="append", choices=TAGS, help="only for this platform; repeatable")
    parser.add_argument("--python", action="append", help="only for Blenders with this Python; repeatable")
    parser.add_argument("--oidn", action="store_true", help="with OpenImageDenoise's wheel")
    options = parser.parse_args()
    for target in [target_for(python) for python in options.python] if options.python else TARGETS:
        for platform_name in target.platforms:
            if options.platform is None or platform_name in options.platform:
                path = build(target, platform_name, oidn=options.oidn)
                print(f"{path.relative_to(ROOT)}  {path.stat().st_size / 1e6:.1f} MB", flush=True)
    without = [f"{platform_name} (no wheels of {lacking})" for platform_name, lacking in LACKING.items()]
    say(f"There are no zips for {', '.join(without)}.")


if __name__ == "__main__":
    main()
