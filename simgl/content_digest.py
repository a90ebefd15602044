"""A hash of any frozen data, the same on any machine and in any process."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
from msgspec import Struct, structs


def content_digest(value: Any, size: int = 32) -> str:
    """BLAKE2b of all that a value holds, in hexadecimal digits.

    value : numbers, texts, paths, arrays, and mappings, sequences, dataclasses and tables of them;
        fields that do not take part in comparisons do not count, and of a path only the name does
    size : of the hash [bytes]

    Raises TypeError for another type.
    """
    digest = hashlib.blake2b(digest_size=size)
    _update(digest, value)
    return digest.hexdigest()


def _update(digest: hashlib.blake2b, value: Any) -> None:
    """Add a value: its type, its length, then its content."""
    digest.update(type(value).__name__.encode() + b"\0")
    if is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            if field.compare:
                digest.update(field.name.encode() + b"\0")
                _update(digest, getattr(value, field.name))
    elif isinstance(value, Struct):
        _update(digest, structs.asdict(value))
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str} {value.shape}\0".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        digest.update(f"{len(value)}\0".encode())
        for key, item in value.items():
            _update(digest, key)
            _update(digest, item)
    elif isinstance(value, (list, tuple)):
        digest.update(f"{len(value)}\0".encode())
        for item in value:
            _update(digest, item)
    elif isinstance(value, frozenset):
        _update(digest, sorted(value, key=repr))
    elif isinstance(value, (str, bytes)):
        content = value.encode() if isinstance(value, str) else value
        digest.update(f"{len(content)}\0".encode() + content)
    elif isinstance(value, PurePath):
        # The same files may be in another folder.
        digest.update(value.name.encode() + b"\0")
    elif isinstance(value, (bool, int, float, np.generic)) or value is None:
        digest.update(repr(value).encode() + b"\0")
    else:
        raise TypeError(f"a {type(value).__name__} has no place in a hash of content")
