"""A run of Basilisk and its image source end together, with one line that says why."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
import zmq

from tests.bridge import basilisk_wire as wire
from tests.bridge.harness import free_address
from tests.patience import limit, run_to_end

# A program that asks for a picture as Basilisk does, without a deadline, and does something to the
# server first: ``os.kill(server, ...)``.
PROGRAM = """
import os, signal, sys, zmq
from pathlib import Path
parent = os.getppid()
children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
(server,) = {int(c) for c in children} - {os.getpid()}
socket = zmq.Context().socket(zmq.REQ)
socket.connect(sys.argv[1])
def ask(*frames):
    socket.send_multipart(frames)
    return socket.recv_multipart()
assert ask(b"PING") == [b"PONG"]
print(os.getpid(), server, flush=True)
"""
# What ``simgl run`` does.
COMMAND = """
import sys, typer
from simgl.errors import SimglError
from simgl_bridge.commands import run
try:
    typer.run(run)
except SimglError as error:
    print(f"simgl: {error}", file=sys.stderr)
    sys.exit(2)
"""
IMAGE = """
assert ask(b"SIM_UPDATE", b"", b"", Path(sys.argv[2]).read_bytes()) == [b"OK"]
size, png = ask(b"REQUEST_IMAGE_1")
assert png[1:4] == b"PNG", png[:10]
"""


def run(
    tmp_path: Path, address: str, program: str, *options: str
) -> subprocess.CompletedProcess[str]:
    """``simgl run`` of a program."""
    (tmp_path / "state.bin").write_bytes(wire.scene())
    command = [sys.executable, "-c", COMMAND]
    command += ["--basilisk", address, *options]
    command += ["--", sys.executable, "-c", program, address, str(tmp_path / "state.bin")]
    return run_to_end(command, check=False)


def is_gone(pid: int) -> bool:
    """Whether a process has ended and been waited for."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def test_a_run_has_its_pictures_and_its_own_exit_code(tmp_path: Path) -> None:
    (tmp_path / "nav.toml").write_text(wire.SHEET)
    (tmp_path / "leo.toml").write_text(wire.SCENARIO)
    options = ["--scenario", str(tmp_path / "leo.toml")]
    options += ["--camera", f"1={tmp_path / 'nav.toml'}"]
    program = PROGRAM + IMAGE + "sys.exit(3)"
    done = run(tmp_path, free_address(), program, *options)
    assert done.returncode == 3, done.stderr
    ready, pids = done.stdout.splitlines()
    assert ready.startswith("simgl is the image source of Basilisk at ")
    assert ready.endswith("nav.toml")
    assert all(is_gone(int(pid)) for pid in pids.split())


@pytest.mark.parametrize(
    ("blow", "reason"),
    [
        ("SIGKILL", "the image source died of SIGKILL"),
        ("SIGSTOP", "the image source at {address} gave no sign of life for 3 s"),
    ],
)
def test_a_run_whose_image_source_is_gone_is_ended_with_a_line_that_says_so(
    tmp_path: Path, blow: str, reason: str
) -> None:
    address = free_address()
    program = PROGRAM + f"os.kill(server, signal.{blow})\n" + "ask(b'PING'); ask(b'PING')"
    start = time.monotonic()
    done = run(tmp_path, address, program, "--patience-s", "3")
    assert time.monotonic() - start < limit(60.0)
    assert done.returncode == 2
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"simgl: {reason.format(address=address)}; ")
    assert last.endswith(" is ended with it")
    assert all(is_gone(int(pid)) for pid in done.stdout.splitlines()[-1].split())


def test_a_run_is_not_begun_where_the_port_is_taken(tmp_path: Path) -> None:
    with zmq.Context() as context, context.socket(zmq.ROUTER) as other:
        other.bind("tcp://127.0.0.1:*")
        address = other.get_string(zmq.LAST_ENDPOINT)
        done = run(tmp_path, address, "print('begun')")
    assert done.returncode == 2
    assert f"simgl: {address}: cannot be bound (Address already in use)" in done.stderr
    assert "the image source ended with code 2; " in done.stderr
    assert done.stderr.rstrip().endswith("was not begun")
    assert "begun" not in done.stdout
