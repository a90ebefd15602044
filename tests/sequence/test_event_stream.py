"""Events of drawn scenes: a moving edge, a still scene; their files as other readers see them."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import dv_processing
import h5py
import moderngl
import numpy as np
import pytest

from simgl.camera.event_pixels import Events, joined
from simgl.cli import main
from simgl.errors import ConfigError
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.sequence.event_files import EventSource, write_events
from simgl.sequence.event_stream import MAX_PARTS, EventSpan, event_stream
from simgl.simulator import Simulator

MS = 1_000_000
DARK = 1000.0
THRESHOLD = 0.2
# Pixels per second of the bright plate's edges, from left to right.
SPEED = 20.0
PLATE_PX = 16


def scene(velocity: float) -> dict[str, Any]:
    """A bright plate before a dark one; the camera looks along the Sun's light.

    velocity : of the bright plate, to the right of the image [px/s]
    """
    pixel = 20.0 * 20e-6 / 20e-3  # [m] at 20 m

    def plate(width_px: float, reflectance: float) -> dict[str, Any]:
        size = {"width_m": width_px * pixel, "height_m": width_px * pixel}
        return {"plate": {**size, "material": {"reflectance": reflectance}}}

    return {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {"direction_icrf": [0.0, 0.0, 1.0]},
        "earth": {"shape": "none"},
        "spacecraft": {
            "bright": {
                "position_icrf_m": [7.0e6, 0.0, 0.0],
                "velocity_icrf_m_s": [velocity * pixel, 0.0, 0.0],
                "model": plate(PLATE_PX, 0.8),
            },
            "dark": {"position_icrf_m": [7.0e6, 0.0, -1.0], "model": plate(200.0, 0.08)},
        },
        "camera": {
            "dvs": {
                "position_icrf_m": [7.0e6, 0.0, 20.0],
                "boresight": [0.0, 0.0, -1.0],
                "up": [0.0, 1.0, 0.0],
                "width_px": 48,
                "height_px": 24,
                "pixel_pitch_um": 20.0,
                "focal_length_mm": 20.0,
                "dark_current_e_s": DARK,
                "optics": {"vignetting": "none"},
                "event_sensor": {
                    "threshold_on": THRESHOLD,
                    "threshold_off": THRESHOLD,
                    "threshold_spread": 0.0,
                    "refractory_us": 0.0,
                    "leak_hz": 0.0,
                    "shot_noise_hz": 0.0,
                },
            }
        },
        "render": {"samples_per_pixel": 64, "inter_reflection": False},
    }


def watch(gl: moderngl.Context, scenario: Scenario, milliseconds: int, step_ms: int) -> Events:
    start = scenario.epoch_tai_ns
    span = EventSpan(camera="dvs", start=start, stop=start + milliseconds * MS, step=step_ms * MS)
    with Simulator(scenario, gl) as simulator:
        return joined(list(event_stream(simulator, span)))


@pytest.fixture(scope="module")
def edge(module_gl: moderngl.Context) -> Events:
    """Of 0.3 s, in which the edges move by 6 pixels, in sub-frames of 0.1 pixel."""
    return watch(module_gl, scenario_from_dict(scene(SPEED)), 300, 5)


def seconds(events: Events, x: int, on: bool) -> np.ndarray[Any, Any]:
    """(rows, n) times of a column's events, without the rows at the plate's ends."""
    rows = []
    start = scenario_from_dict(scene(SPEED)).epoch_tai_ns
    for y in range(8, 16):
        chosen = (events.x == x) & (events.y == y)
        assert np.all(events.on[chosen] == on)
        rows.append((events.tai_ns[chosen] - start) * 1e-9)
    return np.array(rows)


# Of 0.8 over 0.08; the dark current is nothing before either.
COUNT = math.floor(math.log(10.0) / THRESHOLD)
# Columns that an edge crosses from end to end in 0.3 s, the plate's right and left edge.
LEADING = range(33, 37)
TRAILING = range(17, 21)


@pytest.mark.parametrize(("columns", "on"), [(LEADING, True), (TRAILING, False)])
def test_an_edge_gives_log_contrast_over_threshold_events_in_each_pixel(
    edge: Events, columns: range, on: bool
) -> None:
    """ON before the bright plate, OFF behind it, and none where no edge passes."""
    for x in columns:
        assert seconds(edge, x, on).shape == (8, COUNT)
    between = (edge.x > 23) & (edge.x < 31)
    assert not np.any(between & (edge.y > 8) & (edge.y < 15))


@pytest.mark.parametrize(("columns", "on"), [(LEADING, True), (TRAILING, False)])
def test_stamps_lie_on_the_edges_line(edge: Events, columns: range, on: bool) -> None:
    """Each event comes when the edge covers the share of its pixel that makes the contrast."""
    first = 32.0 if on else 16.0
    crossing = np.exp(THRESHOLD * np.arange(1, COUNT + 1))
    share = (crossing - 1.0) / 9.0 if on else (10.0 - 10.0 / crossing) / 9.0
    for x in columns:
        expected = (x - first + share) / SPEED
        # Between two sub-frames a line of the logarithm is off the logarithm of a line by less than
        # their distance; 64 samples place an edge to a hundredth of a pixel.
        np.testing.assert_allclose(seconds(edge, x, on).mean(axis=0), expected, atol=5e-3 + 5e-4)


def test_half_the_step_changes_stamps_by_less_than_a_step(
    gl: moderngl.Context, edge: Events
) -> None:
    coarse = watch(gl, scenario_from_dict(scene(SPEED)), 300, 10)
    for columns, on in ((LEADING, True), (TRAILING, False)):
        for x in columns:
            difference = seconds(coarse, x, on) - seconds(edge, x, on)
            # Of 10 ms for each of the two, at most.
            assert np.abs(difference).max() < 0.010


def test_a_step_is_divided_where_the_image_moves_by_more_than_half_a_pixel(
    gl: moderngl.Context,
) -> None:
    """At one step of 300 ms, or 6 pixels, all events are there all the same."""
    events = watch(gl, scenario_from_dict(scene(SPEED)), 300, 300)
    for columns, on in ((LEADING, True), (TRAILING, False)):
        for x in columns:
            assert seconds(events, x, on).shape == (8, COUNT)


def passing(speed: float, aside: float, milliseconds: int) -> Scenario:
    """The still plates, and a wall 2 m before the camera that flies by in the middle of a time.

    speed : [m/s]; aside : of its edge from the axis of the view [m]
    """
    table = scene(0.0)
    table["spacecraft"]["wall"] = {
        "position_icrf_m": [7.0e6 - 0.5e-3 * milliseconds * speed, aside + 5.0, 18.0],
        "velocity_icrf_m_s": [speed, 0.0, 0.0],
        "model": {"box": {"size_m": [4.0, 10.0, 0.5], "material": {"reflectance": 0.5}}},
    }
    return scenario_from_dict(table)


def number_of_sub_frames(
    gl: moderngl.Context, scenario: Scenario, milliseconds: int, step_ms: int
) -> int:
    start = scenario.epoch_tai_ns
    span = EventSpan(camera="dvs", start=start, stop=start + milliseconds * MS, step=step_ms * MS)
    with Simulator(scenario, gl) as simulator:
        return len(list(event_stream(simulator, span)))


def test_what_passes_beside_the_view_takes_no_more_sub_frames(gl: moderngl.Context) -> None:
    """It goes 40 mm, or 21 px at its distance, a step, 1 m from a view of 3 cm there."""
    assert number_of_sub_frames(gl, passing(8.0, 1.0, 50), 50, 5) == 10


def test_the_number_of_sub_frames_has_a_bound(gl: moderngl.Context) -> None:
    """It goes 5,000 px a step through the view."""
    count = number_of_sub_frames(gl, passing(2000.0, -5.0, 10), 10, 5)
    assert 20 < count <= 2 * MAX_PARTS


def test_a_still_scene_has_no_events_without_noise(gl: moderngl.Context) -> None:
    assert not len(watch(gl, scenario_from_dict(scene(0.0)), 1000, 200))


def source(scenario: Scenario) -> EventSource:
    return EventSource(
        camera=scenario.cameras["dvs"],
        scenario="edge",
        seed=3,
        start=scenario.epoch_tai_ns,
        renderer="none",
    )


def parts(events: Events) -> list[Events]:
    """The events in pieces, some of them empty."""
    cuts = [0, 0, len(events) // 3, len(events) // 3, len(events)]
    return [
        Events(events.tai_ns[a:b], events.x[a:b], events.y[a:b], events.on[a:b])
        for a, b in pairwise(cuts)
    ]


def test_hdf5_has_the_layout_of_dsec(edge: Events, tmp_path: Path) -> None:
    scenario = scenario_from_dict(scene(SPEED))
    path = tmp_path / "edge.h5"
    on, off = write_events(path, source(scenario), parts(edge))
    assert on == np.count_nonzero(edge.on)
    assert off == np.count_nonzero(~edge.on)
    with h5py.File(path) as file:
        t = file["events/t"][:]
        np.testing.assert_array_equal((t + file["t_offset"][()]), edge.tai_ns // 1000)
        for name, column in (("x", edge.x), ("y", edge.y), ("p", edge.on)):
            np.testing.assert_array_equal(file[f"events/{name}"][:], column)
        # First event at or after each millisecond.
        index = file["ms_to_idx"][:]
        np.testing.assert_array_equal(index, np.searchsorted(t, 1000 * np.arange(len(index))))
        assert len(index) == t[-1] // 1000 + 1
        assert file.attrs["threshold_on"] == THRESHOLD
        assert (file.attrs["width_px"], file.attrs["height_px"]) == (48, 24)


def test_aedat4_is_read_by_its_makers_library(edge: Events, tmp_path: Path) -> None:
    path = tmp_path / "edge.aedat4"
    write_events(path, source(scenario_from_dict(scene(SPEED))), parts(edge))
    recording = dv_processing.io.MonoCameraRecording(str(path))
    assert recording.getEventResolution() == (48, 24)
    read = []
    while (batch := recording.getNextEventBatch()) is not None:
        read.append(batch.numpy())
    events = np.concatenate(read)
    np.testing.assert_array_equal(events["timestamp"], edge.tai_ns // 1000)
    for name, column in (("x", edge.x), ("y", edge.y), ("polarity", edge.on)):
        np.testing.assert_array_equal(events[name], column)


def test_npz_has_the_arrays(edge: Events, tmp_path: Path) -> None:
    path = tmp_path / "edge.npz"
    write_events(path, source(scenario_from_dict(scene(SPEED))), parts(edge))
    with np.load(path) as arrays:
        np.testing.assert_array_equal(arrays["tai_ns"], edge.tai_ns)
        np.testing.assert_array_equal(arrays["p"], edge.on)
        assert arrays["seed"] == 3


@pytest.mark.parametrize("ending", [".h5", ".aedat4", ".npz"])
def test_a_file_without_events_is_complete(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"none{ending}"
    assert write_events(path, source(scenario_from_dict(scene(0.0))), [joined([])]) == (0, 0)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_camera_without_an_event_sensor_is_refused(gl: moderngl.Context) -> None:
    scenario = scenario_from_dict(scene(0.0))
    cameras = {"dvs": replace(scenario.cameras["dvs"], event_sensor=None)}
    with pytest.raises(ConfigError, match=r"\[camera.dvs\]: event_sensor is missing"):
        watch(gl, replace(scenario, cameras=cameras), 10, 10)


SCENE_TOML = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "none"
[sun]
direction_icrf = [0.0, 0.0, 1.0]
[camera.dvs]
position_icrf_m = [7.0e6, 0.0, 0.0]
boresight = [0.0, 1.0, 0.0]
width_px = 24
height_px = 16
event_sensor = { shot_noise_hz = 100.0 }
[camera.frames]
position_icrf_m = [7.0e6, 0.0, 0.0]
boresight = [0.0, 1.0, 0.0]
width_px = 24
height_px = 16
"""


