"""Two live sockets of one identity: both are told, and no image reaches the wrong one."""

from __future__ import annotations

import os
import socket
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zmq
from simgl_bridge import Client, NoAnswerError, RemoteError
from simgl_bridge.identity_watch import IdentityWatch

from simgl import Scenario
from tests.bridge.harness import Gate, RawLink, Running, header_of
from tests.patience import limit, wait_until

Starter = Callable[..., Running]
Twins = tuple[IdentityWatch, zmq.Socket[bytes], zmq.Socket[bytes]]
PROBLEM = 'another client uses the identity "twin", too; every client needs its own'


@pytest.mark.parametrize("transport", ["tcp", "ipc"])
def test_two_sockets_of_one_identity_are_both_told(
    start_server: Starter, scenario: Scenario, tmp_path: Path, transport: str
) -> None:
    address = "tcp://127.0.0.1:*" if transport == "tcp" else f"ipc://{tmp_path / 's'}"
    running = start_server(scenario, address)
    running.simulator.hook = gate = Gate()
    older = RawLink(running.address, identity=b"twin")
    shot = {"camera": "nav"}
    request = {"type": "render", "id": 1, "tai_ns": scenario.epoch_tai_ns, "cameras": [shot]}
    older.send([b"simgl/1", msgspec.msgpack.encode(request)])
    gate.wait()
    newer = RawLink(running.address, identity=b"twin")
    told = newer.ask_map({"type": "ping", "id": 1})
    assert (told["code"], told["id"], told["detail"]) == ("SHARED_IDENTITY", None, PROBLEM)
    # The older one has a request under way, and sends nothing more.
    told = header_of(older.receive())
    assert (told["code"], told["id"], told["detail"]) == ("SHARED_IDENTITY", None, PROBLEM)
    gate.open(0.0)
    older.close()
    # The image of the older one never reaches the newer one, which is served once it is alone.
    pongs = []

    def is_served() -> bool:
        newer.send([b"simgl/1", msgspec.msgpack.encode({"type": "ping", "id": 2})])
        while newer.has_reply():
            reply = header_of(newer.receive())
            assert reply["type"] in ("error", "pong")
            pongs.extend([reply] if reply["type"] == "pong" else [])
        return bool(pongs)

    wait_until(is_served, "an answer", 10.0)
    newer.close()
    running.stop.set()


def test_two_python_clients_of_one_identity_are_both_told(
    start_server: Starter, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    running = start_server(scenario)
    twin = uuid.uuid4()
    monkeypatch.setattr(uuid, "uuid4", lambda: twin)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(5.0)) as older:
        older.render(now, "nav")
        with pytest.raises(RemoteError, match=r"SHARED_IDENTITY: another client uses the identity"):
            Client(running.address, timeout_s=limit(5.0))
        codes, reasons = [], set()

        def is_told() -> bool:
            try:
                older.render(now + 1, "nav")
            except RemoteError as error:
                codes.append(error.code)
            except NoAnswerError as error:
                # Its connection was ended, which it may notice first.
                reasons.add(error.reason)
            return bool(codes)

        wait_until(is_told, "the error", 10.0)
        assert codes == ["SHARED_IDENTITY"]
        assert reasons <= {"the connection broke"}


@pytest.fixture
def twins() -> Iterator[Twins]:
    """The watch of a ROUTER socket at which one client took the identity of another, and both."""
    context: zmq.Context[Any] = zmq.Context()
    router = context.socket(zmq.ROUTER)
    router.setsockopt(zmq.ROUTER_HANDOVER, 1)
    watch = IdentityWatch(router)
    port = router.bind_to_random_port("tcp://127.0.0.1")
    clients = []
    for is_second in (False, True):
        clients.append(context.socket(zmq.DEALER))
        clients[-1].setsockopt(zmq.IDENTITY, b"twin")
        clients[-1].setsockopt(zmq.RECONNECT_IVL, 10)
        clients[-1].connect(f"tcp://127.0.0.1:{port}")
        clients[-1].send(b"hello")
        assert router.poll(limit(5.0) * 1000.0)
        client, message = router.recv_multipart(copy=False)
        assert watch.is_taken_over(client.bytes, message) is is_second
    yield watch, clients[0], clients[1]
    watch.close()
    context.destroy(linger=0)


def test_a_server_that_was_held_up_tells_no_less(twins: Twins) -> None:
    watch, *_ = twins
    told = [watch.contested(now) for now in (0.0, 60.0, 120.0, 180.0, 240.0)]
    assert told == [[b"twin"]] * 5
    assert [watch.contested(300.0 + now) for now in range(20)][-1] == []


def test_a_socket_that_took_the_number_of_a_closed_connection_stays_open(
    twins: Twins, monkeypatch: pytest.MonkeyPatch
) -> None:
    watch, *_ = twins
    near, far = socket.socketpair()
    with near, far:
        # As if ZeroMQ had closed each of its connections, and their numbers were this socket's now.
        real_dup = os.dup
        monkeypatch.setattr(os, "dup", lambda _: real_dup(near.fileno()))
        for telling in range(20):
            watch.contested(float(telling))
            time.sleep(0.02)
        near.send(b"open")
        assert far.recv(4) == b"open"
