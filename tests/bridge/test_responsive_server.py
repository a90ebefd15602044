"""A server answers at once, whatever its renderer does: load, draw without a pause, hang, die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
from simgl_bridge import Client, NoAnswerError, ServerStatus

from simgl import Scenario
from tests.bridge.harness import RawLink, free_address, header_of, server_script
from tests.patience import limit, run_to_end, wait_until

# What is promised [s].
AT_ONCE = 0.2
# Holds Python's lock in one call, as a driver or a library does: nothing else of its process runs.
HOLD = "import ctypes\nhold = ctypes.PyDLL(None).usleep\n"
# While a scenario is loaded, each time.
SLOW_LOAD = (
    HOLD
    + "load = r.load_scenario\nr.load_scenario = lambda *a, **k: (hold({us}), load(*a, **k))[1]"
)
# In a frame whose gain is 2.
SLOW_DRAW = HOLD + (
    "render = r.render_images\n"
    "def slowly(session, request):\n"
    "    if request.cameras[0].gain_dn_per_e == 2.0: hold({us})\n"
    "    return render(session, request)\n"
    "r.render_images = slowly\n"
)


@contextmanager
def served(path: Path, patch: str, *options: str) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A server process whose renderer is patched, and its address."""
    address = free_address()
    command = [sys.executable, "-c", server_script(patch), str(path), "--address", address]
    process = subprocess.Popen(
        [*command, *options], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    try:
        yield process, address
    finally:
        process.kill()
        process.communicate(timeout=limit(20.0))


def renderer_of(server: subprocess.Popen[bytes]) -> int:
    """Process id of the renderer of a server."""
    children = Path(f"/proc/{server.pid}/task/{server.pid}/children").read_text().split()
    (renderer,) = children
    return int(renderer)


def is_running(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def asked(link: RawLink, request: object) -> tuple[float, str, ServerStatus]:
    """How long an answer takes [s], its type, and the status that it tells."""
    start = time.monotonic()
    header = link.ask_map(request)
    elapsed = time.monotonic() - start
    return elapsed, header["type"], msgspec.convert(header["status"], ServerStatus)


def wait_for(link: RawLink, word: str) -> None:
    """Until a server says that it does something: a state, or what it prepares."""

    def says_so() -> bool:
        status = asked(link, {"type": "ping", "id": 1})[2]
        return word in (status.state, status.detail)

    wait_until(says_so, word)


def slowest(link: RawLink, states: set[str], seconds: float) -> float:
    """The slowest of the pings of some time [s], all of which tell one of some states."""
    times = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        elapsed, _, status = asked(link, {"type": "ping", "id": 7})
        assert status.state in states
        times.append(elapsed)
        time.sleep(0.02)
    return max(times)


HELLO = {"type": "hello", "client": "raw", "versions": ["simgl/1"]}


def test_while_a_scenario_is_loaded_a_greeting_is_answered_at_once(scenario_path: Path) -> None:
    with served(scenario_path, SLOW_LOAD.format(us=3_000_000)) as (_, address):
        link = RawLink(address)
        # The process starts: its imports, no more.
        _, kind, status = asked(link, HELLO)
        assert (kind, status.state) == ("pong", "starting")
        wait_for(link, "loading the scenario")
        assert slowest(link, {"starting"}, 2.0) < limit(AT_ONCE)
        elapsed, kind, _ = asked(link, HELLO)
        assert kind == "pong"
        assert elapsed < limit(AT_ONCE)
        # The welcome follows, for which a client of an older version waits.
        assert header_of(link.receive())["type"] == "welcome"
        _, kind, status = asked(link, HELLO)
        assert (kind, status.state) == ("welcome", "ready")


def test_a_client_waits_for_a_server_that_starts_and_sees_how_far_it_is(
    scenario_path: Path,
) -> None:
    seen: list[ServerStatus] = []
    with (
        served(scenario_path, SLOW_LOAD.format(us=2_000_000)) as (_, address),
        # The short timeout is for a server that says nothing.
        Client(address, timeout_s=limit(2.0), on_status=seen.append) as client,
    ):
        assert client.render(client.welcome.epoch_tai_ns, "nav").dn.shape == (48, 64)
        status = client.status()
        assert status is not None
        assert status.state == "ready"
    assert {"starting", "ready"} == {status.state for status in seen}
    assert "loading the scenario" in {status.detail for status in seen}


def test_a_client_gives_up_a_server_that_is_not_ready_in_time(scenario_path: Path) -> None:
    with served(scenario_path, SLOW_LOAD.format(us=60_000_000)) as (process, address):
        link = RawLink(address)
        link.ask_map(HELLO)
        link.close()
        with pytest.raises(NoAnswerError) as caught:
            Client(address, timeout_s=limit(5.0), ready_timeout_s=0.5)
        assert caught.value.reason.startswith("not done within 0.5 s (starting ")
        start = time.monotonic()
        process.send_signal(signal.SIGTERM)
        # What only loads owes nobody an image.
        assert process.wait(limit(20.0)) == 0
        assert time.monotonic() - start < limit(5.0)


def test_a_draw_that_never_pauses_keeps_nobody_waiting(
    scenario_path: Path, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with (
        served(scenario_path, SLOW_DRAW.format(us=4_000_000)) as (_, address),
        Client(address, timeout_s=limit(20.0)) as client,
    ):
        link = RawLink(address)
        slow = {"camera": "nav", "gain_dn_per_e": 2.0}
        request = {"type": "render", "id": 1, "tai_ns": now, "cameras": [slow]}
        link.send([b"simgl/1", msgspec.msgpack.encode({**request, "deadline_ms": 1000})])
        start = time.monotonic()
        other = RawLink(address)
        wait_for(other, "drawing")
        assert slowest(other, {"drawing"}, 0.7) < limit(AT_ONCE)
        late = header_of(link.receive())
        # At the deadline, while the frame is drawn.
        assert (late["code"], late["id"], late["retryable"]) == ("DEADLINE", 1, True)
        assert 0.9 < time.monotonic() - start < 1.0 + limit(AT_ONCE)
        assert slowest(other, {"drawing"}, 0.5) < limit(AT_ONCE)
        elapsed, kind, status = asked(other, HELLO)
        assert elapsed < limit(AT_ONCE)
        assert (kind, status.state) == ("welcome", "drawing")
        # The next request waits for its turn, and gets its own image.
        assert client.render(now + 5, "nav").tai_ns == now + 5
        # The one that was too late was drawn to its end: repeated, it is answered at once.
        link.send([b"simgl/1", msgspec.msgpack.encode({**request, "deadline_ms": 1000})])
        images = header_of(link.receive())
        assert (images["type"], images["tai_ns"]) == ("images", now)


def test_a_frozen_renderer_is_drawing_for_so_long_and_goes_on_when_it_thaws(
    scenario_path: Path, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with (
        served(scenario_path, "") as (process, address),
        Client(address, timeout_s=limit(20.0)) as client,
    ):
        wanted = client.render(now, "nav")
        renderer = renderer_of(process)
        os.kill(renderer, signal.SIGSTOP)
        link = RawLink(address)
        shot = {"camera": "nav"}
        request = {"type": "render", "id": 1, "tai_ns": now, "cameras": [shot]}
        link.send([b"simgl/1", msgspec.msgpack.encode(request)])
        time.sleep(0.5)
        status = client.status()
        assert status is not None
        assert status.state == "drawing"
        assert 0.3 < status.since_s < limit(2.0)
        os.kill(renderer, signal.SIGCONT)
        assert link.receive()[2] == wanted.dn.tobytes()


def test_a_renderer_that_is_killed_is_started_again_and_its_request_is_told(
    scenario_path: Path, scenario: Scenario
) -> None:
    now = scenario.epoch_tai_ns
    with served(scenario_path, SLOW_DRAW.format(us=60_000_000)) as (process, address):
        with Client(address, timeout_s=limit(60.0)) as client:
            before = client.render(now, "nav")
            link = RawLink(address)
            slow = {"camera": "nav", "gain_dn_per_e": 2.0}
            request = {"type": "render", "id": 1, "tai_ns": now, "cameras": [slow]}
            link.send([b"simgl/1", msgspec.msgpack.encode(request)])
            wait_for(link, "drawing")
            os.kill(renderer_of(process), signal.SIGKILL)
            start = time.monotonic()
            told = header_of(link.receive())
            assert time.monotonic() - start < limit(1.0)
            assert (told["code"], told["id"], told["retryable"]) == ("RENDERER_LOST", 1, True)
            assert told["detail"] == "the renderer died of SIGKILL and is started again"
            status = client.status()
            assert status is not None
            assert status.state == "lost"
            # The next request waits for the new one: the server is the same, and so is the image.
            again = client.render(now, "nav")
            assert again.dn.tobytes() == before.dn.tobytes()
            assert client.restarts == 0
            link.close()
        process.send_signal(signal.SIGTERM)
        assert process.wait(limit(20.0)) == 0
        assert process.stderr is not None
        said = process.stderr.read().decode()
        assert said == "simgl: the renderer died of SIGKILL and is started again\n"


def test_a_scenario_that_kills_every_renderer_ends_the_server_with_the_reason(
    scenario_path: Path,
) -> None:
    patch = (
        "import os, signal\nr.load_scenario = lambda *a, **k: os.kill(os.getpid(), signal.SIGSEGV)"
    )
    with served(scenario_path, patch) as (process, _):
        assert process.wait(limit(120.0)) == 2
        assert process.stderr is not None
        said = process.stderr.read().decode().splitlines()
    # Between them the stacks of each.
    assert [line for line in said if line.startswith("simgl: ")] == [
        *["simgl: the renderer died of SIGSEGV and is started again"] * 4,
        "simgl: the renderer died of SIGSEGV, 5 times in a row",
    ]


@pytest.mark.parametrize("state", ["loading", "frozen"])
def test_a_renderer_ends_with_its_server_however_that_ends(scenario_path: Path, state: str) -> None:
    patch = SLOW_LOAD.format(us=600_000_000) if state == "loading" else ""
    with served(scenario_path, patch) as (process, address):
        link = RawLink(address)
        link.ask_map(HELLO)
        renderer = renderer_of(process)
        if state == "loading":
            wait_for(link, "loading the scenario")
        else:
            link.receive()
            os.kill(renderer, signal.SIGSTOP)
        link.close()
        process.kill()
        wait_until(lambda: not is_running(renderer), "the end of the renderer", 10.0)


def test_a_server_imports_nothing_that_only_its_renderer_needs() -> None:
    """Its first answer comes within a second of its start."""
    slow = ("scipy", "trimesh", "moderngl", "simgl.simulator", "simgl.scenario")
    program = "import sys, simgl_bridge.serving\nprint(*sys.modules)"
    loaded = run_to_end([sys.executable, "-c", program]).stdout.split()
    assert not [name for name in loaded if name.startswith(slow)]
