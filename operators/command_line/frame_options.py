"""The options of the command ``photon_bake`` that are for several frames."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path

from ...addon.core.errors import BakeError
from ...addon.settings.frames import KEEPINGS, PLAYBACK_FOLDER, Frames, parse_frames
from ..jobs.frame_bakes import check_frames


def add_frame_options(parser: ArgumentParser) -> None:
    """Add the options to the command's."""
    add = parser.add_argument_group("frames").add_argument
    meaning = "frames of the animation; STEP may be a fraction for vertices; default: the current frame alone"
    add("--frames", type=_frames, metavar="A-B[:STEP]", help=meaning)
    meaning = "keep the light of vertices in an image that a modifier plays back, or an attribute a frame; default "
    add("--frames-as", dest="keeping", choices=KEEPINGS, metavar="|".join(KEEPINGS), help=f"{meaning}{KEEPINGS[0]}")


def refuse_frames(parser: ArgumentParser, given: Namespace, targets: list[str]) -> None:
    """End with a line about frames that targets cannot have, or options that say nothing without frames."""
    if given.keeping is not None and (given.frames is None or "vertex" not in targets):
        parser.error("--frames-as is for frames of vertices: give --frames and --target vertex too")
    if given.frames is None:
        return
    try:
        check_frames(given.frames, targets, given.copies)
    except BakeError as error:
        parser.error(str(error))
    if given.refine is not None:
        parser.error("--refine is for the light of one frame: refine first, and bake frames after it")


def writes_playback(given: Namespace, targets: list[str]) -> bool:
    """Whether the light of vertices goes to files."""
    return "vertex" in targets and given.frames is not None and given.keeping != "attributes"


def playback_folder(given: Namespace, loaded_file: str) -> Path:
    """The folder that the images of vertices go to."""
    return Path(given.output or Path(loaded_file).parent / PLAYBACK_FOLDER).absolute()


def _frames(text: str) -> Frames:
    try:
        return parse_frames(text)
    except BakeError as error:
        raise ArgumentTypeError(str(error)) from error
