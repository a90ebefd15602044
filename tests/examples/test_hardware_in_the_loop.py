"""Real time before a screen: when frames are due, where pixels lie, what the screen gets."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from examples.hardware_in_the_loop.frame_clock import FrameClock
from examples.hardware_in_the_loop.pixel_map import PixelMap
from tests.patience import run_to_end

ROOT = Path(__file__).parents[2]


class Time:
    """A clock that passes only while somebody waits."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def now(self) -> float:
        return self.now_s

    def idle(self, seconds: float) -> None:
        self.now_s += min(seconds, 0.005)


def clock_of(time: Time) -> FrameClock:
    return FrameClock(5.0, tolerance_s=0.01, now=time.now, idle=time.idle)


def play(time: Time, drawing_s: list[float]) -> FrameClock:
    """Frames that take these times to be drawn, one while the one before waits for its time."""
    clock, frame = clock_of(time), 0
    clock.start()
    ready = time.now() + drawing_s[0]
    while frame < len(drawing_s):
        time.now_s = max(time.now_s, ready)
        following = clock.following(frame, len(drawing_s))
        if following < len(drawing_s):
            ready = time.now_s + drawing_s[following]
        clock.wait(frame)
        clock.shown(frame)
        frame = following
    return clock


def test_frames_are_due_by_the_wall_clock_and_do_not_drift() -> None:
    """Frame k stands k periods after the first, though each takes most of a period to draw."""
    time = Time()
    clock = play(time, [0.19] * 50)
    assert not clock.late
    assert not clock.missed
    assert time.now() - clock.due(0) == pytest.approx(49 * 0.2, abs=1e-9)
    assert clock.report().startswith("50 frames shown at 5 Hz, 0 late")


def test_a_late_frame_is_counted_and_moves_no_other() -> None:
    """It is asked for two periods, or 0.4 s, before its time: 0.45 s are 0.05 s too long."""
    clock = play(Time(), [0.1, 0.1, 0.1, 0.45, 0.1, 0.1])
    assert clock.late == [3]
    assert clock.lateness_s[3] == pytest.approx(0.05, abs=1e-9)
    assert not clock.missed


def test_frames_whose_time_is_over_are_missed_and_counted() -> None:
    """Every frame was shown or missed; those after a pause are in time."""
    clock = play(Time(), [0.1, 0.04, 0.95, 0.04, 0.04, 0.04, 0.04, 0.04])
    assert clock.late == [2]
    assert clock.missed == [3, 4]
    assert sorted([*clock.lateness_s, *clock.missed]) == list(range(8))
    assert "1 late (by 550.0 ms at most), 2 missed" in clock.report()


def test_each_pixel_is_a_square_of_screen_pixels_at_the_stated_place() -> None:
    rng = np.random.default_rng(1)
    radiance = rng.uniform(0.0, 60.0, (24, 32, 4)).astype(np.float32)
    pixel_map = PixelMap(screen_size=(101, 80), image_size=(32, 24), white_radiance=60.0)
    screen = pixel_map.screen(radiance)
    (left, top), zoom = pixel_map.corner, pixel_map.zoom
    assert (left, top, zoom) == (2, 4, 3)
    assert str(pixel_map).startswith("screen 101 x 80: pixel (i, j) at (2 + 3 i, 4 + 3 j)")
    for i, j in ((0, 0), (31, 23), (7, 11)):
        square = screen[top + zoom * j : top + zoom * (j + 1), left + zoom * i :][:, :zoom]
        # Half a code value of light that goes with the 2.2th power.
        light = 60.0 * (square / 255.0) ** 2.2
        assert np.ptp(square) == 0
        assert light[0, 0] == pytest.approx(radiance[j, i, :3].mean(), abs=60.0 * 2.2 * 0.5 / 255)
    outside = np.ones(screen.shape, dtype=bool)
    outside[top : top + 72, left : left + 96] = False
    assert not screen[outside].any()


def test_what_the_screen_cannot_show_is_refused_or_counted() -> None:
    with pytest.raises(ValueError, match="32 x 24 pixels is larger than the screen of 31 x 80"):
        PixelMap(screen_size=(31, 80), image_size=(32, 24), white_radiance=60.0)
    bright = np.full((24, 32, 4), 61.0, dtype=np.float32)
    bright[0] = 60.0
    pixel_map = PixelMap(screen_size=(32, 24), image_size=(32, 24), white_radiance=60.0)
    assert pixel_map.clipped(bright).sum() == 23 * 32
    assert pixel_map.screen(bright).min() == 255


SCREEN = """
import numpy as np
from examples.hardware_in_the_loop.full_screen import FullScreen
with FullScreen() as screen:
    width, height = screen.size
    codes = np.random.default_rng(2).integers(0, 256, (height, width), dtype=np.uint8)
    screen.prepare(codes)
    for channel in range(3):
        np.testing.assert_array_equal(screen.prepared()[..., channel], codes)
    screen.show()
    assert not screen.closed
    print(width, height)
"""


def environment(display: str) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("WAYLAND", "XDG_"))}
    return {**kept, "DISPLAY": display}


@pytest.mark.display
def test_the_screen_gets_every_code_value_where_it_belongs(display: str) -> None:
    """Full screen, row 0 at the top, bit for bit."""
    done = run_to_end([sys.executable, "-c", SCREEN], env=environment(display), cwd=ROOT)
    assert done.stdout.split() == ["1280", "1024"]


@pytest.mark.display
def test_the_example_counts_every_frame(display: str) -> None:
    """Shown and missed together are those of its time; its exit status says whether it holds."""
    command = [
        sys.executable, "-m", "examples.hardware_in_the_loop", "examples/bridge/box.toml",
        "--camera", "navcam", "--seconds", "2",
    ]  # fmt: skip
    done = run_to_end(command, env=environment(display), cwd=ROOT, check=False)
    lines = done.stdout.splitlines()
    assert lines[0].startswith("screen 1280 x 1024: pixel (i, j) at (0 + 4 i, 32 + 4 j), 4 x 4")
    counts = re.fullmatch(r"(\d+) frames shown at 5 Hz, (\d+) late \(.*\), (\d+) missed", lines[-1])
    assert counts is not None, done.stderr
    shown, late, missed = map(int, counts.groups())
    assert shown + missed == 10
    assert done.returncode == (1 if late or missed else 0)


def test_without_a_display_it_is_one_line() -> None:
    without = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "examples.hardware_in_the_loop", "a.toml", "--camera", "b"]
    done = run_to_end(command, env=without, cwd=ROOT, check=False)
    assert done.stderr.strip() == (
        "hardware_in_the_loop: no display: DISPLAY is not set; start a display server"
    )
