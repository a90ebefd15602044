"""Every wait ends; servers and clients come and go."""

from __future__ import annotations

import os
import signal
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import pytest
import zmq
from simgl_bridge import Client, NoAnswerError, RemoteError, launched_server
from simgl_bridge.bind_address import check_bindable, is_loopback
from simgl_bridge.commands import serve
from simgl_bridge.processes import run_restarting

from simgl import Scenario
from simgl.errors import BridgeError, ConfigError
from tests.bridge.harness import RawLink, Running, free_address
from tests.patience import limit, run_to_end, wait_until

Starter = Callable[..., Running]


def test_without_a_server_the_client_gives_up_and_names_the_address() -> None:
    start = time.monotonic()
    with pytest.raises(BridgeError) as caught:
        Client("tcp://127.0.0.1:1", timeout_s=0.3)
    assert str(caught.value) == (
        "tcp://127.0.0.1:1: no connection within 0.3 s, waiting for hello; "
        "never heard of it, no image before"
    )
    assert 0.25 < time.monotonic() - start < limit(2.0)


def kept_process(parent: int) -> int:
    """The server that a process looks after."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    (kept,) = [c for c in children if b"spawn_main" in Path(f"/proc/{c}/cmdline").read_bytes()]
    return int(kept)


def is_running(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


@pytest.fixture
def kept(scenario_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A server that is started again whenever it dies."""
    address = free_address()
    command = [sys.executable, "-m", "simgl_bridge.commands", str(scenario_path)]
    command += ["--address", address, "--restart"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    yield process, address
    process.kill()
    process.communicate(timeout=limit(20.0))


def test_a_server_that_a_fault_kills_goes_on_with_the_same_pictures(
    kept: tuple[subprocess.Popen[bytes], str], scenario: Scenario
) -> None:
    process, address = kept
    now = scenario.epoch_tai_ns
    with Client(address, timeout_s=limit(60.0)) as client:
        first = client.render(now, "nav")
        os.kill(kept_process(process.pid), signal.SIGABRT)
        # At once where the death is noticed in the middle of it, else by the new server.
        with suppress(NoAnswerError):
            client.render(now, "nav")
        again = client.render(now, "nav")
        assert again.sequence in (1, 2)
        assert client.restarts == 1
    assert again.dn.tobytes() == first.dn.tobytes()
    process.send_signal(signal.SIGTERM)
    assert process.stderr is not None
    assert b"simgl: the server died of SIGABRT and is started again" in process.stderr.read()
    assert process.wait(limit(20.0)) == 0


def test_a_kept_server_ends_with_the_process_that_keeps_it(
    kept: tuple[subprocess.Popen[bytes], str],
) -> None:
    process, address = kept
    Client(address, timeout_s=limit(60.0)).close()
    server = kept_process(process.pid)
    process.kill()
    wait_until(lambda: not is_running(server), "the end of the server", 20.0)


def test_a_process_that_keeps_dying_is_given_up(capfd: pytest.CaptureFixture[str]) -> None:
    line = r"^the server died 5 times in a row, the last time of SIGABRT$"
    with pytest.raises(BridgeError, match=line):
        run_restarting(os.abort, (), Event())
    assert capfd.readouterr().err.count("died of SIGABRT and is started again") == 4


def test_a_restart_needs_an_address_that_stays(scenario_path: Path) -> None:
    command = [sys.executable, "-m", "simgl_bridge.commands", str(scenario_path), "--restart"]
    command += ["--address", "tcp://127.0.0.1:*"]
    run = run_to_end(command, check=False)
    assert run.returncode == 2
    assert run.stderr == "simgl: simgl serve: --restart needs ports that stay the same, not :*\n"


def test_a_launched_server_ends_with_the_process_that_launched_it(scenario_path: Path) -> None:
    script = (
        "import sys, time\n"
        "from simgl_bridge import launched_server\n"
        "with launched_server(sys.argv[1], timeout_s=500.0) as (process, _):\n"
        "    print(process.pid, flush=True)\n"
        "    time.sleep(3600.0)\n"
    )
    command = [sys.executable, "-c", script, str(scenario_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as launcher:
        assert launcher.stdout is not None
        server = int(launcher.stdout.readline())
        assert is_running(server)
        # Without any chance to end the server itself.
        launcher.kill()
    deadline = time.monotonic() + 60.0
    while is_running(server) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not is_running(server)


def test_a_malformed_address_is_named() -> None:
    with pytest.raises(BridgeError, match=r"^nonsense: is not an address"):
        Client("nonsense")


@pytest.mark.parametrize("timeout", [0.0, -1.0, float("inf"), float("nan")])
def test_a_wait_without_end_is_refused(timeout: float) -> None:
    with pytest.raises(ConfigError, match="timeout_s must be finite, above 0 s"):
        Client("tcp://127.0.0.1:1", timeout_s=timeout)


def test_a_client_may_be_more_patient_than_any_server(running: Running, scenario: Scenario) -> None:
    with Client(running.address, timeout_s=1e6) as client:
        assert client.render(scenario.epoch_tai_ns, "nav").dn.shape == (48, 64)


def test_a_slow_picture_is_too_late_and_the_next_request_does_not_get_it(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(running.address, timeout_s=limit(5.0)) as client:
        client.render(now, "nav")
        client.timeout_s = 0.3
        running.simulator.hook = lambda: time.sleep(0.6)
        start = time.monotonic()
        with pytest.raises(RemoteError) as caught:
            client.render(now + 1, "nav")
        assert time.monotonic() - start < limit(0.3)
        running.simulator.hook = None
        assert (caught.value.code, caught.value.retryable) == ("DEADLINE", True)
        assert caught.value.detail == (
            "deadline_ms is over: too late, there was no image after 150 ms"
        )
        client.timeout_s = limit(5.0)
        next_one = client.render(now + 2, "nav")
        assert (next_one.tai_ns, next_one.sequence) == (now + 2, 3)


def test_a_retry_gets_the_picture_that_was_late_without_a_second_one(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    with Client(running.address, timeout_s=limit(5.0)) as client:
        client.render(scenario.epoch_tai_ns, "nav")
        client.timeout_s = limit(0.8)
        running.simulator.hook = lambda: time.sleep(limit(1.0))
        image = client.render(scenario.epoch_tai_ns + 1, "nav", retry=True)
        assert image.sequence == 2
        assert client.ping() < limit(0.8)
    assert running.simulator.captured == 2


def test_a_stop_in_the_middle_of_a_frame_sends_the_frame_first(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario)
    with Client(running.address, timeout_s=limit(5.0)) as client:
        running.simulator.hook = running.stop.set
        image = client.render(scenario.epoch_tai_ns, "nav")
    assert image.sequence == 1
    running.thread.join(timeout=limit(10.0))
    assert not running.thread.is_alive()


def test_after_a_restart_the_next_image_is_the_one_that_the_first_server_would_have_sent(
    start_server: Starter, scenario: Scenario
) -> None:
    first = start_server(scenario)
    now = scenario.epoch_tai_ns
    with Client(first.address, timeout_s=limit(60.0)) as client:
        client.render(now, "nav")
        wanted = client.render(now + 1, "nav")
        first.stop.set()
        first.thread.join(timeout=limit(10.0))
        start_server(scenario, first.address)
        again = client.render(now + 1, "nav")
        assert again.dn.tobytes() == wanted.dn.tobytes()
        assert again.state_hash == wanted.state_hash
        assert client.restarts == 1
        assert again.sequence == 1


def test_a_restart_with_another_scene_or_seed_is_an_error(
    start_server: Starter, scenario: Scenario
) -> None:
    first = start_server(scenario)
    with Client(first.address, timeout_s=limit(60.0)) as client:
        first.stop.set()
        first.thread.join(timeout=limit(10.0))
        start_server(replace(scenario, seed=8), first.address)
        with pytest.raises(BridgeError, match=r"another scene now, .* with seed 8 instead of"):
            client.render(scenario.epoch_tai_ns, "nav")


def test_a_client_back_with_its_identity_takes_over(running: Running) -> None:
    for _ in range(5):
        link = RawLink(running.address, identity=b"restarted")
        assert link.ask_map({"type": "ping", "id": 1})["type"] == "pong"
        link.close()


@pytest.mark.parametrize(
    "address",
    [
        "tcp://0.0.0.0:5563",
        "tcp://*:5563",
        "tcp://192.168.1.4:5563",
        "tcp://example.org:5563",
        "tcp://127.0.0.1.example.org:5563",
        "tcp://[::]:5563",
    ],
)
def test_an_address_beyond_this_machine_is_refused(address: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check_bindable(address)
    assert str(caught.value) == (
        "simgl serve: --address must be tcp://127.0.0.1:PORT or ipc://PATH, "
        f'got "{address}": beyond this machine it needs --keys and --allow, or --insecure'
    )
    check_bindable(address, remote_allowed=True)


def test_basilisk_stays_on_this_machine_whatever_is_said() -> None:
    with pytest.raises(ConfigError) as caught:
        check_bindable("tcp://0.0.0.0:5556", option="--basilisk")
    assert str(caught.value) == (
        "simgl serve: --basilisk must be tcp://127.0.0.1:PORT or ipc://PATH, "
        'got "tcp://0.0.0.0:5556": Basilisk\'s protocol has no keys, so it stays on this machine'
    )


@pytest.mark.parametrize(
    ("option", "value"),
    [("monitor", "tcp://127.0.0.1:5564"), ("rate_hz", 5.0), ("insecure", True)],
)
def test_an_option_that_basilisk_alone_would_ignore_is_refused(option: str, value: object) -> None:
    said: dict[str, Any] = {option: value}
    with pytest.raises(ConfigError, match=rf"--{option.replace('_', '-')} requires --address"):
        serve(basilisk="tcp://127.0.0.1:5556", **said)


@pytest.mark.parametrize(
    ("address", "here"),
    [
        ("tcp://127.0.0.1:5563", True),
        ("tcp://127.1.2.3:*", True),
        ("tcp://localhost:5563", True),
        ("tcp://[::1]:5563", True),
        ("tcp://127.0.0.1.example.org:5563", False),
        ("tcp://*:5563", False),
        ("tcp://192.168.1.4:5563", False),
        ("ipc:///tmp/simgl", False),
    ],
)
def test_only_the_loopback_has_a_short_buffer(address: str, here: bool) -> None:
    # A short one would hold up pictures on a network with some delay.
    assert is_loopback(address) == here


def has_ipv6() -> bool:
    """Whether this machine has a loopback of IP version 6."""
    with socket.socket(socket.AF_INET6) as probe:
        try:
            probe.bind(("::1", 0))
        except OSError:
            return False
    return True


@pytest.mark.skipif(not has_ipv6(), reason="no loopback of IP version 6 here")
def test_the_loopback_may_be_that_of_ip_version_6(
    start_server: Starter, scenario: Scenario
) -> None:
    running = start_server(scenario, "tcp://[::1]:*")
    with Client(running.address, timeout_s=limit(10.0)) as client:
        assert client.render(scenario.epoch_tai_ns, "side").dn.shape == (40, 48)


@pytest.mark.parametrize(
    ("address", "reason"),
    [
        ("udp://127.0.0.1:5563", "it has not this form"),
        ("127.0.0.1:5563", "it has not this form"),
        ("", "it has not this form"),
        ("tcp://127.0.0.1:70000", "a port is at most 65535"),
        ("ipc://@simgl", "an abstract name has no file permissions"),
        ("ipc:///no/such/folder/simgl", "its folder does not exist"),
        ("ipc://", "something other than a socket is there"),
        ("ipc://*", "a socket needs a name of its own"),
        ("ipc:///tmp/" + "x" * 110, "longer than 107 bytes"),
    ],
)
def test_an_address_that_cannot_be_is_refused(address: str, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        check_bindable(address)


def test_a_file_is_not_replaced_by_a_socket(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("keep me")
    with pytest.raises(ConfigError, match="something other than a socket is there"):
        check_bindable(f"ipc://{tmp_path / 'notes.txt'}")
    assert (tmp_path / "notes.txt").read_text() == "keep me"


def test_an_ipc_server_is_for_its_user_alone(
    start_server: Starter, scenario: Scenario, tmp_path: Path
) -> None:
    path = tmp_path / "s"
    running = start_server(scenario, f"ipc://{path}")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    with Client(running.address, timeout_s=limit(5.0)) as client:
        assert client.render(scenario.epoch_tai_ns, "side").dn.shape == (40, 48)


def test_an_address_in_use_is_an_error(start_server: Starter, scenario: Scenario) -> None:
    with zmq.Context() as context, context.socket(zmq.ROUTER) as other:
        other.bind("tcp://127.0.0.1:*")
        address = other.get_string(zmq.LAST_ENDPOINT)
        with pytest.raises(BridgeError) as caught:
            start_server(scenario, address)
        assert str(caught.value) == f"{address}: cannot be bound (Address already in use)"


def test_a_socket_file_in_use_is_an_error_and_its_server_goes_on(
    start_server: Starter, scenario: Scenario, tmp_path: Path
) -> None:
    first = start_server(scenario, f"ipc://{tmp_path / 's'}")
    with Client(first.address, timeout_s=limit(5.0)) as client:
        with pytest.raises(BridgeError) as caught:
            start_server(scenario, first.address)
        assert str(caught.value) == f"{first.address}: cannot be bound (Address already in use)"
        assert client.render(scenario.epoch_tai_ns, "side").sequence == 1
    with Client(first.address, timeout_s=limit(5.0)) as later:
        assert later.welcome.boot == client.welcome.boot


def test_a_socket_file_whose_server_has_died_is_used_again(
    start_server: Starter, scenario: Scenario, tmp_path: Path
) -> None:
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    running = start_server(scenario, f"ipc://{path}")
    with Client(running.address, timeout_s=limit(5.0)) as client:
        assert client.ping() < limit(5.0)


def test_a_launched_server_answers_and_ends_with_code_0(
    scenario_path: Path, scenario: Scenario
) -> None:
    with launched_server(scenario_path) as (process, address):
        with Client(address, timeout_s=limit(20.0)) as client:
            assert client.render(scenario.epoch_tai_ns, "nav").sequence == 1
        assert process.poll() is None
    assert process.returncode == 0


def test_a_killed_server_is_an_error_within_the_deadline(scenario_path: Path) -> None:
    with launched_server(scenario_path) as (process, address):
        with Client(address, timeout_s=limit(20.0)) as client:
            client.timeout_s = 0.5
            process.kill()
            process.wait(limit(10.0))
            start = time.monotonic()
            # As the broken connection is noticed before or after the request is sent.
            error = f"^{address}: (the connection broke|no connection within 0.5 s)"
            with pytest.raises(BridgeError, match=error):
                client.render(client.welcome.epoch_tai_ns, "nav")
            assert time.monotonic() - start < limit(2.0)
        assert time.monotonic() - start < limit(3.0)
    assert process.returncode == -signal.SIGKILL


def test_a_launch_that_fails_brings_the_reason(tmp_path: Path) -> None:
    with (
        pytest.raises(
            BridgeError, match=r"ended with code 2: simgl: .*absent\.toml: cannot be read"
        ),
        launched_server(tmp_path / "absent.toml"),
    ):
        pass


def test_the_command_says_when_it_is_ready_and_sigint_ends_it_with_code_0(
    scenario_path: Path,
) -> None:
    command = [sys.executable, "-m", "simgl_bridge.commands", str(scenario_path)]
    command += ["--address", "tcp://127.0.0.1:*"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest = process.stdout.read()
        assert process.wait(limit(20.0)) == 0
    assert line.startswith('simgl serves "small" at tcp://127.0.0.1:')
    assert line.endswith("cameras: nav 64x48, side 48x40; bodies: target, chaser\n")
    assert rest == ""
