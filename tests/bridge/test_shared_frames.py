"""Messages between server and renderer: what arrives is what was sent, whatever is sent later."""

from __future__ import annotations

import errno
import gc
import mmap
import os
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simgl_bridge import Client, RemoteError
from simgl_bridge.shared_frames import Connection, socket_pair

from simgl import Scenario
from simgl.errors import BridgeError
from tests.bridge.harness import Running
from tests.patience import limit

# Beyond what a datagram holds.
LARGE = 300_000


@pytest.fixture
def ends() -> Iterator[tuple[Connection, Connection]]:
    """A server's end, which does not wait, and a renderer's."""
    ours, theirs = socket_pair()
    server, renderer = Connection(ours), Connection(theirs)
    yield server, renderer
    server.close()
    renderer.close()


def pixels(seed: int, size: int = LARGE) -> bytes:
    return np.random.default_rng(seed).bytes(size)


def pieces_of_memory() -> int:
    """Mappings of memory for frames in this process, which has both ends."""
    return Path("/proc/self/maps").read_text().count("simgl-frames")


@pytest.mark.parametrize("sizes", [(0,), (5,), (5, 0, 7), (100_000,), (10, LARGE, 0, LARGE)])
def test_frames_arrive_as_they_were_sent(
    ends: tuple[Connection, Connection], sizes: tuple[int, ...]
) -> None:
    server, renderer = ends
    sent = [pixels(i, size) for i, size in enumerate(sizes)]
    for sender, receiver in [(renderer, server), (server, renderer)]:
        sender.send(sent)
        assert [bytes(frame) for frame in receiver.receive()] == sent
    assert server.receive() == []
    assert not server.is_cut


def test_frames_that_are_held_keep_their_content_and_others_use_their_memory_again(
    ends: tuple[Connection, Connection],
) -> None:
    server, renderer = ends
    before = pieces_of_memory()
    held: dict[int, memoryview] = {}
    for step in range(20):
        renderer.send([b"header", pixels(step)])
        held[step] = server.receive()[1]
        # The three newest, as a server keeps replies for a repetition.
        held.pop(step - 3, None)
        for number, frame in held.items():
            assert frame == pixels(number)
        server.send([b"task"])
        assert renderer.receive() == [b"task"]
    # Three that are held and one that is written, at both ends.
    assert pieces_of_memory() == before + 8


def test_memory_that_nobody_uses_is_given_back(ends: tuple[Connection, Connection]) -> None:
    server, renderer = ends

    def shared_mib() -> float:
        status = Path("/proc/self/status").read_text()
        return int(status.split("RssShmem:")[1].split()[0]) / 1024.0

    before, size = shared_mib(), 16 * 1024 * 1024
    held = []
    for step in range(8):
        renderer.send([pixels(step, size)])
        held += server.receive()
        assert held[-1] == pixels(step, size)
    # The same memory is counted at both ends, here in one process.
    assert shared_mib() > before + 2 * 8 * 16.0 - 1.0
    held.clear()
    gc.collect()
    server.send([b"task"])
    renderer.receive()
    renderer.send([pixels(9, size)])
    assert server.receive()[0] == pixels(9, size)
    # Twice as much as the last message waits to be used again.
    assert shared_mib() < before + 2 * (2 * 16.0 + 16.0) + 1.0


def test_what_was_sent_arrives_although_the_sender_left(
    ends: tuple[Connection, Connection],
) -> None:
    server, renderer = ends
    server.send([b"a task that is never read"])
    renderer.send([pixels(1)])
    renderer.send([b"last words"])
    renderer.close()
    first = server.receive()
    assert server.receive() == [b"last words"]
    assert server.receive() == []
    assert server.is_cut
    assert first == [pixels(1)]
    with pytest.raises(BrokenPipeError):
        server.send([b"another task"])


def test_a_renderer_that_waits_notices_that_its_server_is_gone() -> None:
    ours, theirs = socket_pair()
    renderer = Connection(theirs)
    received: list[object] = []
    waiting = threading.Thread(target=lambda: received.append(renderer.receive()))
    waiting.start()
    ours.shutdown(socket.SHUT_RDWR)
    waiting.join(10.0)
    assert received == [[]]
    assert renderer.is_cut
    ours.close()
    renderer.close()


def no_memory(*_: Any, **__: Any) -> None:
    """Takes the place of a call of the system."""
    raise OSError(errno.ENOMEM, "Cannot allocate memory")


NO_MEMORY = r"there is no memory for the images \(Cannot allocate memory\)"


def test_a_message_without_memory_is_an_error_and_the_next_one_arrives(
    ends: tuple[Connection, Connection], monkeypatch: pytest.MonkeyPatch
) -> None:
    server, renderer = ends
    open_files = len(os.listdir("/proc/self/fd"))
    for fail_at_receiver in (False, True):
        with monkeypatch.context() as patch:
            if fail_at_receiver:
                renderer.send([pixels(1)])
            patch.setattr(mmap, "mmap", no_memory)
            with pytest.raises(BridgeError, match=f"^{NO_MEMORY}$"):
                server.receive() if fail_at_receiver else renderer.send([pixels(1)])
        assert server.receive() == []
        server.send([b"task"])
        renderer.receive()
        renderer.send([pixels(2)])
        assert server.receive() == [pixels(2)]
    # One piece of memory, at both ends.
    assert len(os.listdir("/proc/self/fd")) == open_files + 2


def test_a_reply_that_does_not_fit_the_memory_is_refused_and_the_server_goes_on(
    start_server: Callable[..., Running], scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Another one may have memory from before.
    client = Client(start_server(scenario).address, timeout_s=limit(20.0))
    products = ("dn", "radiance", "depth")
    with monkeypatch.context() as patch:
        patch.setattr(os, "memfd_create", no_memory)
        with pytest.raises(RemoteError, match=f"INTERNAL: {NO_MEMORY}: the renderer's process$"):
            client.render(scenario.epoch_tai_ns, "nav", products=products)
    image = client.render(scenario.epoch_tai_ns, "nav", products=products)
    assert image.planes["radiance"].shape == (48, 64, 4)
    client.close()
