"""A server as a child process, for examples, tests and notebooks."""

from __future__ import annotations

import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from simgl.errors import BridgeError
from simgl_bridge.client import Client
from simgl_bridge.processes import end, start_server

# A server that listens answers well within this, whatever it does [s].
_ATTEMPT = 2.0
# A server that was asked to end finishes its image; after this it is killed [s].
_PATIENCE = 30.0


@contextmanager
def launched_server(
    scenario_path: str | Path, *, timeout_s: float = 600.0
) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """Run a server of a scenario, as (process, address), until the end of the block.

    It also ends when this process is killed.

    scenario_path : scenario file (TOML)
    timeout_s : limit for the start, which takes minutes for a large model that is not cached; the
        end of the server is detected at once

    Raises BridgeError with the last line of the server's output if it ends or does not answer.

    >>> with launched_server("approach.toml") as (_, address), Client(address) as client:
    ...     image = client.render(client.welcome.epoch_tai_ns, "navcam")
    """
    address = f"tcp://127.0.0.1:{_free_port()}"
    arguments = [str(scenario_path), "--address", address]
    # Not a pipe, which blocks the writer when nobody reads it.
    with tempfile.TemporaryFile() as log:
        process = start_server(
            arguments, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log
        )
        try:
            _wait_until_ready(process, address, log, timeout_s)
            yield process, address
        finally:
            end(process, _PATIENCE)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def _wait_until_ready(
    process: subprocess.Popen[bytes], address: str, log: IO[bytes], timeout_s: float
) -> None:
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        if process.poll() is not None:
            raise BridgeError(
                f"{address}: the server ended with code {process.returncode}: {_last_line(log)}"
            )
        left = max(deadline - time.monotonic(), _ATTEMPT)
        try:
            Client(address, timeout_s=_ATTEMPT, ready_timeout_s=left, name="launcher").close()
        except BridgeError:
            continue
        return
    raise BridgeError(
        f"{address}: the server did not answer within {timeout_s:g} s: {_last_line(log)}"
    )


def _last_line(log: IO[bytes]) -> str:
    log.seek(0)
    lines = log.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else "it wrote nothing"
