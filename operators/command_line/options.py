"""The options of the command ``photon_bake``."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_args

import bpy

from ...addon.core.errors import BakeError
from ...addon.core.parameters import meaning_of
from ...addon.pipeline.refinement import BUDGET, TOLERANCE, RefineOptions
from ...addon.settings.bake import CHOICES, BakeSettings, Quality, settings_for
from ...addon.settings.camera import CameraSettings
from ...addon.settings.frames import Frames, Keeping
from ...addon.settings.lightmap import LIGHTMAP_FOLDER, LightmapSettings
from ...addon.settings.probes import ProbeSettings
from ...addon.ui.properties.scene import CHOICE_MEANINGS
from .camera_options import OF_CAMERAS, add_camera_options, camera_settings, pass_folder
from .frame_options import add_frame_options, playback_folder, refuse_frames, writes_playback
from .lightmap_options import OF_LIGHTMAPS, add_lightmap_options, lightmap_folder, lightmap_settings
from .probe_options import OF_PROBES, add_probe_options, probe_folder, probe_settings
from .words import one_of, sentence

COMMAND = "photon_bake"
TARGETS = ("vertex", "lightmap", "camera", "probes")

_FLAGS = ("add_direct", "open_side", "normal_maps", "interpolate")
"""Settings that options turn on or off."""

KNOB_OPTIONS = {
    "--photons": "n_photons",
    "--bounces": "max_bounces",
    "--gather-rays": "n_gather_rays",
    "--gather-share": "gather_share",
    "--noise": "noise",
    "--time": "time",
    "--memory": "memory",
    "--grid-cells": "n_grid_cells",
    "--volume-rays": "n_volume_rays",
    "--subsample": "subsample",
    "--maps": "n_maps",
    "--map-size": "map_size",
    "--motion-blur": "motion_blur",
    "--seed": "seed",
    "--threads": "n_threads",
}
"""The options that are a number of `BakeSettings`."""

_METAVARS = {"gather_share": "FRACTION", "noise": "FRACTION", "time": "SECONDS", "memory": "MB", "motion_blur": "STEPS"}

_ALONE: dict[str, dict[str, Any]] = {"motion_blur": {"nargs": "?", "const": 8}}  # what may be left out


@dataclass(frozen=True)
class Options:
    """What the command is asked for.

    Attributes
    ----------
    settings : BakeSettings
    objects : list of str or None
        None: every renderable mesh object. A name with commas in it counts as it is where there is such an object.
    attribute : str
    copies : bool
        Whether objects whose mesh cannot hold their light get copies.
    refine : RefineOptions or None
        None: meshes stay as they are.
    fit : bool
        Whether vertices are fitted to the light over their faces.
    denoise : bool
        Whether noise is taken out of vertices' light.
    light_group : str
        Whose light is baked alone; empty for all light.
    light_groups : bool
        Whether light groups are baked each apart, beside all light.
    targets : list of str
        Of `TARGETS`, each once.
    lightmaps : LightmapSettings or None
        None: no lightmaps are asked for.
    output : Path
        Folder for lightmaps.
    camera : CameraSettings or None
        None: no camera's pass is asked for.
    camera_output : Path
        Folder for the camera's pass.
    probes : ProbeSettings or None
        None: no probes are asked for.
    probe_output : Path
        Folder for probes.
    frames : Frames or None
        None: the current frame.
    keeping : 'texture' or 'attributes'
        How vertices keep the light of several frames.
    playback_output : Path
        Folder for images of vertices' light.
    preview : Path or None
        PNG with all lightmaps.
    save : Path or None
        None: do not save.
    report : Path or None
        None: no report.
    strict : bool
        Whether any other warning than advice is a failure.
    show : bool
        Whether materials show the light.
    """

    settings: BakeSettings
    objects: list[str] | None
    attribute: str
    copies: bool
    refine: RefineOptions | None
    fit: bool
    denoise: bool
    light_group: str
    light_groups: bool
    targets: list[str]
    lightmaps: LightmapSettings | None
    output: Path
    camera: CameraSettings | None
    camera_output: Path
    probes: ProbeSettings | None
    probe_output: Path
    frames: Frames | None
    keeping: Keeping
    playback_output: Path
    preview: Path | None
    save: Path | None
    report: Path | None
    strict: bool
    show: bool


def parse(arguments: list[str], loaded_file: str) -> Options:
    """Read the command's arguments.

    Parameters
    ----------
    arguments : list of str
    loaded_file : str
        Path of the .blend file that is open, for ``--save`` without a path; empty where there is none.

    Raises
    ------
    SystemExit
        With 2 after a line on stderr about bad usage, or with 0 after ``--help``.
    """
    parser = _parser()
    given = parser.parse_args(arguments)
    if given.save == "" and not loaded_file:
        parser.error("--save has no file to save over; give --save FILE.blend")
    targets = list(dict.fromkeys(given.target or ["vertex"]))
    _refuse_mixtures(parser, given, targets, loaded_file)
    try:
        settings = settings_for(given.quality, **_given(given, [*KNOB_OPTIONS.values(), *CHOICES, *_FLAGS]))
        lightmaps = lightmap_settings(given) if "lightmap" in targets else None
        camera = camera_settings(given) if "camera" in targets else None
        probes = probe_settings(given) if "probes" in targets else None
        refine = None if given.refine is None else RefineOptions(given.refine, **_given(given, ["budget"]))
    except BakeError as error:
        parser.error(str(error))
    if settings.gather == "photon_volumes" and targets != ["camera"]:
        parser.error(
            "--gather photon_volumes lights a camera's pixels: give --target camera alone, or another --gather"
        )
    if probes is not None and not settings.needs_cache:
        parser.error("probes look around with rays: give --gather final, or light_volume with --volume-rays")
    return Options(
        settings=settings,
        objects=given.objects or None,
        attribute=given.attribute,
        copies=given.copies,
        refine=refine,
        fit=given.fit,
        denoise=given.denoise,
        light_group=given.light_group or "",
        light_groups=given.light_groups,
        targets=targets,
        lightmaps=lightmaps,
        output=lightmap_folder(given, loaded_file),
        camera=camera,
        camera_output=pass_folder(given, loaded_file),
        probes=probes,
        probe_output=probe_folder(given, loaded_file),
        frames=given.frames,
        keeping=given.keeping or "texture",
        playback_output=playback_folder(given, loaded_file),
        preview=None if given.preview is None else Path(given.preview).absolute(),
        save=None if given.save is None else Path(given.save or loaded_file).absolute(),
        report=None if given.report is None else Path(given.report).absolute(),
        strict=given.strict,
        show=given.show,
    )


def _refuse_mixtures(parser: ArgumentParser, given: Namespace, targets: list[str], loaded_file: str) -> None:
    """End with a line about options that say nothing beside the others, or that shut each other out."""
    of_targets = (
        (OF_LIGHTMAPS, "lightmap", "lightmaps"),
        (OF_CAMERAS, "camera", "a camera's pass"),
        (OF_PROBES, "probes", "probes"),
    )
    for of_target, target, what in of_targets:
        for option, name in of_target.items():
            if getattr(given, name) is not None and target not in targets:
                parser.error(f"{option} is for {what}: give --target {target} too")
    if given.light_groups and given.light_group:
        parser.error("--light-group bakes one group alone and --light-groups each apart: give one of them")
    if given.copies and not {"vertex", "lightmap"} & set(targets):
        parser.error("--copies is for light on objects: give --target vertex or lightmap too")
    if given.refine is not None and "vertex" not in targets:
        parser.error("--refine is for light on vertices: give --target vertex too")
    if given.budget is not None and given.refine is None:
        parser.error("--refine-budget is for refined meshes: give --refine too")
    for option, is_default in (("--no-fit", given.fit), ("--no-vertex-denoise", given.denoise)):
        if not is_default and "vertex" not in targets:
            parser.error(f"{option} is for light on vertices: give --target vertex too")
    files = targets != ["vertex"] or writes_playback(given, targets)
    if given.output is not None and not files:
        parser.error("--output is for files: give --target lightmap, camera or probes too")
    if files and given.output is None and not loaded_file:
        parser.error("the files have no folder: give --output DIR")
    if given.show and not {"vertex", "lightmap"} & set(targets):
        parser.error("--show is for light in materials: give --target vertex or lightmap too")
    refuse_frames(parser, given, targets)


def _given(given: Namespace, names: list[str]) -> dict[str, Any]:
    """Those of the named options that were given."""
    return {name: getattr(given, name) for name in names if getattr(given, name) is not None}


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        prog=COMMAND,
        description="Bake indirect light by photon mapping. Without options: every renderable mesh object, "
        "quality medium, into the color attribute Indirect. The panel's settings in the file are not read.",
        epilog="Exit status: 0 done, 1 failed, 2 bad usage, 130 cancelled.",
        allow_abbrev=False,
    )
    add = parser.add_argument
    meaning = "where the light goes; repeatable, for one bake of all; default vertex"
    add("--target", type=one_of(*TARGETS), action="append", metavar="|".join(TARGETS), help=meaning)
    meaning = "objects to bake; repeatable; default: every renderable mesh object"
    add("--objects", type=_names, action="extend", metavar="NAME[,NAME…]", help=meaning)
    meaning = "an object to bake, with commas in its name if it has any; repeatable"
    add("--object", type=_name, dest="objects", action="append", metavar="NAME", help=meaning)
    add("--attribute", type=_name, default="Indirect", metavar="NAME", help="color attribute; default %(default)s")
    meaning = "give objects whose mesh cannot hold their light copies with meshes of their own"
    add("--copies", action="store_true", help=meaning)
    meaning = (
        "first give objects refined copies of their meshes, on which light is linear between vertices up to this error "
        f"as a share of the light; default {TOLERANCE:g}"
    )
    add("--refine", type=float, nargs="?", const=TOLERANCE, metavar="TOLERANCE", help=meaning)
    meaning = f"vertices that --refine adds at most; default {BUDGET}"
    add("--refine-budget", type=int, dest="budget", metavar="N", help=meaning)
    meaning = "store the light at the vertices themselves, not the values that show the light over the faces best"
    add("--no-fit", dest="fit", action="store_false", help=meaning)
    add("--no-vertex-denoise", dest="denoise", action="store_false", help="leave the noise in the light of vertices")
    add("--light-group", type=_name, metavar="NAME", help="bake the light of one light group alone")
    meaning = "bake the light of each light group apart too, by one solve, for the light mixer"
    add("--light-groups", action="store_true", help=meaning)
    for name, choices in CHOICES.items():
        add(f"--{name}", type=one_of(*choices), metavar="|".join(choices), help=sentence(CHOICE_MEANINGS[name]))
    qualities = get_args(Quality)
    add("--quality", choices=qualities, default="medium", metavar="|".join(qualities), help="default %(default)s")
    knobs = {knob.name: knob for knob in fields(BakeSettings)}
    for option, name in KNOB_OPTIONS.items():
        knob = knobs[name]
        metavar, alone = _METAVARS.get(name, "N"), _ALONE.get(name, {})
        add(option, dest=name, type=knob.type, metavar=metavar, help=sentence(meaning_of(knob)), **alone)
    for option, name in (("--direct", "add_direct"), ("--open-side", "open_side"), ("--normal-maps", "normal_maps")):
        add(option, dest=name, action="store_true", default=None, help=sentence(knobs[name].metadata["meaning"]))
    meaning = "gather at every point, which takes longer where there are many"
    add("--no-interpolation", dest="interpolate", action="store_false", default=None, help=meaning)
    add("--output", metavar="DIR", help=f"folder for images; default: {LIGHTMAP_FOLDER} beside the loaded file")
    add_lightmap_options(parser)
    add_frame_options(parser)
    add_camera_options(parser)
    add_probe_options(parser)
    add("--save", nargs="?", const="", metavar="FILE.blend", help="save the file, here or over the loaded one")
    add("--report", metavar="FILE.json", help="write what the bake did, also when it fails")
    meaning = "fail, and write nothing, where light would differ from Cycles' or a file is missing"
    add("--strict", action="store_true", help=meaning)
    add("--show", action="store_true", help="show the light in materials, as Use Baked Light does")
    return parser


def _name(text: str) -> str:
    if not text.strip():
        raise ArgumentTypeError("give a name")
    return text


def _names(text: str) -> list[str]:
    """Names with commas between them, unless an object is called just so."""
    if text in bpy.data.objects:
        return [text]
    names = [name for name in text.split(",") if name]
    if not names:
        raise ArgumentTypeError("give the names of objects, with commas between them")
    return names
