"""Mutated messages against a live server: it must keep answering, and its memory must not grow.

The server records its session, so that the recorder is part of what is tried.
"""

from __future__ import annotations

import random
import socket
import struct
import time
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import zmq
from simgl_bridge import Client
from simgl_bridge.session_replay import replay_session, session_files

from benchmarks.bridge.scene import (
    chaser,
    children,
    machine,
    resident_kib,
    scenario_file,
    server_process,
)

# Mutated messages between two pings; more would fill the queues and only get BUSY.
BURST = 12
_INTERESTING: list[Any] = [
    None, True, 0, -1, 2**31, 2**63 - 1, 2**63, 2**64 - 1, -(2**63), 0.0, 1e300, float("nan"),
    float("inf"), "", "nav", "\0" * 300, "x" * 5000, "a\nb", [], {}, [[]], {"": {}}, b"\xff" * 40,
]  # fmt: skip


def fuzz(messages: int, folder: Path) -> dict[str, object]:
    """Send ``messages`` mutations: one half, then the same again.

    Memory is compared after both: in the first half the renderer meets larger rasters than before.

    Raises AssertionError unless the server works as before, and the recorded session renders to the
    same bytes.
    """
    path = scenario_file(folder)
    port = _free_port()
    address = f"tcp://127.0.0.1:{port}"
    replies: Counter[str] = Counter()
    memory: list[list[int]] = []
    command = ("simgl_bridge.commands", str(path), "--record", str(folder / "records"))
    with server_process(*command, address=address) as pid:
        processes = [pid, *children(pid)]
        with Client(address, timeout_s=60.0) as client:
            epoch = client.welcome.epoch_tai_ns
            wanted = client.render(epoch, "nav", {"chaser": chaser(1)}).dn.tobytes()
        began = time.perf_counter()
        for _ in range(2):
            _send(messages // 2, address, port, epoch, replies)
            memory.append([resident_kib(process) for process in processes])
        seconds = time.perf_counter() - began
        # A renderer that died was started again as another process.
        crashed = set(processes) - {pid, *children(pid)}
        with Client(address, timeout_s=60.0) as client:
            again = client.render(epoch, "nav", {"chaser": chaser(1)}).dn.tobytes()
            counts = client.stats()
    assert again == wanted, "the same state has other bits after the storm"
    assert not crashed, f"{len(crashed)} processes of the server died"
    (session,) = session_files(folder / "records")
    replayed = replay_session(session)
    assert not replayed.different, "the recorded session renders to other bytes"
    before, after = memory
    return {
        **machine(),
        "messages": messages,
        "answered": replies.total(),
        "crashed": len(crashed),
        "replies": dict(sorted(replies.items())),
        "server_errors_counted": counts.errors,
        "seconds": round(seconds, 1),
        "frames_replayed": replayed.frames,
        "server_and_renderer_kib": [before, after],
        "server_growth_percent": round(100.0 * (sum(after) / sum(before) - 1.0), 3),
    }


def _send(messages: int, address: str, port: int, epoch: int, replies: Counter[str]) -> None:
    """Send the same mutations each time."""
    dice = random.Random(20261121)
    sent = 0
    while sent < messages:
        burst = min(BURST, messages - sent)
        _burst(address, burst, epoch, dice, replies)
        sent += burst
        if sent % 1000 < BURST:
            _broken_wire(port, dice)


_context: zmq.Context[Any] | None = None
_links: dict[str, zmq.Socket[Any]] = {}


def _link(address: str, dice: random.Random) -> zmq.Socket[Any]:
    """A connection; a new one now and then, which a server must survive too."""
    global _context
    _context = _context or zmq.Context()
    if address in _links and dice.random() < 0.02:
        _links.pop(address).close(linger=0)
    if address not in _links:
        link = _context.socket(zmq.DEALER)
        link.linger = 0
        link.connect(address)
        _links[address] = link
    return _links[address]


def _burst(
    address: str, count: int, epoch: int, dice: random.Random, replies: Counter[str]
) -> None:
    link = _link(address, dice)
    for _ in range(count):
        link.send_multipart(_mutated(epoch, dice))
    token = dice.getrandbits(62)
    link.send_multipart([b"simgl/1", msgspec.msgpack.encode({"type": "ping", "id": token})])
    deadline = time.monotonic() + 60.0
    while True:
        assert link.poll(max(1, round(1000 * (deadline - time.monotonic())))), "no pong in 60 s"
        header = msgspec.msgpack.decode(link.recv_multipart()[1])
        if header["type"] == "pong" and header["id"] == token:
            return
        assert header.get("code") != "INTERNAL", f"a request set off {header['detail']}"
        replies[header.get("code", header["type"])] += 1


def _good(epoch: int, dice: random.Random) -> dict[str, Any]:
    """A valid request of any type."""
    pose = msgspec.to_builtins(chaser(dice.randrange(50)).as_sent())
    state = {
        "id": dice.randrange(1000),
        "tai_ns": epoch + dice.randrange(1000),
        "cameras": [{"camera": "nav", "exposure_time_s": 2e-4, "products": ["dn"]}],
        "bodies": {"chaser": pose},
        "sun": dice.choice([None, {"position_m": [1.5e11, 0.0, 0.0]}]),
        "moving": dice.random() < 0.1,
        "draw": dice.randrange(3),
    }
    return dice.choice(
        [
            {"type": "render", "seek": True, "deadline_ms": 1000, **state},
            {"type": "render", "seek": True, **state},
            {"type": "state", **state},
            {"type": "next", "id": 1, "after": 0, "deadline_ms": 1},
            {"type": "configure", "id": 2, "scenario": "small", "seed": 7},
            {"type": "hello", "client": "fuzz", "versions": ["simgl/1"]},
            {"type": "stats", "id": 3},
            {"type": "ping", "id": 4},
            {"type": "bye"},
        ]
    )


def _mutated(epoch: int, dice: random.Random) -> list[bytes]:
    """A valid message with one to three errors: in values, bytes or frames."""
    message: Any = _good(epoch, dice)
    kind = dice.random()
    if kind < 0.8:
        for _ in range(dice.randint(1, 3)):
            message = _with_wrong_value(message, dice)
    header = msgspec.msgpack.encode(message)
    if kind >= 0.75:
        header = _with_wrong_bytes(header, dice)
    frames = [b"simgl/1", header]
    if dice.random() < 0.1:
        frames = dice.choice(
            [
                [],
                [header],
                frames[::-1],
                [*frames, b""],
                [*frames, *frames],
                [b"", *frames],
                [b"simgl/2", header],
                [dice.randbytes(dice.randrange(40)), header],
                [b"simgl/1", header + bytes(dice.randrange(70_000))],
                [b"x"] * dice.randrange(1, 60),
            ]
        )
    return frames or [b""]


def _with_wrong_value(value: Any, dice: random.Random) -> Any:
    """The value with one of its leaves, keys or branches replaced, left out or doubled."""
    if isinstance(value, dict) and value and dice.random() < 0.98:
        key = dice.choice(list(value))
        change = dice.random()
        if change < 0.1:
            return {k: v for k, v in value.items() if k != key}
        if change < 0.2:
            wrong = dice.choice(["", "type", 7, "id" * 40, "\u0000"])
            return {(wrong if k == key else k): v for k, v in value.items()}
        return {**value, key: _with_wrong_value(value[key], dice)}
    if isinstance(value, list) and value and dice.random() < 0.7:
        index = dice.randrange(len(value))
        wrong = _with_wrong_value(value[index], dice)
        return [*value[:index], wrong, *value[index + dice.randrange(2) :]]
    return dice.choice(_INTERESTING)


def _with_wrong_bytes(header: bytes, dice: random.Random) -> bytes:
    content = bytearray(header)
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(content) + 1)
        change = dice.randrange(4)
        if change == 0 and at < len(content):
            content[at] ^= 1 << dice.randrange(8)
        elif change == 1:
            content[at:at] = dice.randbytes(dice.randrange(1, 9))
        elif change == 2:
            del content[at : at + dice.randrange(1, 9)]
        else:
            # A MessagePack head that announces much: map, list, text or bytes of 32 bits.
            content[at:at] = bytes([dice.choice(b"\xdf\xdd\xdb\xc6")]) + struct.pack(">I", 2**31)
    return bytes(content)


def _broken_wire(port: int, dice: random.Random) -> None:
    """A peer that does not speak ZeroMQ, or stops in the middle."""
    with socket.create_connection(("127.0.0.1", port), timeout=5.0) as peer:
        greeting = b"\xff" + bytes(8) + b"\x7f" + b"\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)
        cut = greeting[: dice.randrange(len(greeting))]
        peer.sendall(dice.choice([dice.randbytes(200), cut, greeting + dice.randbytes(100)]))


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
