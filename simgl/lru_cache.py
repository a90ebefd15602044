"""Things that are kept while they are in use: of too many, the one unused for longest goes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Thing = TypeVar("Thing")


class LruCache(Generic[Key, Thing]):
    """Things by key.

    most : how many are kept
    let_go : told of each that goes
    """

    def __init__(self, most: int, let_go: Callable[[Thing], object] | None = None) -> None:
        self._most, self._let_go = most, let_go
        self._things: OrderedDict[Key, Thing] = OrderedDict()

    def get(self, key: Key, make: Callable[[], Thing]) -> Thing:
        """The thing of a key, made if it is not kept."""
        if key not in self._things:
            while len(self._things) >= self._most:
                self._go()
            self._things[key] = make()
        self._things.move_to_end(key)
        return self._things[key]

    def find(self, key: Key) -> Thing | None:
        """The thing of a key, or None; its turn to go does not change."""
        return self._things.get(key)

    def pop(self, key: Key) -> None:
        """Drop the thing of a key, if there is one, without telling."""
        self._things.pop(key, None)

    def values(self) -> list[Thing]:
        """All that are kept, the one unused for longest first."""
        return list(self._things.values())

    def _go(self) -> None:
        _, thing = self._things.popitem(last=False)
        if self._let_go is not None:
            self._let_go(thing)

    def clear(self) -> None:
        """Let go of all."""
        while self._things:
            self._go()
