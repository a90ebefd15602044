"""The last metres flown, and the example as a user starts it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from simgl_bridge import BodyPose, Client
from simgl_bridge import Image as BridgeImage

from examples.closed_loop.camera import Pinhole
from examples.closed_loop.exposure import Light
from examples.closed_loop.guidance import Leg, Plan
from examples.closed_loop.loop import CAMERA as NAVCAM
from examples.closed_loop.loop import LAMP, Flight, Settings, fly
from examples.closed_loop.report import summarise, write_report
from simgl import load_scenario
from tests.bridge.harness import finish, start
from tests.patience import limit, run_to_end

ROOT = Path(__file__).parents[3]
SCENARIO = ROOT / "examples" / "docking.toml"


@pytest.fixture(scope="module")
def flight() -> Flight:
    """The last four metres with small pictures, over the bridge, into the eclipse."""
    scenario = load_scenario(SCENARIO)
    navcam = scenario.cameras[NAVCAM]
    small = replace(
        navcam,
        detector=replace(navcam.detector, width=240, height=240),
        lens=replace(navcam.lens, focal_length=navcam.lens.focal_length * 240.0 / 360.0),
    )
    late = replace(
        scenario,
        epoch_tai_ns=scenario.epoch_tai_ns + 330 * 10**9,
        cameras={NAVCAM: small},
        inter_reflection=False,
    )
    plan = Plan(
        far=Leg(distance=4.0, top_speed=0.1, time_constant=20.0, hop=8.0),
        near=Leg(distance=1.6, top_speed=0.12, time_constant=14.0, hop=8.0),
        held_fixes=2,
    )
    settings = Settings(
        seed=5, settle=12.0, offset=(114.6, 0.0, -0.5), spread=(0.1, 0.1, 0.1, 0, 0, 0), plan=plan
    )
    running = start(late)
    try:
        with Client(running.address, timeout_s=limit(60.0)) as client:

            def take_image(
                tai_ns: int, bodies: Mapping[str, BodyPose], light: Light, moving: bool
            ) -> BridgeImage:
                lamps = {LAMP: float(light.lamp)}
                return client.render(
                    tai_ns, NAVCAM, bodies, light.exposure, lamps=lamps, moving=moving
                )

            return fly(late, Pinhole.from_card(client.welcome.cameras[0]), take_image, settings)
    finally:
        finish(running)


def test_the_chaser_arrives_at_docking_range_by_lamplight(flight: Flight) -> None:
    assert flight.arrived
    # On the axis, within what guidance calls arrived; its push is good to 2 % and a tenth of a
    # millimetre per second.
    assert abs(flight.final[0] - 1.6) < 0.15
    assert np.hypot(*flight.final[1:]) < 0.03
    assert np.degrees(flight.misalignment) < 2.0
    lit = [f.look.light.lamp for f in flight.frames]
    assert not lit[0]
    assert lit[-1]
    assert flight.frames[-1].sunlit < 1e-3


def test_images_are_as_old_as_the_camera_says_when_they_arrive(flight: Flight) -> None:
    # Half an exposure, 0.04 s of read-out and 1.5 s of transport; software looks once a second.
    for frame in flight.frames:
        assert frame.look.age == 2.0


def test_the_estimate_lies_within_what_the_filter_claims(flight: Flight) -> None:
    # 9 numbers of some 30 frames, highly correlated: none beyond 4 sigma once markers are held.
    held = [f for f in flight.frames if f.look.pose is not None]
    assert len(held) > 0.6 * len(flight.frames)
    for frame in held:
        assert np.all(np.abs(frame.error) < 4.0 * frame.sigma)


def test_a_report_needs_no_other_file(flight: Flight, tmp_path: Path) -> None:
    paths = write_report(flight, summarise(flight, 10.0, "none"), tmp_path)
    page = paths[0].read_text()
    assert page.count("data:image/png;base64,") == page.count("data:image/svg+xml;base64,") == 1
    # In words with units, not the names of variables.
    assert "camera off the board&#39;s axis" in page
    assert "off_axis_m" not in page
    assert ">DOCKED<" in page
    assert 'src="http' not in page
    assert len((tmp_path / "docking.csv").read_text().splitlines()) == len(flight.frames) + 1


def demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The example as a user starts it."""
    command = [sys.executable, "-m", "examples.closed_loop", *arguments]
    return run_to_end(command, cwd=ROOT, check=False)


def test_two_processes_leave_pictures_plot_table_and_summary(tmp_path: Path) -> None:
    done = demo("--out", str(tmp_path), "--frames", "3", "--seed", "4", "--runs", "2", "--film")
    assert done.returncode == 0, done.stderr
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {
        "docking.csv",
        "docking.html",
        "docking.webp",
        "docking_plot.png",
        "docking_strip.png",
        "docking_summary.json",
        "monte_carlo.html",
        "monte_carlo.json",
        "monte_carlo.png",
    }
    with Image.open(tmp_path / "docking.webp") as film:
        assert getattr(film, "n_frames", 1) == 3
    summary = json.loads((tmp_path / "docking_summary.json").read_text())
    assert summary["frames"] == 3
    assert summary["frames_per_second"] > 0.0
    assert not summary["arrived"]
    assert len((tmp_path / "docking.csv").read_text().splitlines()) == 4
    many = json.loads((tmp_path / "monte_carlo.json").read_text())
    assert [run["seed"] for run in many["runs"]] == [4, 5]
    assert "Looking for Space Rider's wing tips" in done.stdout
    last = done.stdout.splitlines()[-1]
    assert last.startswith("0 of 2 flights met all criteria: DOCKED")
    assert "docking.html" in last
    assert "monte_carlo.html" in last


def test_a_folder_that_cannot_be_written_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = demo("--out", str(tmp_path / "file" / "out"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("closed_loop: ")
    assert "cannot be written" in done.stderr
