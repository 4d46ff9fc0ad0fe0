"""The options of the command ``photon_bake`` that are for probes."""

from argparse import ArgumentParser, Namespace
from dataclasses import fields
from pathlib import Path

from ...addon.core.parameters import meaning_of
from ...addon.settings.probes import PROBE_CHOICES, PROBE_FOLDER, ProbeSettings
from ...addon.ui.properties.scene import CHOICE_MEANINGS

PROBE_OPTIONS = {
    "--probes-at": "place",
    "--probe-spacing": "spacing",
    "--max-probes": "max_probes",
    "--probe-rays": "n_probe_rays",
}
"""Those that are a number or a name of `ProbeSettings`."""

PROBE_CHOICE_OPTIONS = {"--harmonics": "harmonics", "--axes": "axes"}
"""Those that are one of several names."""

OF_PROBES = {**PROBE_OPTIONS, **PROBE_CHOICE_OPTIONS}
"""Options that say nothing without probes."""

_METAVARS = {"place": "NAME", "spacing": "METERS"}


def add_probe_options(parser: ArgumentParser) -> None:
    """Add the options to the command's."""
    group = parser.add_argument_group(
        "probes (--target probes)", f"Files go to --output, by default to {PROBE_FOLDER} beside the loaded file."
    )
    knobs = {knob.name: knob for knob in fields(ProbeSettings)}
    for option, name in PROBE_OPTIONS.items():
        knob = knobs[name]
        meaning = meaning_of(knob)
        help_ = f"{meaning[0].lower()}{meaning[1:]}" + (f"; default {knob.default}" if knob.default else "")
        group.add_argument(option, dest=name, type=knob.type, metavar=_METAVARS.get(name, "N"), help=help_)
    for option, name in PROBE_CHOICE_OPTIONS.items():
        meaning, choices = CHOICE_MEANINGS[name], PROBE_CHOICES[name]
        help_ = f"{meaning[0].lower()}{meaning[1:]}; default {knobs[name].default}"
        group.add_argument(option, dest=name, choices=choices, metavar="|".join(choices), help=help_)


def probe_settings(given: Namespace) -> ProbeSettings:
    """The settings that the options make.

    Raises
    ------
    BakeError
        If a value is out of its range.
    """
    names = OF_PROBES.values()
    return ProbeSettings(**{name: getattr(given, name) for name in names if getattr(given, name) is not None})


def probe_folder(given: Namespace, loaded_file: str) -> Path:
    """The folder that probes' files go to."""
    return Path(given.output or Path(loaded_file).parent / PROBE_FOLDER).absolute()
