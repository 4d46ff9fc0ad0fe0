"""What has moved since links were marked: boxes around it, few of each object however long that is dragged."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..jobs import Job, no_job
from .linking import Linking

_MOST_BOXES = 8
"""Of an object; of more, one encloses all."""

_LARGER = 1.1
"""How many times the area of the larger of two boxes the one around both may have, to take their place."""


@dataclass
class Unmarked:
    """Changes by which links are not marked yet.

    Attributes
    ----------
    moved : dict of int to (b, 2, 3) float32, m
        Boxes around each object where it was and is.
    followed : bool
        Whether links that were followed may be stale, too.
    """

    moved: dict[int, np.ndarray] = field(default_factory=dict)
    followed: bool = False

    def __bool__(self) -> bool:
        return bool(self.moved) or self.followed

    def add(self, object_: int, boxes: np.ndarray) -> None:
        """An object has moved from one box (2, 3) to another."""
        found = list(self.moved.get(object_, boxes[:0]))
        for box in boxes:
            around = _around(np.stack([found[-1], box])) if found else box
            if found and _area(around) <= _LARGER * max(_area(found[-1]), _area(box)):
                found[-1] = around
            else:
                found.append(box)
        every = np.stack(found)
        self.moved[object_] = _around(every)[None] if len(every) > _MOST_BOXES else every

    def clear(self) -> None:
        """All links are marked."""
        self.moved, self.followed = {}, False

    def jobs(self, linking: Linking, objects: np.ndarray, rest: bool) -> list[Callable[[], Job]]:
        """What marks the links that make the first light, or the rest of them, and then has them traced anew."""

        def done() -> None:
            self.clear()
            linking.renew()

        jobs = [job for of, boxes in self.moved.items() for job in linking.marking(of, objects, boxes, rest)]
        jobs += [linking.mark_followed] if self.followed else []
        return [*jobs, lambda: no_job(done)] if jobs else []


def _around(boxes: np.ndarray) -> np.ndarray:
    """The box around boxes (b, 2, 3), (2, 3)."""
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def _area(box: np.ndarray) -> float:
    x, y, z = (box[1] - box[0]).tolist()
    return x * y + y * z + z * x
