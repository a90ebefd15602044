"""Points whose rays are traced part by part, two parts at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from simgl.arrays import IndexArray

# Points of a part: some hundredths of a second of Embree, in arrays that memory which was used for
# the part before has room for. What is new to a process has to be cleared for it.
_AT_ONCE = 512

_Result = TypeVar("_Result")


def in_turn(
    work: Callable[[IndexArray], _Result], points: IndexArray, tick: Callable[[int], None]
) -> list[_Result]:
    """What the work returns for each part of some points, in order.

    numpy and Embree mostly release Python's lock.

    tick : gets how many points are done
    """
    parts: Sequence[IndexArray] = [
        points[i : i + _AT_ONCE] for i in range(0, len(points), _AT_ONCE)
    ]
    results, done = [], 0
    with ThreadPoolExecutor(max_workers=2) as threads:
        try:
            for part, result in zip(parts, threads.map(work, parts), strict=True):
                results.append(result)
                done += len(part)
                tick(done)
        finally:
            # Where nobody wants the rest.
            threads.shutdown(wait=False, cancel_futures=True)
    return results
