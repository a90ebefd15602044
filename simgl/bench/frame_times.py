"""Loops that time frames, and the statistics of what they find."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from simgl.bench.results import FrameTimes
from simgl.bench.scenes import CaptureCameras
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator

WARM_UP = 5
# Consecutive parts of a run; the spread of their medians is the noise of the machine.
ROUNDS = 3
# Of a loop that its time limit ends: a median of each round.
MIN_FRAMES = 5


def epochs_of(scenario: Scenario, frames: int, step_s: float) -> list[int]:
    """Epochs [TAI ns] of the frames to warm up and of those to time."""
    return [scenario.epoch_tai_ns + round(i * step_s * 1e9) for i in range(WARM_UP + frames)]


def frame_statistics(seconds: Sequence[float]) -> FrameTimes:
    """Of frame times [s], in ms."""
    ms = np.array(seconds) * 1e3
    p50, p95, p99, worst = np.percentile(ms, [50, 95, 99, 100]).round(3).tolist()
    return FrameTimes(p50=p50, p95=p95, p99=p99, mean=round(float(ms.mean()), 3), worst=worst)


def round_medians_ms(seconds: Sequence[float]) -> list[float]:
    """Medians of consecutive rounds of frames, or of fewer where there are too few frames [ms]."""
    rounds = np.array_split(np.array(seconds) * 1e3, min(ROUNDS, len(seconds)))
    return [round(float(np.median(part)), 3) for part in rounds]


class FrameLoop:
    """Captures the frames of a scene one after another; each of its epochs once.

    A frame that was captured before would find much of its work done, which is no measure of a
    scene that moves on.
    """

    def __init__(
        self, simulator: Simulator, cameras: CaptureCameras, epochs: Sequence[int], limit_s: float
    ) -> None:
        """limit_s : after which each loop ends, with at least MIN_FRAMES timed frames [s]"""
        self._simulator = simulator
        self._cameras = cameras
        self._epochs = iter(epochs)
        self._captured = 0
        self._limit_s = limit_s

    def capture_next(self) -> int:
        """Capture the next frame; the number of its captures."""
        scenario = self._simulator.scenario
        state = scenario.at(next(self._epochs))
        names = self._cameras(list(scenario.cameras), self._captured)
        self._simulator.captures(state, dict.fromkeys(names, (Product.DN,)))
        self._captured += 1
        return len(names)

    def warm_up(self) -> None:
        """Programs, caches and clocks of the processor; one frame of a slow scene is enough."""
        begin = time.perf_counter()
        while self._captured < WARM_UP:
            self.capture_next()
            if time.perf_counter() - begin > 0.25 * self._limit_s:
                break

    def frame_seconds(self, frames: int) -> list[float]:
        """Times of so many frames [s]."""
        seconds: list[float] = []
        begin = time.perf_counter()
        for _ in range(frames):
            start = time.perf_counter()
            if len(seconds) >= MIN_FRAMES and start - begin > self._limit_s:
                break
            self.capture_next()
            seconds.append(time.perf_counter() - start)
        return seconds

    def pass_seconds(self, frames: int) -> dict[str, list[float]]:
        """Times of each pass in so many frames [s], by its name.

        Only of frames that have the pass: tables of the air are made in one of many.
        """
        timer = self._simulator.timer
        seconds: dict[str, list[float]] = {}
        timer.enabled = True
        begin = time.perf_counter()
        for frame in range(frames):
            if frame >= MIN_FRAMES and time.perf_counter() - begin > self._limit_s:
                break
            timer.seconds.clear()
            self.capture_next()
            for name, elapsed in timer.seconds.items():
                seconds.setdefault(name, []).append(elapsed)
        timer.enabled = False
        return seconds
