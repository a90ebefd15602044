"""What goes wrong in real loops: killed, frozen, flooded, half a message, a lost GPU, a full disk.

Every wait ends, every error says what happened, and nobody else notices.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import moderngl
import msgspec
import pytest
from simgl_bridge import BodyPose, Client, NoAnswerError, RemoteError, Shot, launched_server
from simgl_bridge.framing import pack
from simgl_bridge.messages import Render

from simgl import Capture, Scenario
from simgl.errors import BridgeError
from simgl.gpu.context import current
from tests.bridge.harness import Gate, RawLink, Running, free_address, header_of, server_script
from tests.bridge.zmtp import EMPTY, PING, Wire
from tests.patience import limit

Starter = Callable[..., Running]
Connect = Callable[[Running], RawLink]
HERE = BodyPose(
    position_m=(0.0, 0.0, 40.0), velocity_m_s=(0, 0, 0), q_icrf_from_body_xyzw=(0, 0, 0, 1)
)


def packed(message: dict[str, Any]) -> list[bytes]:
    return [b"simgl/1", msgspec.msgpack.encode(message)]


def render(scenario: Scenario, id: int) -> list[bytes]:
    shot = {"camera": "nav"}
    start = scenario.epoch_tai_ns
    return packed({"type": "render", "id": id, "tai_ns": start, "cameras": [shot]})


@contextmanager
def served(path: Path, address: str, stderr: IO[bytes] | None = None) -> Iterator[Any]:
    """A server process at a known address; ends with the block."""
    command = [sys.executable, "-m", "simgl_bridge.commands", str(path), "--address", address]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=stderr)
    try:
        yield process
    finally:
        process.kill()
        process.wait(limit(10.0))


def test_a_server_killed_in_the_middle_of_a_frame_is_known_at_once(
    scenario_path: Path, scenario: Scenario
) -> None:
    address = free_address()
    now = scenario.epoch_tai_ns
    killed: list[float] = []
    with (
        served(scenario_path, address) as process,
        Client(address, timeout_s=limit(60.0)) as client,
    ):
        before = client.render(now, "nav", {"chaser": HERE})
        # Frozen first, so that the request is surely under way when it is killed.
        os.kill(process.pid, signal.SIGSTOP)

        def kill() -> None:
            killed.append(time.monotonic())
            os.kill(process.pid, signal.SIGKILL)

        killer = threading.Timer(1.0, kill)
        killer.start()
        with pytest.raises(NoAnswerError) as caught:
            client.render(now + 1, "nav")
        # Not at the deadline of 60 s.
        assert time.monotonic() - killed[0] < limit(5.0)
        killer.join()
        assert caught.value.reason == "the connection broke"
        assert caught.value.last_sequence == before.sequence == 1
        assert caught.value.age_s is not None
        assert caught.value.age_s > 1.0
        assert str(caught.value).startswith(f"{address}: the connection broke, waiting for ")
        assert str(caught.value).endswith("last image 1")
        process.wait(limit(10.0))
        with served(scenario_path, address):
            again = client.render(now, "nav", {"chaser": HERE})
        assert again.dn.tobytes() == before.dn.tobytes()
        assert client.restarts == 1


def test_a_frozen_server_is_a_timeout_and_answers_again_when_it_thaws(
    scenario_path: Path, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with (
        launched_server(scenario_path) as (process, address),
        Client(address, timeout_s=limit(20.0)) as client,
    ):
        client.render(now, "nav")
        client.timeout_s = 0.5
        os.kill(process.pid, signal.SIGSTOP)
        try:
            start = time.monotonic()
            with pytest.raises(NoAnswerError, match=r"no answer within 0\.5 s"):
                client.render(now + 1, "nav")
            assert time.monotonic() - start < limit(3.0)
        finally:
            os.kill(process.pid, signal.SIGCONT)
        client.timeout_s = limit(20.0)
        # The late reply to the request that was given up is not taken for this one's.
        assert client.render(now + 2, "nav").tai_ns == now + 2


def test_a_client_killed_or_frozen_harms_no_other(scenario_path: Path, scenario: Scenario) -> None:
    loop = (
        "import sys, time\n"
        "from simgl_bridge import Client\n"
        f"c = Client(sys.argv[1], timeout_s={limit(20.0)})\n"
        "print('here', flush=True)\n"
        "t = c.welcome.epoch_tai_ns\n"
        "while True:\n"
        "    t += 1\n"
        "    c.render(t, 'nav')\n"
    )
    now = scenario.epoch_tai_ns
    with (
        launched_server(scenario_path) as (_, address),
        Client(address, timeout_s=limit(20.0)) as client,
    ):
        for number in (signal.SIGSTOP, signal.SIGKILL):
            other = subprocess.Popen([sys.executable, "-c", loop, address], stdout=subprocess.PIPE)
            assert other.stdout is not None
            try:
                assert other.stdout.readline() == b"here\n"
                time.sleep(0.2)
                other.send_signal(number)
                for step in range(5):
                    start = time.monotonic()
                    client.render(now + step, "nav", seek=True)
                    assert time.monotonic() - start < limit(5.0)
            finally:
                other.kill()
                other.wait(limit(10.0))
                other.stdout.close()


def test_sigterm_finishes_the_frame_in_hand_and_says_bye(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    busy, idle = connect(running), connect(running)
    boot = idle.ask_map({"type": "ping", "id": 1})["boot"]
    running.simulator.hook = gate = Gate()
    busy.send(render(scenario, 1))
    gate.wait()
    busy.send(render(scenario, 2))
    running.stop.set()
    gate.open()
    assert header_of(busy.receive())["type"] == "images"
    # The request that only waited gets no picture: the goodbye says that none will come.
    for link in (busy, idle):
        assert header_of(link.receive()) == {"type": "bye", "boot": boot}
    assert running.simulator.captured == 1


def test_no_frame_begins_after_a_stop_at_the_end_of_another(
    start_server: Starter,
    scenario: Scenario,
    connect: Connect,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    running = start_server(scenario)
    simulator = running.simulator
    capture = simulator.capture

    def capture_and_stop(*arguments: Any, **options: Any) -> Capture:
        taken = capture(*arguments, **options)
        running.stop.set()
        return taken

    monkeypatch.setattr(simulator, "capture", capture_and_stop)
    simulator.hook = gate = Gate()
    busy = connect(running)
    busy.send(render(scenario, 1))
    gate.wait()
    busy.send(render(scenario, 2))
    gate.open()
    assert header_of(busy.receive())["type"] == "images"
    assert header_of(busy.receive())["type"] == "bye"
    assert simulator.captured == 1


def test_a_goodbye_ends_the_wait_at_once(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    running.simulator.hook = gate = Gate()
    with Client(running.address, timeout_s=limit(20.0)) as client:
        connect(running).send(render(scenario, 1))
        gate.wait()

        def end() -> None:
            time.sleep(limit(0.3))
            running.stop.set()
            gate.open(0.0)

        ender = threading.Thread(target=end)
        ender.start()
        start = time.monotonic()
        with pytest.raises(NoAnswerError, match="the server said goodbye, waiting for render"):
            client.render(scenario.epoch_tai_ns, "nav")
        assert time.monotonic() - start < limit(5.0)
        ender.join()


def test_a_flood_harms_no_other(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    flood = connect(running)
    with Client(running.address, timeout_s=limit(20.0)) as client:
        times = []
        for step in range(10):
            for id in range(100):
                flood.send_or_drop(render(scenario, id))
            start = time.monotonic()
            client.render(scenario.epoch_tai_ns + step, "nav")
            times.append(time.monotonic() - start)
        # At worst a picture of the other's, and the refusals of what lies at the socket.
        assert max(times) < limit(3.0)
        counts = client.stats()
    assert counts.busy > 0
    assert counts.waiting <= 2


def test_a_burst_with_a_heartbeat_and_a_broken_link_do_not_end_the_service(
    scenario_path: Path,
) -> None:
    address = free_address()
    script = server_script(
        "render = r.render_images\n"
        "def slowly(session, request):\n"
        "    time.sleep(0.5)\n"
        "    return render(session, request)\n"
        "r.render_images = slowly\n"
    )
    command = [sys.executable, "-c", script, str(scenario_path), "--address", address]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        with Client(address, timeout_s=limit(60.0)) as client:
            now = client.welcome.epoch_tai_ns
            wire = Wire(address)
            version, header = pack(Render(id=1, tai_ns=now, cameras=(Shot(camera="nav"),)))
            wire.frame(version, more=True)
            wire.frame(header, more=False)
            # While that picture is in hand the others wait for their turn.
            time.sleep(0.1)
            wire.raw(EMPTY * 100 + PING)
            time.sleep(0.1)
            wire.reset()
            assert client.render(now, "nav").dn.shape == (48, 64)
        process.terminate()
        assert process.wait(limit(20.0)) == 0
    finally:
        process.kill()
        process.wait(limit(10.0))


def test_replies_that_are_taken_late_are_whole_and_in_order(
    start_server: Starter, scenario: Scenario, connect: Connect
) -> None:
    running = start_server(scenario)
    slow = connect(running)
    slow.ask_map({"type": "hello", "client": "slow", "versions": ["simgl/1"]})
    with Client(running.address, timeout_s=limit(20.0)) as client:
        for step in range(20):
            slow.send(render(scenario, step))
            start = time.monotonic()
            client.render(scenario.epoch_tai_ns + step, "nav")
            assert time.monotonic() - start < limit(5.0)
    # Whatever it did get is whole and in order.
    ids = []
    while slow.has_reply():
        header = header_of(slow.receive())
        if header["type"] == "images":
            ids.append(header["id"])
    assert ids == sorted(ids)
    assert ids


def test_a_reader_whose_replies_pile_up_loses_those_and_holds_up_nobody(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    # It asks for the same 49 kB again and again, and never takes a byte off its connection.
    shot = {"camera": "nav", "products": ["radiance"]}
    start = scenario.epoch_tai_ns
    version, header = packed({"type": "render", "id": 1, "tai_ns": start, "cameras": [shot]})
    stuck = Wire(running.address, room=4096)
    with Client(running.address, timeout_s=limit(20.0)) as client:
        times = []
        for step in range(20):
            for _ in range(50):
                stuck.frame(version, more=True)
                stuck.frame(header, more=False)
            began = time.monotonic()
            client.render(scenario.epoch_tai_ns + step, "nav")
            times.append(time.monotonic() - began)
        counts = client.stats()
    # A thousand replies, of which the queue and the system's buffers hold some 300.
    assert counts.repeated + counts.lost > 500
    assert counts.lost > 200
    assert max(times) < limit(3.0)
    assert running.simulator.captured == 21
    stuck.close()


def test_two_gigabytes_announced_cost_the_sender_its_link_and_the_server_nothing(
    running: Running, client: Client, scenario: Scenario
) -> None:
    before = resident_bytes()
    for size in (2**31, 2**33, 2**63 - 1, 1024 * 1024 + 1):
        wire = Wire(running.address)
        wire.frame(b"simgl/1", more=True)
        wire.announce(size, more=False)
        assert wire.is_hung_up(), size
        wire.close()
    assert client.render(scenario.epoch_tai_ns, "nav").dn.shape == (48, 64)
    assert resident_bytes() - before < 64 * 1024 * 1024


def test_half_a_message_is_never_a_request(
    running: Running, client: Client, scenario: Scenario
) -> None:
    version, header = render(scenario, 1)
    before = client.stats()
    for part in (1, len(header) // 2, len(header) - 1):
        wire = Wire(running.address)
        wire.frame(version, more=True)
        wire.announce(len(header), more=False)
        wire.raw(header[:part])
        # Slow, then gone: the others are served meanwhile.
        assert client.render(scenario.epoch_tai_ns + part, "nav").dn.shape == (48, 64)
        wire.close()
    only_version = Wire(running.address)
    only_version.frame(version, more=True)
    only_version.close()
    after = client.stats()
    assert after.images == before.images + 3
    assert after.errors == before.errors


def test_bytes_that_are_no_zeromq_are_hung_up_on(running: Running, client: Client) -> None:
    import socket

    host, _, port = running.address.removeprefix("tcp://").rpartition(":")
    for content in (b"GET / HTTP/1.1\r\n\r\n", bytes(100), b"\xff" * 200):
        with socket.create_connection((host, int(port)), timeout=limit(5.0)) as peer:
            peer.sendall(content)
    assert client.ping() < limit(5.0)


def test_a_lost_gpu_is_told_and_a_new_context_serves_the_same_request(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(60.0)) as client:
        wanted = client.render(now, "nav", {"chaser": HERE})

        def lose() -> None:
            raise moderngl.Error("GL_CONTEXT_LOST")

        running.simulator.hook = lose
        with pytest.raises(RemoteError) as caught:
            client.render(now, "nav", {"chaser": HERE})
        assert (caught.value.code, caught.value.retryable) == ("GPU_LOST", True)
        assert caught.value.detail == (
            "OpenGL failed: Error: GL_CONTEXT_LOST; a new context is opened"
        )
        again = client.render(now, "nav", {"chaser": HERE})
        assert len(running.simulators) == 2
        assert again.dn.tobytes() == wanted.dn.tobytes()


def test_an_error_flag_of_opengl_makes_no_picture(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    with Client(running.address, timeout_s=limit(60.0)) as client:
        simulator = running.simulator

        def spoil() -> None:
            # What a call on a broken context leaves behind; nothing raises.
            with current(simulator._ctx):
                simulator._ctx.enable_direct(0xDEAD)

        simulator.hook = spoil
        with pytest.raises(RemoteError, match="GPU_LOST: OpenGL reports GL_INVALID_ENUM"):
            client.render(scenario.epoch_tai_ns, "nav")
        assert client.render(scenario.epoch_tai_ns, "nav").sequence == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_under_its_log_does_not_end_the_service(scenario_path: Path) -> None:
    address = free_address()
    script = server_script(
        "render = r.render_images\n"
        "def fail(session, request):\n"
        "    if request.id == 99: raise RuntimeError('written to the log')\n"
        "    return render(session, request)\n"
        "r.render_images = fail\n"
    )
    command = [sys.executable, "-c", script, str(scenario_path), "--address", address]
    with open("/dev/full", "wb") as full:
        process = subprocess.Popen(command, stdout=full, stderr=full)
    try:
        with Client(address, timeout_s=limit(60.0)) as client:
            now = client.welcome.epoch_tai_ns
            client._protocol._last_id = 98
            with pytest.raises(RemoteError, match="INTERNAL: RuntimeError: written to the log"):
                client.render(now, "nav")
            assert client.render(now, "nav").sequence == 1
        process.terminate()
        assert process.wait(limit(20.0)) == 0
    finally:
        process.kill()
        process.wait(limit(10.0))


def test_the_wall_clock_is_nowhere_in_a_picture(
    client: Client, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = scenario.epoch_tai_ns
    first = client.render(now, "nav", {"chaser": HERE})
    monkeypatch.setattr(time, "time", lambda: 4e9)
    again = client.render(now, "nav", {"chaser": HERE})
    assert again.dn.tobytes() == first.dn.tobytes()


@pytest.mark.parametrize("jump", [3600.0, -3600.0])
def test_a_jump_of_the_wall_clock_ends_no_wait_and_stretches_none(
    start_server: Starter,
    scenario: Scenario,
    connect: Connect,
    monkeypatch: pytest.MonkeyPatch,
    jump: float,
) -> None:
    running = start_server(scenario)
    now, honest = scenario.epoch_tai_ns, time.time
    first = connect(running)
    with Client(running.address, timeout_s=limit(10.0)) as client:
        running.simulator.hook = gate = Gate()
        first.send(render(scenario, 1))
        gate.wait()
        first.send(render(scenario, 2))
        answers: list[Any] = []
        asker = threading.Thread(target=lambda: answers.append(client.render(now, "nav")))
        asker.start()

        # Its request waits in the queue, with a deadline, when the clock jumps.
        def jumps() -> None:
            monkeypatch.setattr(time, "time", lambda: honest() + jump)

        running.simulator.hook = jumps
        gate.open()
        asker.join(limit(20.0))
        assert [image.tai_ns for image in answers] == [now]
        # And a wait that nobody answers ends when it would have.
        running.simulator.hook = frozen = Gate()
        client.timeout_s = 0.6
        back = threading.Timer(0.2, lambda: monkeypatch.setattr(time, "time", honest))
        back.start()
        start = time.monotonic()
        with pytest.raises(RemoteError, match=r"DEADLINE: deadline_ms is over: too late"):
            client.render(now + 1, "nav")
        assert time.monotonic() - start < limit(3.0)
        back.join()
        frozen.open(0.0)


def test_a_gap_in_ids_and_an_old_id_are_nothing_special(raw: RawLink, scenario: Scenario) -> None:
    for id in (5, 1000, 7, 2**63 - 1, 0):
        raw.send(render(scenario, id))
        assert header_of(raw.receive())["id"] == id


def test_a_client_without_a_server_has_its_error_within_its_deadline() -> None:
    start = time.monotonic()
    with pytest.raises(BridgeError, match=r"no connection within 0\.4 s"):
        Client(free_address(), timeout_s=0.4)
    assert time.monotonic() - start < limit(3.0)


def resident_bytes() -> int:
    """Memory of this process that lies in RAM."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
