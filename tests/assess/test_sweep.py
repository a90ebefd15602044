"""Sweeps: one picture serves all settings, the Sun stands where it is asked to, resumable."""

from __future__ import annotations

import csv
import re
import sqlite3
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.assess.sweep import Sweep
from simgl.assess.sweep_axes import Axis, parse_axes, with_setting, with_sun
from simgl.assess.trajectory_assessment import assignment
from simgl.cli import main
from simgl.errors import ConfigError
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.simulator import Capture, Simulator
from tests.scenes import USUAL_PRODUCTS, lambert, scene

SCENE = """\
[epoch]
utc = "2026-03-20T12:00:00"
[earth]
shape = "none"
[spacecraft.target]
model.sphere = { radius_m = 1.0, material = { reflectance = 0.5 } }
orbit = { altitude_km = 400.0 }
[camera.near]
about = { target = "target", azimuth_deg = 20.0, range_m = 30.0 }
width_px = 64
height_px = 48
focal_length_mm = 2.0
[render]
inter_reflection = false
"""


def assess(monkeypatch: pytest.MonkeyPatch, *arguments: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["simgl", "assess", *map(str, arguments)])
    with pytest.raises(SystemExit) as done:
        main()
    return int(done.value.code or 0)


def ball() -> Scenario:
    return scene(
        {"ball": {"model": {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}},
                  "position_icrf_m": [1.0, 2.0, 3.0]}},
        {"position_icrf_m": [10.0, -4.0, 8.0], "look_at": "ball", "up": [0.0, 0.0, 1.0]},
    )  # fmt: skip


def test_a_bracket_is_the_same_as_one_capture_after_the_other(gl: moderngl.Context) -> None:
    scenario = ball()
    state = scenario.at(scenario.epoch_tai_ns)
    camera = scenario.cameras["cam"]
    settings = [
        with_setting(camera, {"exposure_time_s": time, "f_number": stop})
        for time in (1e-5, 1e-3)
        for stop in (2.0, 8.0)
    ]
    with Simulator(scenario, gl) as simulator:
        together = simulator.bracket(state, "cam", settings, USUAL_PRODUCTS)
        for draw, (setting, ours) in enumerate(zip(settings, together, strict=True)):
            placed = replace(state.cameras["cam"], camera=setting)
            alone = simulator.capture(
                replace(state, cameras={"cam": placed}), "cam", USUAL_PRODUCTS, draw=draw
            )
            assert ours.digital is not None
            assert alone.digital is not None
            assert np.array_equal(ours.digital.dn, alone.digital.dn)
            assert ours.electrons is not None
            assert alone.electrons is not None
            assert np.array_equal(ours.electrons.electrons, alone.electrons.electrons)
            assert ours.radiance is not None
            assert alone.radiance is not None
            assert np.array_equal(ours.radiance.radiance, alone.radiance.radiance)
        # Four times the light through twice the aperture, a hundred times in a hundred times.
        means = [e.electrons.electrons.mean() for e in together if e.electrons is not None]
        assert means[0] / means[1] == pytest.approx(16.0, rel=1e-5)
        assert means[2] / means[0] == pytest.approx(100.0, rel=1e-5)
        longer = replace(camera, lens=replace(camera.lens, focal_length=0.1))
        with pytest.raises(ValueError, match="size or the field"):
            simulator.bracket(state, "cam", [longer])


@pytest.mark.parametrize("phase", [0.0, 30.0, 120.0, 180.0])
def test_the_sun_stands_where_it_is_asked_to(phase: float) -> None:
    scenario = ball()
    state = scenario.at(scenario.epoch_tai_ns)
    place = state.bodies["ball"].pose.position
    for clock in (0.0, 90.0, 200.0):
        asked = {"phase_angle_deg": phase, "sun_clock_deg": clock}
        moved = with_sun(state, "cam", "ball", asked)
        sun = moved.sun.seen_from(place)
        camera = state.cameras["cam"]
        x, y, z = camera.R_camera_from_icrf @ sun.direction_icrf
        # From the target the camera stands along -z; the top of the picture is -y.
        assert np.degrees(np.arctan2(np.hypot(x, y), -z)) == pytest.approx(phase, abs=1e-9)
        if 0.0 < phase < 180.0:
            off = np.angle(np.exp(1j * (np.arctan2(x, -y) - np.radians(clock))))
            assert abs(off) < 1e-12
        assert np.array_equal(sun.irradiance, state.sun.seen_from(place).irradiance)


def test_the_lit_limb_faces_the_sun(gl: moderngl.Context) -> None:
    """At a phase of 90 deg half the ball is lit: the side at the Sun's clock angle."""
    scenario = ball()
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:
        for clock, (down, right) in {0.0: (-1, 0), 90.0: (0, 1), 180.0: (1, 0)}.items():
            moved = with_sun(
                state, "cam", "ball", {"phase_angle_deg": 90.0, "sun_clock_deg": clock}
            )
            frame = simulator.capture(moved, "cam", USUAL_PRODUCTS).radiance
            assert frame is not None
            light = frame.radiance.sum(axis=-1)
            rows, columns = np.indices(light.shape)
            middle = (np.array(light.shape) - 1.0) / 2.0
            lean = [
                np.average(rows - middle[0], weights=light),
                np.average(columns - middle[1], weights=light),
            ]
            assert lean @ np.array([down, right]) > 0.9 * np.linalg.norm(lean) > 1.0


