"""A browser view follows a served loop, and neither slows nor ends it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from simgl_bridge import Client
from simgl_bridge.processes import end, start_server

from tests.patience import limit, wait_until


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port: int = probe.getsockname()[1]
    return port


@dataclass
class Served:
    process: subprocess.Popen[bytes]
    address: str
    page: str

    @property
    def view(self) -> int:
        """Process of the view."""
        pid = self.process.pid
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        commands = {int(p): Path(f"/proc/{p}/cmdline").read_text() for p in children}
        return next(p for p, command in commands.items() if "web_process" in command)


@pytest.fixture(scope="module")
def served(scenario_path: Path) -> Iterator[Served]:
    port, page = free_port(), free_port()
    address = f"tcp://127.0.0.1:{port}"
    arguments = [str(scenario_path), "--address", address, "--web"]
    arguments += ["--web-address", f"127.0.0.1:{page}"]
    process = start_server(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    yield Served(process, address, f"http://127.0.0.1:{page}")
    end(process, limit(10.0))
    assert process.stderr is not None
    process.stderr.close()


def test_the_view_shows_what_the_client_was_sent_and_the_loop_outlives_it(served: Served) -> None:
    with Client(served.address, timeout_s=limit(60.0)) as client:
        now, camera = client.welcome.epoch_tai_ns, client.welcome.cameras[0].name
        client.render(now, camera)
        url = f"{served.page}/stream/{camera}.mjpg"
        with urllib.request.urlopen(url, timeout=limit(30.0)) as stream:
            head = b""
            # What was drawn before anybody looked on is shown, and later what is new.
            while b"image/jpeg" not in head:
                head += stream.read(64)
            image = client.render(now + 10**9, camera)
            pixel = f"{served.page}/pixel.json?camera={camera}&x=3&y=2"

            def shown() -> bool:
                with urllib.request.urlopen(pixel, timeout=limit(10.0)) as reply:
                    return f'"dn": {image.dn[2, 3]}' in reply.read().decode()

            wait_until(shown, "the pixel is that of the newest image")
            # A view that stands still is no reason for the loop to wait.
            os.kill(served.view, signal.SIGSTOP)
            for second in range(2, 12):
                client.render(now + second * 10**9, camera)
            os.kill(served.view, signal.SIGKILL)
            for second in range(12, 15):
                client.render(now + second * 10**9, camera)


def test_a_page_that_cannot_be_bound_ends_the_server_with_a_line(scenario_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        page = f"127.0.0.1:{taken.getsockname()[1]}"
        arguments = [str(scenario_path), "--address", "tcp://127.0.0.1:*", "--web"]
        process = start_server(
            [*arguments, "--web-address", page], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        _, said = process.communicate(timeout=limit(60.0))
    assert process.returncode == 2
    assert f"--web-address {page} cannot be bound" in said.decode()


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--web-token", "t"], "--web-token requires --web"),
        (["--web", "--root", "."], "--web is not allowed with --root"),
        (["--web", "--web-address", "0.0.0.0:80"], "needs --web-token FILE"),
        (["--web", "--restart", "--web-address", "127.0.0.1:*"], "--restart needs a --web-address"),
    ],
)
def test_options_that_do_not_go_together_are_named(
    scenario_path: Path, options: list[str], reason: str
) -> None:
    process = start_server(
        [str(scenario_path), *options], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    _, said = process.communicate(timeout=limit(60.0))
    assert process.returncode == 2
    assert reason in said.decode()
