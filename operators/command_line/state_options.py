"""The options of the command ``photon_bake`` that keep light between processes, and between machines."""

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from dataclasses import dataclass
from pathlib import Path

from ..jobs.light_store import LightStore


@dataclass(frozen=True)
class Shard:
    """The `number`-th of `total` parts of the frames, counted from 1."""

    number: int
    total: int

    def part(self, times: list[float]) -> list[float]:
        """The frames of this part: every `total`-th, so that parts have about as much work."""
        return times[self.number - 1 :: self.total]


@dataclass(frozen=True)
class StateOptions:
    """Where light is kept, and what is done with it.

    Attributes
    ----------
    folder : Path or None
        None: light is not kept.
    resume : bool
        Whether light that is there is taken.
    shard : Shard or None
        The frames whose light is solved and kept, and nothing else is done; None: all, and their outputs are written.
    merge : bool
        Whether all light has to be there.
    """

    folder: Path | None
    resume: bool
    shard: Shard | None
    merge: bool

    def store(self) -> LightStore | None:
        """The folder of light; None where it is not kept.

        Raises
        ------
        BakeError
            If something else has its name.
        """
        if self.folder is None:
            return None
        return LightStore(self.folder, self.resume or self.merge or self.shard is not None, not self.merge)


def add_state_options(parser: ArgumentParser) -> None:
    """Add the options to the command's."""
    title = "state (bakes that go on, and bakes on several machines)"
    add = parser.add_argument_group(title).add_argument
    add("--state", metavar="DIR", help="keep the light of each frame there as soon as it is solved")
    add("--resume", action="store_true", help="take light that --state has of the same scene, settings and version")
    meaning = "solve every N-th frame from the K-th on into --state, and write nothing else; repeatable safely"
    add("--shard", type=_shard, metavar="K/N", help=meaning)
    add("--merge", action="store_true", help="take all light from --state, and write what is asked for")


def state_options(parser: ArgumentParser, given: Namespace) -> StateOptions:
    """What the options ask for; ends with a line about those that say nothing beside the others."""
    for option, value in (("--resume", given.resume), ("--shard", given.shard), ("--merge", given.merge)):
        if value and given.state is None:
            parser.error(f"{option} is for light that is kept: give --state DIR too")
    if given.shard and given.merge:
        parser.error("--shard solves light and --merge takes it: give one of them")
    if given.shard and given.frames is None:
        parser.error("--shard is a part of several frames: give --frames too")
    if given.shard and (given.save is not None or given.show):
        parser.error("--shard writes light to --state alone: give --save and --show with --merge")
    if given.state is not None and given.motion_blur:
        parser.error("--state keeps light of one time a frame: leave --motion-blur out")
    folder = None if given.state is None else Path(given.state).absolute()
    return StateOptions(folder, given.resume, given.shard, given.merge)


def _shard(text: str) -> Shard:
    """``K/N`` as a shard."""
    try:
        number, total = (int(part) for part in text.split("/"))
    except ValueError:
        number, total = 0, 0
    if not 1 <= number <= total:
        raise ArgumentTypeError(f"{text!r} is no shard; give K/N with K from 1 to N, such as 2/8")
    return Shard(number, total)
