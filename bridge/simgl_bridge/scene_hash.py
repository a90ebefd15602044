"""The name of a scene: a hash over everything that a scenario holds except its seed."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import PurePath
from typing import Any

import numpy as np

from simgl.scenario.scenario import Scenario


def scene_hash(scenario: Scenario) -> str:
    """32 hexadecimal digits, the same for the same content on any machine and in any process.

    The seed has a field of its own in each reply, and where the file lies does not matter.
    """
    digest = hashlib.blake2b(digest_size=16)
    _feed(digest, replace(scenario, seed=0, source=None))
    return digest.hexdigest()


def _feed(digest: hashlib.blake2b, value: Any) -> None:
    """Add a value: what it is, how long it is, then its content."""
    digest.update(type(value).__name__.encode() + b"\0")
    if is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            digest.update(field.name.encode() + b"\0")
            _feed(digest, getattr(value, field.name))
    elif isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str} {value.shape}\0".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        digest.update(f"{len(value)}\0".encode())
        for key, item in value.items():
            _feed(digest, key)
            _feed(digest, item)
    elif isinstance(value, (list, tuple)):
        digest.update(f"{len(value)}\0".encode())
        for item in value:
            _feed(digest, item)
    elif isinstance(value, (str, bytes)):
        content = value.encode() if isinstance(value, str) else value
        digest.update(f"{len(content)}\0".encode() + content)
    elif isinstance(value, PurePath):
        # The name alone: the same files may lie in another folder.
        digest.update(value.name.encode() + b"\0")
    elif isinstance(value, (bool, int, float, np.generic)) or value is None:
        digest.update(repr(value).encode() + b"\0")
    else:
        raise TypeError(f"a scene holds a {type(value).__name__}, which has no place in its hash")
