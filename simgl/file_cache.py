"""A cache of values read from files, each for as long as the content of its files stays."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from simgl.errors import AssetError
from simgl.input_files import digest_of, record_inputs, recorded_inputs
from simgl.lru_cache import LruCache

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


@dataclass(frozen=True)
class _Entry(Generic[Value]):
    value: Value
    inputs: Mapping[Path, str]


class FileCache(Generic[Key, Value]):
    """Values by key, read again as soon as one of the files that ``read_file`` gave has changed.

    The files of a cached value are read and hashed at each use: dates and sizes would miss some
    changes. Any thread may use it.

    max_values, max_bytes : bounds, as of an ``LruCache``
    size_of : bytes of a value
    """

    def __init__(
        self,
        max_values: int,
        *,
        max_bytes: int | None = None,
        size_of: Callable[[Value], int] = lambda _: 0,
    ) -> None:
        self._entries = LruCache[Key, _Entry[Value]](max_values, max_bytes=max_bytes)
        self._size_of = size_of

    def get(self, key: Key, read: Callable[[], Value]) -> Value:
        """The value of a key, and its files in every open ``recorded_inputs``.

        read : reads all its files by ``read_file``
        """
        entry = self._entries.find(key)
        if entry is None or not _unchanged(entry.inputs):
            with recorded_inputs() as inputs:
                entry = _Entry(read(), inputs)
        else:
            record_inputs(entry.inputs)
        self._entries.put(key, entry, self._size_of(entry.value))
        return entry.value


def _unchanged(inputs: Mapping[Path, str]) -> bool:
    try:
        return all(digest_of(path) == digest for path, digest in inputs.items())
    except AssetError:
        return False
