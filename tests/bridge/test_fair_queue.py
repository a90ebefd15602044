"""Clients take turns, whatever each of them sends."""

from __future__ import annotations

from collections.abc import Callable

from simgl_bridge.server import FairQueue


def served(queue: FairQueue, log: list[str]) -> list[str]:
    """What is done when everything is taken, in order."""
    while (work := queue.take()) is not None:
        work()
    return log


def test_the_client_served_last_comes_last() -> None:
    queue, log = FairQueue(window=3), []

    def job(name: str) -> Callable[[], None]:
        return lambda: log.append(name)

    for id in (1, 2, 3):
        assert queue.offer(b"greedy", id, job(f"greedy {id}"))
    assert queue.offer(b"b", 1, job("b 1"))
    assert queue.offer(b"c", 1, job("c 1"))
    assert len(queue) == 5
    assert served(queue, log) == ["greedy 1", "b 1", "c 1", "greedy 2", "greedy 3"]
    assert len(queue) == 0


def test_a_window_is_each_clients_own() -> None:
    queue = FairQueue(window=1)
    assert queue.offer(b"a", 1, lambda: None)
    assert not queue.offer(b"a", 2, lambda: None)
    assert queue.offer(b"b", 1, lambda: None)
    assert queue.has(b"a", 1)
    assert not queue.has(b"a", 2)
    queue.drop(b"a")
    assert not queue.has(b"a", 1)
    assert len(queue) == 1
