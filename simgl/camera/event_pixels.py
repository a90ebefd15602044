"""An event camera's pixels: from photo-current to events with time stamps.

A pixel compares the logarithm of its photo-current with the value that it memorised at its last
event. Where the difference, its contrast, reaches a threshold, it sends an event and memorises
anew, after Lichtsteiner, Posch and Delbruck, "A 128 x 128 120 dB 15 us latency asynchronous
temporal contrast vision sensor" (2008).

    photo-current -> logarithm -> contrast with memory -> crossing of a threshold -> event
    e-/s             linear in    + leak of the memory    or event of noise         t, x, y, p
                     time
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Image16, IndexArray, Mask
from simgl.camera.camera import Camera
from simgl.camera.noise_streams import (
    PIXELS,
    Stream,
    epoch_words,
    frame_key,
    list_words,
    normal,
    pattern_key,
    philox,
    uniform_01,
)


@dataclass(frozen=True, eq=False)
class Events:
    """Events of one camera, in the order of their times.

    tai_ns : (n,) time stamps [TAI ns]
    x, y : (n,) uint16 column and row of the pixel, from the top left
    on : (n,) whether it became brighter
    """

    tai_ns: IndexArray
    x: Image16
    y: Image16
    on: Mask

    def __len__(self) -> int:
        return len(self.tai_ns)

    def balance(self, height: int, width: int) -> IndexArray:
        """(height, width) number of ON events less that of OFF events, pixel by pixel."""
        pixel = self.y.astype(np.int64) * width + self.x
        weights = np.where(self.on, 1.0, -1.0)
        total = np.bincount(pixel, weights=weights, minlength=height * width)
        return np.rint(total).astype(np.int64).reshape(height, width)


def joined(parts: list[Events]) -> Events:
    """The events of successive times as one."""
    none = Events(
        np.zeros(0, np.int64), np.zeros(0, np.uint16), np.zeros(0, np.uint16), np.zeros(0, np.bool_)
    )
    every = [none, *parts]
    return Events(
        tai_ns=np.concatenate([e.tai_ns for e in every]),
        x=np.concatenate([e.x for e in every]),
        y=np.concatenate([e.y for e in every]),
        on=np.concatenate([e.on for e in every]),
    )


class EventPixels:
    """The pixels of an event camera, with what they have memorised.

    camera : with an ``event_sensor`` and a dark current
    rate : (height, width) photo-current of the first instant, without dark current [e- s-1]
    tai_ns : that instant [TAI ns]; with seed and camera name it determines the noise
    """

    def __init__(self, camera: Camera, rate: Array, tai_ns: int, seed: int) -> None:
        sensor, detector = camera.event_sensor, camera.detector
        if sensor is None or not detector.dark_current > 0.0:
            raise ValueError("the camera needs an event sensor and a dark current")
        self._sensor = sensor
        self._dark = detector.dark_current
        self._width = detector.width
        self._noise_key = frame_key(seed, camera.name, Stream.EVENTS)
        self._epoch = epoch_words(tai_ns)
        self._tai_ns = tai_ns
        self._level = self._logarithm(rate)
        count = self._level.size
        self._on, self._off = (
            threshold * np.exp(sensor.threshold_spread * _fixed_normal(detector.serial, s, count))
            for threshold, s in (
                (sensor.threshold_on, Stream.THRESHOLD_ON),
                (sensor.threshold_off, Stream.THRESHOLD_OFF),
            )
        )
        self._contrast = np.zeros(count)
        if sensor.leak_rate > 0.0:
            # Where a leaking pixel that has stood still for long may be in its cycle.
            words = list_words(-(-count // PIXELS), frame_key(seed, camera.name, Stream.LEAK))
            self._contrast = self._on * uniform_01(words).ravel()[:count]
        # Time for which each pixel is still held after its last event [s].
        self._held = np.zeros(count)
        self._drawn = np.zeros(count, dtype=np.uint32)
        self._until_noise = np.full(count, np.inf)
        if sensor.shot_noise_rate > 0.0:
            self._draw_noise(np.arange(count))

    def advance(self, rate: Array, tai_ns: int) -> Events:
        """The events after the instant before, up to the next one.

        rate : (height, width) photo-current, without dark current [e- s-1]
        tai_ns : its instant [TAI ns]

        Raises ValueError where that is not later.
        """
        if tai_ns <= self._tai_ns:
            raise ValueError(f"an instant must be later than {self._tai_ns}, got {tai_ns}")
        sensor, duration = self._sensor, (tai_ns - self._tai_ns) * 1e-9
        level = self._logarithm(rate)
        slope = (level - self._level) / duration + sensor.leak_rate * sensor.threshold_on
        # The variance of a photo-current's logarithm is as the inverse of the photo-current.
        current = np.exp(0.5 * (level + self._level))
        noise_rate = sensor.shot_noise_rate * self._dark / current
        now = np.minimum(self._held, duration)
        self._held -= now
        pixels = np.flatnonzero(now < duration)
        fired: list[tuple[Array, IndexArray, Mask]] = []
        while pixels.size:
            rises = slope[pixels] > 0.0
            threshold = np.where(rises, self._on[pixels], -self._off[pixels])
            change = threshold - self._contrast[pixels]
            with np.errstate(divide="ignore"):
                to_crossing = np.where(slope[pixels] != 0.0, change / slope[pixels], np.inf)
                to_noise = self._until_noise[pixels] / noise_rate[pixels]
            crosses = to_crossing <= to_noise
            wait = np.maximum(np.where(crosses, to_crossing, to_noise), 0.0)
            left = duration - now[pixels]
            fires = wait <= left
            passed = np.where(fires, wait, left)
            self._contrast[pixels] += slope[pixels] * passed
            self._until_noise[pixels] -= noise_rate[pixels] * passed
            now[pixels] += passed
            crosses, rises, pixels = crosses[fires], rises[fires], pixels[fires]
            rises[~crosses] = self._draw_noise(pixels[~crosses])
            fired.append((now[pixels], pixels, rises))
            # The memory follows the light until the pixel is released.
            self._contrast[pixels] = 0.0
            now[pixels] += sensor.refractory_time
            self._held[pixels] = np.maximum(now[pixels] - duration, 0.0)
            pixels = pixels[now[pixels] < duration]
        start, self._level, self._tai_ns = self._tai_ns, level, tai_ns
        return self._in_order(start, fired)

    def _logarithm(self, rate: Array) -> Array:
        return np.log(np.asarray(rate, dtype=np.float64).ravel() + self._dark)

    def _draw_noise(self, pixels: IndexArray) -> Mask:
        """Draw when these pixels have their next event of noise, and of which sign the present one
        is: true for ON."""
        counter = np.zeros((len(pixels), 4), dtype=np.uint32)
        counter[:, 0] = pixels
        counter[:, 1] = self._drawn[pixels]
        counter[:, 2:] = self._epoch
        words = philox(counter, self._noise_key)
        self._drawn[pixels] += 1
        # Of a Poisson process of rate 1; independent of the instants that are drawn.
        self._until_noise[pixels] = -np.log(uniform_01(words[:, 0]))
        return words[:, 1] < 2**31

    def _in_order(self, start: int, fired: list[tuple[Array, IndexArray, Mask]]) -> Events:
        if not fired:
            return joined([])
        times, pixels, on = (np.concatenate(part) for part in zip(*fired, strict=True))
        tai_ns = start + np.rint(times * 1e9).astype(np.int64)
        order = np.lexsort((pixels, tai_ns))
        y, x = np.divmod(pixels[order], self._width)
        return Events(tai_ns[order], x.astype(np.uint16), y.astype(np.uint16), on[order])


def _fixed_normal(serial: int, stream: Stream, count: int) -> Array:
    """(count,) standard normal numbers of a camera's fixed pattern, one for each pixel."""
    words = list_words(-(-count // PIXELS), pattern_key(serial, stream))
    return normal(uniform_01(words).ravel()[:count])
