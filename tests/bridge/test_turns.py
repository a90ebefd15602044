"""Clients take turns, whatever each of them sends."""

from __future__ import annotations

from collections.abc import Callable

from simgl_bridge.turns import Turns


def served(turns: Turns, log: list[str]) -> list[str]:
    """What is done when everything is taken, in order."""
    while (work := turns.take()) is not None:
        work()
    return log


def test_the_client_served_last_comes_last() -> None:
    turns, log = Turns(window=3), []

    def job(name: str) -> Callable[[], None]:
        return lambda: log.append(name)

    for id in (1, 2, 3):
        assert turns.offer(b"greedy", id, job(f"greedy {id}"))
    assert turns.offer(b"b", 1, job("b 1"))
    assert turns.offer(b"c", 1, job("c 1"))
    assert len(turns) == 5
    assert served(turns, log) == ["greedy 1", "b 1", "c 1", "greedy 2", "greedy 3"]
    assert len(turns) == 0


def test_a_window_is_each_clients_own() -> None:
    turns = Turns(window=1)
    assert turns.offer(b"a", 1, lambda: None)
    assert not turns.offer(b"a", 2, lambda: None)
    assert turns.offer(b"b", 1, lambda: None)
    assert turns.waits(b"a", 1)
    assert not turns.waits(b"a", 2)
    turns.drop(b"a")
    assert not turns.waits(b"a", 1)
    assert len(turns) == 1
