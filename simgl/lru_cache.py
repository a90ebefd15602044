"""A cache of the most recently used values."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import cached_property
from threading import RLock
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")

# A number of values for caches that their bytes bound. Small values cost more than their bytes:
# objects of Python and OpenGL, and what else was computed for them.
MANY = 64


class HashedOnce(tuple[object, ...]):
    """A key of many values that several caches ask for: its hash is worked out once."""

    @cached_property
    def _hash(self) -> int:
        return super().__hash__()

    def __hash__(self) -> int:
        return self._hash


class LruCache(Generic[Key, Value]):
    """Values by key; when full, the least recently used ones are evicted.

    Any thread may use it; two that ask for one value at the same time may both make it.

    max_values : largest number of values
    on_evict : called with each evicted value, such as to release it; no method of whoever owns the
        cache, since the two would refer to each other
    max_bytes : largest sum of the sizes of the values, which are given with them; the newest value
        stays even if it is larger
    """

    def __init__(
        self,
        max_values: int,
        on_evict: Callable[[Value], object] | None = None,
        *,
        max_bytes: int | None = None,
    ) -> None:
        self._max_values, self._max_bytes, self._on_evict = max_values, max_bytes, on_evict
        self._values: OrderedDict[Key, tuple[Value, int]] = OrderedDict()
        self._reserved = 1
        self._nbytes = 0
        self._lock = RLock()

    def get(
        self, key: Key, make: Callable[[], Value], nbytes: int | Callable[[Value], int] = 0
    ) -> Value:
        """The value of a key, made if it is not cached; one that cannot be made is not cached.

        nbytes : size of the value, or what measures it once it is made
        """
        with self._lock:
            # Keys may take longer to hash than all the rest.
            present = self._values.get(key)
            if present is not None:
                self._values.move_to_end(key)
                return present[0]
            # Before it is made: it may use again what another one leaves.
            self._make_room(nbytes if isinstance(nbytes, int) else 0)
        value = make()
        self.put(key, value, nbytes if isinstance(nbytes, int) else nbytes(value))
        return value

    def put(self, key: Key, value: Value, nbytes: int = 0) -> None:
        """Cache a value; one that the key had is evicted."""
        with self._lock:
            if key in self._values:
                self._evict(key)
            self._make_room(nbytes)
            self._values[key] = value, nbytes
            self._nbytes += nbytes

    def find(self, key: Key) -> Value | None:
        """The value of a key, or None; its use does not count."""
        value, _ = self._values.get(key, (None, 0))
        return value

    def pop(self, key: Key) -> None:
        """Drop the value of a key, if it is cached, without evicting it."""
        with self._lock:
            _, nbytes = self._values.pop(key, (None, 0))
            self._nbytes -= nbytes

    def reserve(self, count: int) -> None:
        """The ``count`` newest values stay whatever the bounds, until the next call."""
        self._reserved = max(count, 1)

    def values(self) -> list[Value]:
        """All cached values, the least recently used one first."""
        with self._lock:
            return [value for value, _ in self._values.values()]

    @property
    def nbytes(self) -> int:
        """Sum of the sizes of all values."""
        return self._nbytes

    def __contains__(self, key: Key) -> bool:
        return key in self._values

    def __len__(self) -> int:
        return len(self._values)

    def _make_room(self, nbytes: int) -> None:
        while len(self._values) >= self._reserved and self._is_full(nbytes):
            self._evict(next(iter(self._values)))

    def _is_full(self, nbytes: int) -> bool:
        """Whether one more value is too many."""
        if len(self._values) >= self._max_values:
            return True
        return self._max_bytes is not None and self._nbytes + nbytes > self._max_bytes

    def _evict(self, key: Key) -> None:
        value, nbytes = self._values.pop(key)
        self._nbytes -= nbytes
        if self._on_evict is not None:
            self._on_evict(value)

    def clear(self) -> None:
        """Evict all values."""
        with self._lock:
            for key in list(self._values):
                self._evict(key)