def command(
    folder: Path, monkeypatch: pytest.MonkeyPatch, *options: str, out: str = "run.npz"
) -> object:
    """Exit status of ``simgl events``."""
    (folder / "scene.toml").write_text(SCENE_TOML)
    arguments = ["simgl", "events", str(folder / "scene.toml"), "--out", str(folder / out)]
    monkeypatch.setattr(sys, "argv", [*arguments, *options])
    with pytest.raises(SystemExit) as done:
        main()
    return done.value.code


def test_the_command_writes_the_same_file_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--camera", "dvs", "--duration", "0.1")
    runs = []
    for out in ("run.npz", "again.npz"):
        assert not command(tmp_path, monkeypatch, *options, out=out)
        with np.load(tmp_path / out) as file:
            runs.append({name: file[name] for name in file.files})
    assert 100 < len(runs[0]["tai_ns"]) < 24 * 16 * 100 * 0.2
    assert f"{np.count_nonzero(runs[0]['p'])} ON and " in capsys.readouterr().out
    for name, column in runs[0].items():
        np.testing.assert_array_equal(column, runs[1][name])


@pytest.mark.parametrize(
    ("options", "out", "problem"),
    [
        (("--camera", "frames"), "run.npz", "[camera.frames]: event_sensor is missing"),
        (("--camera", "dsv"), "run.npz", '--camera "dsv" is not in'),
        (("--camera", "dvs"), "run.txt", "--out must end in .h5, .hdf5, .aedat4, .npz"),
        (("--camera", "dvs", "--step", "0"), "run.npz", "--step must be at least 1e-6 s, got 0"),
        (("--camera", "dvs", "--duration", "0"), "run.npz", "--to must be later than the start"),
    ],
)
def test_bad_options_are_one_line_and_no_file(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    out: str,
    problem: str,
) -> None:
    span = () if "--duration" in options else ("--duration", "0.1")
    assert command(tmp_path, monkeypatch, *options, *span, out=out) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert problem in line
    assert not (tmp_path / out).exists()


def test_a_missing_package_is_one_line(tmp_path: Path) -> None:
    """With the pip command."""
    (tmp_path / "scene.toml").write_text(SCENE_TOML)
    hidden = "import sys; sys.modules['h5py'] = None; from simgl.cli import main; main()"
    arguments = ["events", "scene.toml", "--camera", "dvs", "--duration", "1", "--out", "run.h5"]
    done = subprocess.run(
        [sys.executable, "-c", hidden, *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.strip().endswith('--out with .h5 needs h5py: pip install "simgl[events]"')
