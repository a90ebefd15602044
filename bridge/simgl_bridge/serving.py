"""The process of a server: its endpoints from start to stop."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Event
from types import FrameType

from simgl.errors import SimglError
from simgl.interruption import report_faults
from simgl_bridge.access import Access
from simgl_bridge.basilisk.endpoint import BasiliskEndpoint
from simgl_bridge.processes import RendererOptions, StopWithParent, start_renderer
from simgl_bridge.render_queue import RenderQueue
from simgl_bridge.renderer_link import RendererLink
from simgl_bridge.server import Stop, serve
from simgl_bridge.simgl1_endpoint import Simgl1Endpoint
from simgl_bridge.web_feed import WebFeed, WebOptions


@dataclass(frozen=True, kw_only=True)
class ServiceOptions:
    """What ``simgl serve`` was asked for.

    renderer : what the renderer opens
    address : of simgl/1; None for none
    basilisk : address of Basilisk's endpoint; None for none
    monitor, rate_hz, root, access : of the endpoint of simgl/1, see ``Simgl1Endpoint``
    web : the browser view; None for none
    """

    renderer: RendererOptions
    address: str | None
    basilisk: str | None
    monitor: str | None
    rate_hz: float | None
    root: Path | None
    access: Access
    web: WebOptions | None


def serve_until_stopped(options: ServiceOptions, stop: Stop) -> None:
    """Open the endpoints and serve until ``stop`` is set."""
    endpoints: list[Simgl1Endpoint | BasiliskEndpoint] = []
    with ExitStack() as stack:
        start = partial(start_renderer, options.renderer)
        queue = RenderQueue(stack.enter_context(closing(RendererLink(start))))
        web = None if options.web is None else stack.enter_context(closing(WebFeed(options.web)))
        if options.address is not None:
            simgl1 = Simgl1Endpoint(
                queue,
                options.address,
                root=options.root,
                access=options.access,
                monitor=options.monitor,
                rate_hz=options.rate_hz,
                web=web,
            )
            endpoints.append(stack.enter_context(simgl1))
        if options.basilisk is not None:
            endpoints.append(stack.enter_context(BasiliskEndpoint(queue, options.basilisk)))

        def print_summaries() -> None:
            for endpoint in endpoints:
                _print_summary(endpoint.summary)

        serve(endpoints, queue, stop, on_ready=print_summaries)


def serve_restarted(options: ServiceOptions, parent: int) -> None:
    """Serve in a process that another one restarts, and that ends with it."""
    report_faults()
    with stop_on_signals() as stop, one_line_errors():
        serve_until_stopped(options, StopWithParent(stop, parent))


def _print_summary(line: str) -> None:
    """Print a line; the server runs on where the disk behind stdout is full."""
    try:
        print(line, flush=True)
    except OSError:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115 - for the rest of the process


@contextmanager
def stop_on_signals() -> Iterator[Event]:
    """An event that SIGINT and SIGTERM set; a second signal has its usual effect."""
    stop = Event()
    numbers = (signal.SIGINT, signal.SIGTERM)

    def on_signal(number: int, frame: FrameType | None) -> None:
        del frame
        stop.set()
        signal.signal(number, previous[signal.Signals(number)])

    previous = {number: signal.signal(number, on_signal) for number in numbers}
    try:
        yield stop
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def one_line_errors() -> Iterator[None]:
    """Print bad input as one line and exit with code 2."""
    try:
        yield
    except SimglError as error:
        print(f"simgl: {error}", file=sys.stderr)
        sys.exit(2)
