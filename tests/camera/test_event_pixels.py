"""Laws of an event camera's pixels, from photo-currents that are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.event_pixels import EventPixels, Events, joined
from simgl.errors import ConfigError
from simgl.scenario.loader import scenario_from_dict

START = 1_700_000_000_123_456_789
SECOND = 1_000_000_000
HEIGHT, WIDTH = 40, 60
DARK = 100.0
IDEAL = {"threshold_spread": 0.0, "leak_hz": 0.0, "shot_noise_hz": 0.0, "refractory_us": 0.0}


def camera(serial: int = 1, **sensor: float) -> Camera:
    table: dict[str, Any] = {
        "position_icrf_m": [7.0e6, 0.0, 0.0],
        "boresight": [0.0, 0.0, 1.0],
        "width_px": WIDTH,
        "height_px": HEIGHT,
        "dark_current_e_s": DARK,
        "serial": serial,
        "event_sensor": {**IDEAL, **sensor},
    }
    scene = {"epoch": {"utc": "2026-03-20T12:00:00"}, "camera": {"dvs": table}}
    return scenario_from_dict(scene).cameras["dvs"]


def even(rate: float) -> Array:
    return np.full((HEIGHT, WIDTH), rate)


def watch(camera: Camera, rates: list[float], seconds: float, seed: int = 0) -> Events:
    """Events of uniform light of these photo-currents at instants that divide the time evenly."""
    pixels = EventPixels(camera, even(rates[0]), START, seed)
    step = seconds * SECOND / (len(rates) - 1)
    return joined(
        [
            pixels.advance(even(rate), START + round(number * step))
            for number, rate in enumerate(rates[1:], 1)
        ]
    )


def of_pixel(events: Events, x: int, y: int) -> Array:
    """Seconds from the start of a pixel's events."""
    return (events.tai_ns[(events.x == x) & (events.y == y)] - START) * 1e-9


@pytest.mark.parametrize("ratio", [1.5, 7.3, 0.11])
def test_uniform_light_gives_log_ratio_over_threshold_events_on_a_line(ratio: float) -> None:
    """Of one sign, in equal steps of the logarithm; the stamps are right to their last digit."""
    sensor = camera(threshold_on=0.2, threshold_off=0.3)
    dim = 1e4
    change = math.log((dim * ratio + DARK) / (dim + DARK))
    threshold = 0.2 if change > 0.0 else 0.3
    events = watch(sensor, [dim, dim * ratio], 2.0)
    count = math.floor(abs(change) / threshold)
    assert len(events) == count * HEIGHT * WIDTH
    assert np.all(events.on == (change > 0.0))
    expected = 2.0 * threshold / abs(change) * np.arange(1, count + 1)
    # 1 ns of the stamp, and its place in float64 seconds.
    np.testing.assert_allclose(of_pixel(events, 17, 23), expected, atol=1.1e-9, rtol=0.0)
    assert np.all(np.diff(events.tai_ns) >= 0)


def test_what_is_left_of_a_change_counts_for_the_next() -> None:
    """Ten steps of half a threshold give as many events as their sum."""
    rates = [(1e4 + DARK) * math.exp(0.1 * n) - DARK for n in range(12)]
    assert len(watch(camera(), rates, 1.0)) == 5 * HEIGHT * WIDTH


def test_signs_are_symmetric() -> None:
    """Light that falls as it rose gives the same stamps with the other sign."""
    up, down = watch(camera(), [1e3, 9e4], 1.0), watch(camera(), [9e4, 1e3], 1.0)
    np.testing.assert_array_equal(up.tai_ns, down.tai_ns)
    assert up.on.all()
    assert not down.on.any()


def test_a_pixel_is_blind_for_its_refractory_time_and_then_compares_with_the_light_it_finds() -> (
    None
):
    """On a ramp of the logarithm the interval is threshold over slope, and the refractory time;
    also where that is longer than the time between sub-frames."""
    slope, refractory = 40.0, 3e-3
    sensor = camera(refractory_us=refractory * 1e6)
    rates = [(1e4 + DARK) * math.exp(slope * n / 1000.0) - DARK for n in range(101)]
    times = of_pixel(watch(sensor, rates, 0.1), 5, 6)
    expected = 0.2 / slope + (0.2 / slope + refractory) * np.arange(len(times))
    assert len(times) == 1 + math.floor((0.1 - 0.2 / slope) / (0.2 / slope + refractory))
    np.testing.assert_allclose(times, expected, atol=2e-9, rtol=0.0)


