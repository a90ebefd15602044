"""``simgl serve``: a scenario's cameras at a ZeroMQ address, until SIGINT or SIGTERM."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from types import FrameType
from typing import Annotated

import typer

from simgl.errors import SimglError
from simgl.progress import bake_bar
from simgl.scenario.loader import load_scenario
from simgl.simulator import Simulator
from simgl_bridge.address import DEFAULT_ADDRESS, check_bindable
from simgl_bridge.server import Server


@contextmanager
def _stop_on_signals() -> Iterator[Event]:
    """An event that SIGINT and SIGTERM set; a second signal has its usual effect."""
    stop = Event()
    numbers = (signal.SIGINT, signal.SIGTERM)

    def on_signal(number: int, frame: FrameType | None) -> None:
        del frame
        stop.set()
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.signal(number, on_signal) for number in numbers}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def serve(
    scenario: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    address: Annotated[
        str, typer.Option(help="tcp://127.0.0.1:PORT (* finds a free one) or ipc://PATH.")
    ] = DEFAULT_ADDRESS,
) -> None:
    """Serve a scenario's cameras to a closed-loop simulation over ZeroMQ.

    A client sends time, poses and exposure, and gets back the image of exactly that state.
    Ctrl-C or SIGTERM finishes the frame in hand and ends with exit code 0.

    Example: simgl serve approach.toml --address tcp://127.0.0.1:5563
    """
    check_bindable(address)
    with _stop_on_signals() as stop:
        loaded = load_scenario(scenario)
        with bake_bar() as progress:
            ready = Simulator(loaded, progress=progress)
        with ready as simulator, Server(simulator, address) as server:
            print(server.summary, flush=True)
            server.serve(stop)


def main() -> None:
    """The command alone, as ``python -m simgl_bridge.command SCENARIO``."""
    try:
        typer.run(serve)
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
