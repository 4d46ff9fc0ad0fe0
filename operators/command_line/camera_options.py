"""The options of the command ``photon_bake`` that are for a camera's pass."""

from argparse import ArgumentParser, Namespace
from dataclasses import fields
from pathlib import Path

from ...addon.core.parameters import meaning_of
from ...addon.settings.camera import PASS_CHOICES, PASS_FOLDER, CameraSettings
from ...addon.ui.properties.scene import CHOICE_MEANINGS

CAMERA_OPTIONS = {
    "--pixel-samples": "n_pixel_samples",
    "--gloss-rays": "n_gloss_rays",
    "--media-rays": "n_media_rays",
    "--file-name": "file_name",
}
"""Those that are a number or a name of `CameraSettings`."""

CAMERA_CHOICE_OPTIONS = {
    "--pass-denoise": "pass_denoiser",
    "--precision": "precision",
    "--compression": "compression",
}
"""Those that are one of several names."""

_KNOBS = [*CAMERA_OPTIONS.values(), *CAMERA_CHOICE_OPTIONS.values()]
OF_CAMERAS = {**CAMERA_OPTIONS, **CAMERA_CHOICE_OPTIONS}
"""Options that say nothing without a camera."""


def add_camera_options(parser: ArgumentParser) -> None:
    """Add the options to the command's."""
    group = parser.add_argument_group(
        "camera (--target camera)", f"Files go to --output, by default to {PASS_FOLDER} beside the loaded file."
    )
    add = group.add_argument
    knobs = {knob.name: knob for knob in fields(CameraSettings)}
    for option, name in CAMERA_OPTIONS.items():
        knob = knobs[name]
        meaning = meaning_of(knob)
        metavar = "NAME" if knob.type is str else "N"
        help_ = f"{meaning[0].lower()}{meaning[1:]}; default {knob.default}"
        add(option, dest=name, type=knob.type, metavar=metavar, help=help_)
    for option, name in CAMERA_CHOICE_OPTIONS.items():
        meaning, choices = CHOICE_MEANINGS[name], PASS_CHOICES[name]
        help_ = f"{meaning[0].lower()}{meaning[1:]}; default {knobs[name].default}"
        add(option, dest=name, choices=choices, metavar="|".join(choices), help=help_)


def camera_settings(given: Namespace) -> CameraSettings:
    """The settings that the options make.

    Raises
    ------
    BakeError
        If a value is out of its range.
    """
    return CameraSettings(**{name: getattr(given, name) for name in _KNOBS if getattr(given, name) is not None})


def pass_folder(given: Namespace, loaded_file: str) -> Path:
    """The folder that a camera's files go to."""
    return Path(given.output or Path(loaded_file).parent / PASS_FOLDER).absolute()
