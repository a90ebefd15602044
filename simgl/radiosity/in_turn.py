"""Work in parts that does not keep Python's lock, two parts at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from simgl.arrays import IndexArray

# Rays of a part: some hundredths of a second of Embree. Arrays of this size find room in what those
# of the part before have left; memory that is new to a process has to be cleared for it.
_AT_ONCE = 1 << 18

_Result = TypeVar("_Result")


def in_turn(
    work: Callable[[IndexArray], _Result],
    points: IndexArray,
    rays: int,
    tick: Callable[[int], None] = lambda _: None,
) -> list[_Result]:
    """What the work returns for each part of some points, in order.

    numpy and Embree mostly release Python's lock.

    rays : of each point
    tick : gets how many points are done
    """
    each = max(_AT_ONCE // max(rays, 1), 1)
    parts = [points[i : i + each] for i in range(0, len(points), each)]
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


def side_by_side(tasks: Sequence[Callable[[], _Result]]) -> list[_Result]:
    """What tasks return that do not depend on each other, in order."""
    if len(tasks) < 2:
        return [task() for task in tasks]
    with ThreadPoolExecutor(max_workers=2) as threads:
        return list(threads.map(lambda task: task(), tasks))
