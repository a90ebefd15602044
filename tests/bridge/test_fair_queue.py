"""Clients take turns, whatever each of them sends."""

from __future__ import annotations

import math

from simgl_bridge.server import FairQueue, Work


def work(name: str, deadline: float = math.inf) -> Work:
    """Work of which only the key matters."""
    return Work(key=name, begin=lambda: None, finish=lambda *_: None, deadline=deadline)


def taken(queue: FairQueue) -> list[object]:
    """The keys of all work, in the order of its turns."""
    keys = []
    while (turn := queue.take()) is not None:
        keys.append(turn[1].key)
    return keys


def test_the_client_served_last_comes_last() -> None:
    queue = FairQueue(window=3)
    for name in ("greedy 1", "greedy 2", "greedy 3"):
        assert queue.offer(b"greedy", work(name))
    assert queue.offer(b"b", work("b 1"))
    assert queue.offer(b"c", work("c 1"))
    assert len(queue) == 5
    assert taken(queue) == ["greedy 1", "b 1", "c 1", "greedy 2", "greedy 3"]
    assert len(queue) == 0


def test_a_window_is_each_clients_own() -> None:
    queue = FairQueue(window=1)
    assert queue.offer(b"a", work("a"))
    assert not queue.offer(b"a", work("a 2"))
    assert queue.offer(b"b", work("b"))
    assert queue.has(b"a", "a")
    assert not queue.has(b"a", "a 2")
    queue.drop(b"a")
    assert not queue.has(b"a", "a")
    assert len(queue) == 1


def test_work_leaves_the_queue_at_its_deadline() -> None:
    queue = FairQueue(window=2)
    for client, deadline in ((b"a", 5.0), (b"b", 3.0), (b"b", math.inf)):
        assert queue.offer(client, work(f"{client.decode()} {deadline:g}", deadline))
    assert queue.next_deadline() == 3.0
    assert [late.key for late in queue.take_overdue(3.0)] == ["b 3"]
    assert queue.take_overdue(4.9) == []
    assert queue.next_deadline() == 5.0
    assert taken(queue) == ["a 5", "b inf"]