def test_thresholds_spread_as_stated_and_belong_to_the_camera() -> None:
    """The logarithm of the first event's time on a ramp is that of the threshold."""
    spread, count = 0.2, HEIGHT * WIDTH
    rates = [1e4, 1e4 * math.exp(0.9)]

    def first(serial: int) -> Array:
        events = watch(camera(serial, threshold_spread=spread), rates, 1.0)
        pixel = events.y.astype(np.int64) * WIDTH + events.x
        _, place = np.unique(pixel, return_index=True)
        return np.log((events.tai_ns[place] - START) * 1e-9)

    logarithm = first(1)
    assert len(logarithm) == count
    # Standard error of a standard deviation: 1 / sqrt(2 n). 5 sigma.
    assert abs(logarithm.std() / spread - 1.0) < 5.0 / math.sqrt(2.0 * count)
    np.testing.assert_array_equal(logarithm, first(1))
    assert abs(np.corrcoef(logarithm, first(2))[0, 1]) < 5.0 / math.sqrt(count)


def test_a_still_scene_has_leak_events_at_their_rate() -> None:
    """ON only; each pixel regularly, all of them at other times."""
    rate, seconds, refractory = 5.0, 4.0, 0.01
    sensor = camera(leak_hz=rate, refractory_us=refractory * 1e6)
    events = watch(sensor, [2e4] * 5, seconds)
    assert events.on.all()
    period = 1.0 / rate + refractory
    np.testing.assert_allclose(np.diff(of_pixel(events, 3, 4)), period, atol=2e-9, rtol=0.0)
    # A pixel's first event comes at any time of its first cycle. Its number is then one of two
    # integers, with a variance of at most 1/4. 5 sigma.
    first = (np.arange(1000) + 0.5) / (1000.0 * rate)
    expected = (1.0 + np.floor((seconds - first) / period)).mean()
    count = HEIGHT * WIDTH
    assert abs(len(events) / count - expected) < 5.0 * 0.5 / math.sqrt(count)


@pytest.mark.parametrize("light", [0.0, 900.0])
@pytest.mark.parametrize("seed", [0, 7])
def test_a_still_scene_has_noise_at_the_rate_of_its_light(light: float, seed: int) -> None:
    """Of both signs; dark current over all current times the rate in darkness."""
    rate, seconds = 6.0, 5.0
    events = watch(camera(shot_noise_hz=rate), [light] * 3, seconds, seed)
    expected = rate * DARK / (light + DARK) * seconds * HEIGHT * WIDTH
    assert abs(len(events) - expected) < 5.0 * math.sqrt(expected)
    assert abs(2.0 * np.count_nonzero(events.on) - len(events)) < 5.0 * math.sqrt(expected)


def test_noise_depends_on_the_seed_and_not_on_the_sub_frames() -> None:
    sensor = camera(shot_noise_hz=8.0, leak_hz=3.0, threshold_spread=0.1, refractory_us=500.0)
    rates = [(300.0 + DARK) * math.exp(0.7 * n / 8.0) - DARK for n in range(9)]
    coarse, fine, other = (
        watch(sensor, rates[::4], 1.0),
        watch(sensor, rates, 1.0),
        watch(sensor, rates, 1.0, seed=1),
    )
    assert len(coarse) > HEIGHT * WIDTH
    again = watch(sensor, rates, 1.0)
    for a, b in zip(
        (fine.tai_ns, fine.x, fine.y, fine.on),
        (again.tai_ns, again.x, again.y, again.on),
        strict=True,
    ):
        np.testing.assert_array_equal(a, b)
    assert len(other) != len(fine) or not np.array_equal(other.tai_ns, fine.tai_ns)
    # The rate of noise is that of the middle of a sub-frame: the mean of exp(-x) over a half of
    # 0.7 differs from its middle by 0.7^2 / 4 / 24 = 0.5 %.
    assert abs(len(coarse) - len(fine)) < 0.01 * len(fine)
    on_line = camera(leak_hz=3.0, refractory_us=500.0)
    coarse, fine = watch(on_line, rates[::4], 1.0), watch(on_line, rates, 1.0)
    # Rounding of float64, then of the stamp.
    assert np.abs(coarse.tai_ns - fine.tai_ns).max() <= 1


def test_instants_must_follow_each_other() -> None:
    pixels = EventPixels(camera(), even(1e4), START, 0)
    with pytest.raises(ValueError, match="later"):
        pixels.advance(even(1e4), START)


def test_an_event_sensor_needs_a_dark_current() -> None:
    with pytest.raises(ConfigError, match=r"dark_current_e_s must be above 0 with an event_sensor"):
        scenario_from_dict(
            {
                "epoch": {"utc": "2026-03-20T12:00:00"},
                "camera": {
                    "dvs": {
                        "position_icrf_m": [7.0e6, 0.0, 0.0],
                        "boresight": [0.0, 0.0, 1.0],
                        "preset": "ideal",
                        "event_sensor": {},
                    }
                },
            }
        )
