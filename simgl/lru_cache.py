"""A cache of the most recently used values."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


class LruCache(Generic[Key, Value]):
    """Values by key; when full, the least recently used one is evicted.

    capacity : largest number of values
    on_evict : called with each evicted value, such as to release it
    """

    def __init__(self, capacity: int, on_evict: Callable[[Value], object] | None = None) -> None:
        self._capacity, self._on_evict = capacity, on_evict
        self._values: OrderedDict[Key, Value] = OrderedDict()

    def get(self, key: Key, make: Callable[[], Value]) -> Value:
        """The value of a key, made if it is not cached."""
        if key not in self._values:
            while len(self._values) >= self._capacity:
                self._evict()
            self._values[key] = make()
        self._values.move_to_end(key)
        return self._values[key]

    def find(self, key: Key) -> Value | None:
        """The value of a key, or None; its use does not count."""
        return self._values.get(key)

    def pop(self, key: Key) -> None:
        """Drop the value of a key, if it is cached, without evicting it."""
        self._values.pop(key, None)

    def reserve(self, count: int) -> None:
        """Raise the capacity to at least ``count`` values."""
        self._capacity = max(self._capacity, count)

    def values(self) -> list[Value]:
        """All cached values, the least recently used one first."""
        return list(self._values.values())

    def __contains__(self, key: Key) -> bool:
        return key in self._values

    def _evict(self) -> None:
        _, value = self._values.popitem(last=False)
        if self._on_evict is not None:
            self._on_evict(value)

    def clear(self) -> None:
        """Evict all values."""
        while self._values:
            self._evict()
