"""What a flight says while it flies: events in a line each, and a bar in a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from examples.closed_loop.guidance import Phase
from examples.closed_loop.loop import Frame

# Simulated time between lines where there is no terminal [s].
_BETWEEN_LINES = 60.0


class Narrator:
    """Tells of a flight from its frames.

    start, end : distances of the camera from the board at which the bar is empty and full [m]
    """

    def __init__(self, console: Console, start: float, end: float) -> None:
        self._console, self._start, self._end = console, start, end
        self._progress: Progress | None = None
        self._task = TaskID(0)
        self._said: set[str] = set()
        self._next_line = _BETWEEN_LINES

    @contextmanager
    def telling(self) -> Iterator[None]:
        """While it is open, a terminal shows a bar below the events."""
        self._console.print(
            f"Looking for Space Rider's wing tips in the camera's images, from {self._start:.0f} m "
            "behind. Each image: request, render, detect, filter, thrust."
        )
        if not self._console.is_terminal:
            yield
            return
        columns = (BarColumn(bar_width=20), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(*columns, console=self._console, transient=True) as progress:
            self._progress = progress
            self._task = progress.add_task("waiting for the first image", total=1.0)
            yield

    def frame(self, frame: Frame) -> None:
        """Tell of a frame what is new, and where the chaser is."""
        for key, text in self._events(frame):
            if key not in self._said:
                self._said.add(key)
                self._console.print(f"t = {frame.time:4.0f} s  {frame.distance:6.2f} m  {text}")
        if self._progress is not None:
            done = 1.0 - (frame.distance - self._end) / (self._start - self._end)
            self._progress.update(
                self._task, completed=min(max(done, 0.0), 1.0), description=_place(frame)
            )
        elif frame.time >= self._next_line:
            self._next_line += _BETWEEN_LINES
            self._console.print(_place(frame))

    def _events(self, frame: Frame) -> Iterator[tuple[str, str]]:
        look = frame.look
        if look.pose is not None:
            yield "markers", f"{look.pose.markers} markers of the board located: full pose from now"
        elif look.fix is not None:
            yield "wings", "wing tips located: position from two lines of sight"
        if frame.sunlit < 0.99:
            yield "penumbra", "the Sun begins to set behind the Earth"
        if frame.sunlit < 0.01:
            yield "umbra", "in the Earth's shadow"
        if look.light.lamp:
            yield "lamp", "the lamp is on: the images have become too dark"
        if frame.phase is Phase.FINAL:
            yield "final", "markers held: final approach along the board's axis"
        if frame.phase is Phase.HOLD:
            yield "hold", "docking range reached: holding"


def _place(frame: Frame) -> str:
    """Where the chaser is, and how well it knows that."""
    look = frame.look
    if look.pose is not None:
        kind = f"fix from {look.pose.markers} markers"
    else:
        kind = "fix from wing tips" if look.fix is not None else "no fix"
    light = "lamplight" if look.light.lamp else "sunlight"
    return (
        f"t = {frame.time:4.0f} s, {frame.distance:6.2f} m from the board, {kind}, "
        f"along-track error {frame.error[0]:+.3f} m (3 sigma {3.0 * float(frame.sigma[0]):.3f} m), "
        f"{light}"
    )
