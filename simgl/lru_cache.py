"""A cache of the most recently used values."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import RLock
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


class LruCache(Generic[Key, Value]):
    """Values by key; when full, the least recently used ones are evicted.

    Any thread may use it; two that ask for one value at the same time may both make it.

    capacity : largest sum of the sizes of the values: their number, or their bytes where those are
        given with each value; the newest value stays even if it is larger
    on_evict : called with each evicted value, such as to release it; no method of whoever owns the
        cache, since the two would refer to each other
    """

    def __init__(self, capacity: int, on_evict: Callable[[Value], object] | None = None) -> None:
        self._capacity, self._on_evict = capacity, on_evict
        self._values: OrderedDict[Key, tuple[Value, int]] = OrderedDict()
        self._reserved = 1
        self._size = 0
        self._lock = RLock()

    def get(
        self, key: Key, make: Callable[[], Value], size: int | Callable[[Value], int] = 1
    ) -> Value:
        """The value of a key, made if it is not cached; one that cannot be made is not cached.

        size : of the value, or what measures it once it is made
        """
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key][0]
            # Before it is made: it may use again what another one leaves.
            self._make_room(size if isinstance(size, int) else 0)
        value = make()
        self.put(key, value, size if isinstance(size, int) else size(value))
        return value

    def put(self, key: Key, value: Value, size: int = 1) -> None:
        """Cache a value; one that the key had is evicted."""
        with self._lock:
            if key in self._values:
                self._evict(key)
            self._make_room(size)
            self._values[key] = value, size
            self._size += size

    def find(self, key: Key) -> Value | None:
        """The value of a key, or None; its use does not count."""
        value, _ = self._values.get(key, (None, 0))
        return value

    def pop(self, key: Key) -> None:
        """Drop the value of a key, if it is cached, without evicting it."""
        with self._lock:
            _, size = self._values.pop(key, (None, 0))
            self._size -= size

    def reserve(self, count: int) -> None:
        """The ``count`` newest values stay whatever their sizes, until the next call."""
        self._reserved = max(count, 1)

    def values(self) -> list[Value]:
        """All cached values, the least recently used one first."""
        with self._lock:
            return [value for value, _ in self._values.values()]

    @property
    def size(self) -> int:
        """Sum of the sizes of all values."""
        return self._size

    def __contains__(self, key: Key) -> bool:
        return key in self._values

    def _make_room(self, size: int) -> None:
        while self._size + size > self._capacity and len(self._values) >= self._reserved:
            self._evict(next(iter(self._values)))

    def _evict(self, key: Key) -> None:
        value, size = self._values.pop(key)
        self._size -= size
        if self._on_evict is not None:
            self._on_evict(value)

    def clear(self) -> None:
        """Evict all values."""
        with self._lock:
            for key in list(self._values):
                self._evict(key)
