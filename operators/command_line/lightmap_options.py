"""The options of the command ``photon_bake`` that are for lightmaps."""

from argparse import ArgumentParser, Namespace
from dataclasses import fields
from pathlib import Path

from ...addon.core.parameters import meaning_of
from ...addon.settings.lightmap import LIGHTMAP_CHOICES, LIGHTMAP_FOLDER, LightmapSettings
from ...addon.ui.properties.scene import CHOICE_MEANINGS
from .words import one_of, sentence

LIGHTMAP_OPTIONS = {
    "--uv": "uv_map",
    "--density": "density",
    "--size": "size",
    "--max-size": "max_size",
    "--padding": "padding",
    "--range": "value_range",
}
"""Those that are a number or a name of `LightmapSettings`."""

LIGHTMAP_CHOICE_OPTIONS = {"--atlas": "atlas", "--format": "file_format", "--denoise": "denoiser"}

_KNOBS = [*LIGHTMAP_OPTIONS.values(), *LIGHTMAP_CHOICE_OPTIONS.values(), "directional"]
OF_LIGHTMAPS = {
    **LIGHTMAP_OPTIONS,
    **LIGHTMAP_CHOICE_OPTIONS,
    "--directional": "directional",
    "--preview": "preview",
}
"""Options that say nothing without lightmaps."""


def add_lightmap_options(parser: ArgumentParser) -> None:
    """Add the options to the command's."""
    group = parser.add_argument_group("lightmaps (--target lightmap)")
    add = group.add_argument
    knobs = {knob.name: knob for knob in fields(LightmapSettings)}
    for option, name in LIGHTMAP_OPTIONS.items():
        knob = knobs[name]
        metavar = "NAME" if knob.type is str else "N"
        add(option, dest=name, type=knob.type, metavar=metavar, help=sentence(meaning_of(knob)))
    for option, name in LIGHTMAP_CHOICE_OPTIONS.items():
        choices = LIGHTMAP_CHOICES[name]
        meaning = f"{sentence(CHOICE_MEANINGS[name])}; default {knobs[name].default}"
        add(option, dest=name, type=one_of(*choices), metavar="|".join(choices), help=meaning)
    meaning = sentence(knobs["directional"].metadata["meaning"])
    add("--directional", action="store_true", default=None, help=meaning)
    add("--preview", metavar="FILE.png", help="write a picture of all lightmaps")


def lightmap_settings(given: Namespace) -> LightmapSettings:
    """The settings that the options make.

    Raises
    ------
    BakeError
        If a value is out of its range.
    """
    return LightmapSettings(**{name: getattr(given, name) for name in _KNOBS if getattr(given, name) is not None})


def lightmap_folder(given: Namespace, loaded_file: str) -> Path:
    """The folder that lightmaps go to."""
    return Path(given.output or Path(loaded_file).parent / LIGHTMAP_FOLDER).absolute()
