"""Makes the .blend file whose settings a test opens: saved by an earlier version, so that its numbers stay readable.

    git archive COMMIT | tar x --one-top-level=/tmp/earlier/photon_bake
    PYTHONPATH=/tmp/earlier .venv/bin/python tests/host/saved_settings.py VERSION

It registers the extension that PYTHONPATH has, makes a scene for each choice of the longest list of choices, sets every
property that is saved to something else than its default, and writes VERSION.blend with them and VERSION.json with the
values as that version understands them, into tests/references/settings. The files there are from commit 9cbfa49, in
Blender 4.5.
"""

import json
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy

FOLDER = Path(__file__).parents[1] / "references" / "settings"
COMPUTED = {"name", "quality", "light_groups"}
"""Properties that follow from others, and that no file keeps."""


def saved(group: Any, path: str = "") -> dict[str, tuple[Any, Any]]:
    """(group, property) of all that files keep of a group and of the groups in it, by path; no collections."""
    found: dict[str, tuple[Any, Any]] = {}
    for prop in group.bl_rna.properties:
        name = prop.identifier
        if prop.type == "POINTER" and name != "rna_type":
            found |= saved(getattr(group, name), f"{path}{name}.")
        elif prop.type not in {"POINTER", "COLLECTION"} and name not in COMPUTED and not prop.is_skip_save:
            found[path + name] = (group, prop)
    return found


def unusual(prop: Any, i: int) -> Any:
    """The i-th value of a property: each choice in turn, other than the default whatever else it is."""
    if prop.type == "ENUM":
        choices = prop.enum_items.keys()
        return {choices[i % len(choices)], choices[-1]} if prop.is_enum_flag else choices[i % len(choices)]
    if prop.type == "STRING":
        return f"{prop.identifier} {i}"
    if prop.type == "BOOLEAN":
        return not prop.default
    step = 1 + i if prop.type == "INT" else (1 + i) / 8  # eighths are kept exactly
    value = prop.default + step
    return value if value <= prop.hard_max else prop.default - step


def set_all(scene: Any, i: int) -> None:
    """Give a scene its i-th settings."""
    for name, (group, prop) in saved(scene.photon_bake).items():
        value = unusual(prop, i)
        setattr(group, prop.identifier, 2 ** (3 + i) if name == "map_size" else value)


def values(scene: Any) -> dict[str, Any]:
    """A scene's settings as they are understood."""
    read = {name: getattr(group, prop.identifier) for name, (group, prop) in saved(scene.photon_bake).items()}
    return {name: sorted(value) if isinstance(value, set) else value for name, value in read.items()}


def main() -> None:
    import photon_bake

    photon_bake.register()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    n_choices = [len(p.enum_items) for _, p in saved(bpy.context.scene.photon_bake).values() if p.type == "ENUM"]
    expected = {}
    for i in range(max(n_choices)):
        scene = bpy.context.scene if i == 0 else bpy.data.scenes.new("")
        scene.name = f"settings {i}"
        set_all(scene, i)
        expected[scene.name] = values(scene)
    FOLDER.mkdir(exist_ok=True)
    file = FOLDER / f"{sys.argv[1]}.blend"
    with TemporaryDirectory() as folder:  # files keep the path that they were saved to
        bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/{file.name}", compress=True)
        shutil.move(f"{folder}/{file.name}", file)
    text = json.dumps(expected, indent=1, sort_keys=True)
    file.with_suffix(".json").write_text(text + "\n", encoding="utf-8")
    print(file, file.stat().st_size, "bytes")


if __name__ == "__main__":
    main()
