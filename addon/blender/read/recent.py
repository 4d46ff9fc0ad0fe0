"""What Cycles made lately, found again by the key of its content."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any


class Recent(OrderedDict[Hashable, Any]):
    """Results by their keys, the last used last; the first go when all are too large together.

    Parameters
    ----------
    most : int
        Largest sum of their sizes; a single one may be larger.
    size : callable
        Of a result; 1 by itself.
    """

    def __init__(self, most: int, size: Callable[[Any], int] = lambda _: 1) -> None:
        super().__init__()
        self._most, self._size = most, size

    def found(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """The result of a key, made where it is not known."""
        if key not in self:
            self[key] = make()
            while len(self) > 1 and sum(map(self._size, self.values())) > self._most:
                self.popitem(last=False)
        self.move_to_end(key)
        return self[key]
