"""Processes of a server: started as children that end with their parent, restarted, and ended."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from simgl.blas_threads import ONE_THREAD
from simgl.errors import BridgeError
from simgl.interruption import block_interrupts
from simgl_bridge.server import Stop, print_line

# Names the process whose end stops a server.
PARENT_VARIABLE = "SIMGL_SERVER_PARENT"
# A server that dies this soon after its start [s], this many times in a row, is given up.
EARLY_DEATH = 20.0
MAX_EARLY_DEATHS = 5
# Interval at which an end, or the wish to stop, is noticed [s].
POLL_INTERVAL = 0.1


class StopWithParent:
    """A stop that is also set once a parent process is gone, however it ended."""

    def __init__(self, stop: Stop, parent: int) -> None:
        self._stop = stop
        self._parent = parent

    def is_set(self) -> bool:
        """Whether to stop now."""
        return self._stop.is_set() or os.getppid() != self._parent


# Linux: the signal that a process gets when the one that started it ends.
_PR_SET_PDEATHSIG = 1
# What starts a renderer, before its arguments.
RENDERER_COMMAND: Sequence[str] = (sys.executable, "-m", "simgl_bridge.render_process")


class RendererOptions(msgspec.Struct, frozen=True, kw_only=True):
    """What a renderer opens.

    scenario : file; None for Basilisk's bare scene
    chosen : name of a scenario in ``root``, in place of ``scenario``
    root : folder that all files must lie in; None allows any
    camera_files : ID=FILE of Basilisk's cameras
    record : folder for a record of the session; None records nothing
    """

    scenario: str | None = None
    chosen: str | None = None
    seed: int | None = None
    root: str | None = None
    basilisk: bool = False
    camera_files: tuple[str, ...] = ()
    record: str | None = None
    record_images: bool = False


def start_renderer(
    options: RendererOptions, connection: socket.socket, chosen: str | None, seed: int | None
) -> subprocess.Popen[bytes]:
    """Start a renderer; it ends when this process does.

    connection : the renderer's end, which it inherits
    chosen, seed : what a client chose meanwhile; None leaves the options' own
    """
    if seed is not None:
        options = msgspec.structs.replace(options, chosen=chosen, seed=seed)
    text = msgspec.json.encode(options).decode()
    # Ctrl-C is for the server, which ends its renderer when the image in hand is sent.
    end = connection.fileno()
    return subprocess.Popen(
        [*RENDERER_COMMAND, str(end), str(os.getpid()), text],
        pass_fds=(end,),
        start_new_session=True,
        env={**ONE_THREAD, **os.environ},
    )


def end_with_parent(parent: int) -> None:
    """Let the system kill this process once its parent is gone, even while it computes.

    Systems other than Linux cannot; there a renderer notices it between two tasks.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        sys.exit(1)


def start_server(arguments: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
    """Start ``simgl serve`` as a child process; it ends when this process does.

    options : of ``subprocess.Popen``
    """
    command = [sys.executable, "-m", "simgl", "serve", *arguments]
    environment = {**os.environ, PARENT_VARIABLE: str(os.getpid())}
    return subprocess.Popen(command, env=environment, **options)


def end(process: subprocess.Popen[bytes], patience: float) -> None:
    """Ask a process to end, and kill it where it has not after a time [s]."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
    process.wait()


def run_restarting(target: Callable[..., None], arguments: Sequence[Any], stop: Stop) -> int:
    """Run a function in a process of its own, again whenever a signal kills it.

    target, arguments : picklable; the process gets SIGTERM once ``stop`` is set
    returns : exit code of the process

    Raises BridgeError where the process keeps dying.
    """
    deaths = 0
    while True:
        start = time.monotonic()
        process = multiprocessing.get_context("spawn").Process(target=target, args=arguments)
        # Ctrl-C is for this process, which then ends the other one.
        block_interrupts()
        process.start()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        while process.is_alive() and not stop.is_set():
            process.join(POLL_INTERVAL)
        if process.is_alive():
            process.terminate()
        process.join()
        code = process.exitcode or 0
        if code >= 0 or stop.is_set():
            return max(code, 0)
        deaths = deaths + 1 if time.monotonic() - start < EARLY_DEATH else 1
        name = signal.Signals(-code).name
        if deaths == MAX_EARLY_DEATHS:
            raise BridgeError(f"the server died {deaths} times in a row, the last time of {name}")
        print_line(f"simgl: the server died of {name} and is started again")
