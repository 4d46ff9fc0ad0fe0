"""What the options of the command ``photon_bake`` have in common: checks of words, and sentences of help."""

from argparse import ArgumentTypeError
from collections.abc import Callable


def one_of(*choices: str) -> Callable[[str], str]:
    """A check for one of `choices`."""

    def check(text: str) -> str:
        if text in choices:
            return text
        raise ArgumentTypeError(f"there is no {text!r}; choose {' or '.join(choices)}")

    return check


def sentence(meaning: str) -> str:
    """A knob's meaning as argparse wants it: in lower case at the start, and % doubled."""
    return (meaning[0].lower() + meaning[1:]).replace("%", "%%")