def test_an_ephemeris_sun_keeps_its_distance(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    scenario = load_scenario(path)
    state = scenario.at(scenario.epoch_tai_ns)
    place = state.bodies["target"].pose.position
    moved = with_sun(state, "near", "target", {"phase_angle_deg": 42.0})
    before, after = state.sun.seen_from(place), moved.sun.seen_from(place)
    assert after.irradiance == pytest.approx(before.irradiance, rel=1e-12)
    assert after.angular_radius == pytest.approx(before.angular_radius, rel=1e-12)
    line = state.cameras["near"].position - place
    cosine = after.direction_icrf @ line / np.linalg.norm(line)
    assert np.degrees(np.arccos(cosine)) == pytest.approx(42.0)


def test_a_sweep_leaves_a_table_and_a_page_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "scene.toml", tmp_path / "out"
    path.write_text(SCENE)
    options = ("--sweep", "exposure_time_s=1e-6:1e-2:3:log", "--sweep", "f_number=4,2",
               "--sweep", "phase_angle_deg=10,170", "--out", out)  # fmt: skip
    assert assess(monkeypatch, path, *options) == 0
    assert "12 points" in capsys.readouterr().out
    with (out / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    asked = [
        (float(r["sweep_phase_angle_deg"]), float(r["sweep_exposure_time_s"]),
         float(r["sweep_f_number"])) for r in rows
    ]  # fmt: skip
    times = (1e-6, 1e-4, 1e-2)
    for found, wanted in zip(
        asked, [(p, t, f) for p in (10.0, 170.0) for t in times for f in (4.0, 2.0)], strict=True
    ):
        assert found == pytest.approx(wanted)
    for row in rows:
        phase = float(row["phase_angle_deg"])
        assert phase == pytest.approx(float(row["sweep_phase_angle_deg"]), abs=1e-6)
    assert {"too dark", "too bright"} <= {row["verdict"] for row in rows}
    page = (out / "report.html").read_text()
    # A sheet for each f-number, the shortest axis.
    assert page.count("data:image/svg+xml;base64,") == 2
    assert not re.search(r'(src|href)="(?!data:)', page)
    before = (out / "frames.csv").read_bytes()
    with sqlite3.connect(out / "frames.sqlite") as database:
        database.execute("DELETE FROM frames WHERE frame IN (3, 7, 8)")
    database.close()
    assert assess(monkeypatch, path, *options) == 0
    assert (out / "frames.csv").read_bytes() == before
    capsys.readouterr()
    assert assess(monkeypatch, path, "--sweep", "f_number=4", "--out", out) == 2
    assert "holds another run: sweep was" in capsys.readouterr().err


def test_every_point_of_a_sweep_has_its_own_noise(gl: moderngl.Context) -> None:
    draws: list[object] = []

    class Watched(Simulator):
        def bracket(self, *arguments: Any, **words: Any) -> tuple[Capture, ...]:
            captures = super().bracket(*arguments, **words)
            draws.extend(capture.info.draw for capture in captures)
            return captures

    scenario = ball()
    work = assignment(scenario, "cam", "ball", [scenario.epoch_tai_ns])
    sweep = Sweep(work, parse_axes(["phase_angle_deg=10,60,90", "f_number=4,2"]))
    with Watched(scenario, gl) as simulator:
        for frame in (2, 0, 1):
            rows = sweep.render(simulator, frame)
            assert [row["frame"] for row in rows] == draws[-2:]
    assert set(draws) == set(range(6))


def test_axes_are_read_in_their_order() -> None:
    assert parse_axes(["f_number=2, 4", "phase_angle_deg=0:180:3"]) == (
        Axis("phase_angle_deg", (0.0, 90.0, 180.0)),
        Axis("f_number", (2.0, 4.0)),
    )


@pytest.mark.parametrize(
    ("texts", "complaint"),
    [
        (["f_number"], '--sweep must be NAME=VALUES, got "f_number"'),
        (["f_nmber=2"], '--sweep has no "f_nmber"; did you mean "f_number"?'),
        (["f_number=2", "f_number=4"], "--sweep names f_number twice"),
        (["f_number=2,2"], "f_number names a value twice"),
        (["f_number=2,x"], 'f_number must be a number, got "x"'),
        (["f_number="], 'f_number must be a number, got ""'),
        (["f_number=nan"], 'f_number must be finite, got "nan"'),
        (["f_number=0.1"], "f_number must lie in 0.5..1000, got 0.1"),
        (["f_number=2:4"], "f_number must be FROM:TO:COUNT or FROM:TO:COUNT:log"),
        (["f_number=2:4:3:lin"], "f_number must be FROM:TO:COUNT or FROM:TO:COUNT:log"),
        (["f_number=2:4:1"], 'f_number must have a count in 2..1000, got "1"'),
        (["phase_angle_deg=0:90:4:log"], "phase_angle_deg must have positive ends for log"),
        (["phase_angle_deg=190"], "phase_angle_deg must lie in 0..180, got 190"),
    ],
)
def test_bad_axes_are_one_line(texts: list[str], complaint: str) -> None:
    with pytest.raises(ConfigError) as refused:
        parse_axes(texts)
    assert complaint in str(refused.value)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ([], "--out is needed for the report of a sweep"),
        (["--out", "x", "--count", "3"], "--sweep is at one epoch: --at, and no span"),
    ],
)
def test_a_sweep_wants_a_folder_and_no_span(
    options: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    assert assess(monkeypatch, "scene.toml", "--sweep", "f_number=2", *options) == 2
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
