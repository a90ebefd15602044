"""Python's garbage collector, kept away from what lives as long as a simulator.

A full collection looks through every object: 14 to 30 ms with a scenario and a renderer in memory,
which one frame of some dozens would wait for.
"""

from __future__ import annotations

import gc
from weakref import WeakSet

_HOLDERS = WeakSet[object]()


def leave_out_of_collections(holder: object) -> None:
    """Collections skip all objects that exist now, until no holder is left."""
    _HOLDERS.add(holder)
    gc.freeze()


def collect_again(holder: object) -> None:
    """Say that a holder needs it no longer; it may be said twice."""
    held = holder in _HOLDERS
    _HOLDERS.discard(holder)
    if held and not _HOLDERS:
        gc.unfreeze()
