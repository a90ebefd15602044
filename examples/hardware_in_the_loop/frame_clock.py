"""When each frame is due by the wall clock, and which ones came late or not at all."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class FrameClock:
    """Frames at a fixed rate: frame k is due k periods after the start, whatever came before.

    rate_hz : of the frames
    tolerance_s : a frame shown later than this is late; about a refresh of the screen
    now : the clock [s]
    idle : waits for a time [s], or less
    lateness_s : of the frames that were shown, by number
    missed : frames whose time was over before they could be asked for
    """

    rate_hz: float
    tolerance_s: float = 0.017
    now: Callable[[], float] = time.perf_counter
    idle: Callable[[float], object] = time.sleep
    lateness_s: dict[int, float] = field(default_factory=dict)
    missed: list[int] = field(default_factory=list)

    def start(self) -> None:
        """Frame 0 is due one period from now."""
        self._first = self.now() + 1.0 / self.rate_hz

    def due(self, frame: int) -> float:
        """When a frame is to be shown."""
        return self._first + frame / self.rate_hz

    def wait(self, frame: int) -> None:
        """Until a frame is due; at once where that is over."""
        while (left := self.due(frame) - self.now()) > 0.0:
            self.idle(left)

    def shown(self, frame: int) -> None:
        """Note how late a frame is that is on the screen now."""
        self.lateness_s[frame] = max(self.now() - self.due(frame), 0.0)

    def following(self, frame: int, frames: int) -> int:
        """The first of ``frames`` frames after one that is not yet due; those before are missed."""
        following = frame + 1
        while following < frames and self.due(following) <= self.now():
            self.missed.append(following)
            following += 1
        return following

    @property
    def late(self) -> list[int]:
        """Frames that were shown too late."""
        return [f for f, seconds in self.lateness_s.items() if seconds > self.tolerance_s]

    def report(self) -> str:
        """One line."""
        worst = max(self.lateness_s.values(), default=0.0)
        return (
            f"{len(self.lateness_s)} frames shown at {self.rate_hz:g} Hz, {len(self.late)} late "
            f"(by {1e3 * worst:.1f} ms at most), {len(self.missed)} missed"
        )
