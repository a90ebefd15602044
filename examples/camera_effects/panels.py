"""The panels: the scene, a detector without faults, and what each panel adds to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from simgl import (
    Camera,
    Detector,
    Product,
    Scenario,
    SceneState,
    Simulator,
    display_from_dn,
    load_scenario,
    scenario_from_dict,
)
from simgl.arrays import Image8
from simgl.camera.detector import FixedPattern, Particles
from simgl.progress import ProgressCallback

SCENE = Path(__file__).parents[1] / "gallery" / "bay.toml"
CAMERA = "craft"
# Of the camera, about the image's vertical.
TURN_RATE = np.radians(10.0)


@dataclass(frozen=True, kw_only=True)
class Panel:
    """What differs from the plain image.

    detector : changed fields
    light : exposure time over the plain one
    shown : gain of the display
    turns : the camera turns while the shutter is open
    dimmed : share of the light that a filter lets through
    raw : shown as grey, whatever the filters
    """

    detector: dict[str, Any]
    light: float = 1.0
    shown: float = 1.0
    turns: bool = False
    dimmed: float = 1.0
    raw: bool = False


def faint(**detector: Any) -> Panel:
    """With 1/256 of the light and a high gain."""
    return Panel(detector={**detector, "gain_dn_per_e": 1.0}, light=1.0 / 256.0, shown=40.0)


def panels(colour: Detector) -> dict[str, Panel]:
    """By what is written above them; strong enough to be seen, far beyond a good camera's.

    colour : a detector with filters
    """
    filters = {"mosaic": colour.mosaic}
    protons = Particles(flux=1e12, depth=5e-6, charge=630e6)
    pattern = FixedPattern(prnu=0.05, dead_pixels=0.001)
    offsets = FixedPattern(dsnu=4.0, rows=3.0, columns=6.0)
    hot = FixedPattern(hot_pixels=0.002, hot_current=3e6)
    return {
        "plain: shot noise alone": Panel(detector={}),
        "shot noise, 1/256 of the light": faint(),
        "+ read noise 10 e-": faint(read_noise=10.0),
        "+ offsets: DSNU 4, rows 3, columns 6 e-": faint(pattern=offsets),
        "+ row noise 8 e-": faint(row_noise=8.0),
        "PRNU 5 %, dead pixels 0.1 %": Panel(detector={"pattern": pattern}),
        "dark current at 350 K, hot pixels": Panel(
            detector={"pattern": hot, "dark_current_300k": 2e5, "temperature": 350.0}
        ),
        "protons of 50 MeV, 1e8 per cm2 and s": Panel(detector={"particles": protons}),
        "full well, 8 times the light": Panel(detector={}, light=8.0),
        "+ blooming": Panel(detector={"blooming": 0.9}, light=8.0),
        "motion blur, 10 deg/s": Panel(detector={}, light=500.0, dimmed=1.0 / 500.0, turns=True),
        "rolling shutter, 10 deg/s": Panel(detector={"row_time": 400e-6}, turns=True),
        "raw mosaic": Panel(detector=filters, light=2.0, raw=True),
        "developed": Panel(detector=filters, light=2.0),
        "8 bits without a pedestal": Panel(
            detector={"bits": 8, "pedestal": 0.0, "read_noise": 10.0, "gain_dn_per_e": 255 / 24500},
            light=1.0 / 64.0,
            shown=64.0,
        ),
        "all of it": Panel(
            detector={
                **filters,
                "pattern": FixedPattern(
                    prnu=0.02,
                    dead_pixels=0.0005,
                    dsnu=4.0,
                    rows=3.0,
                    columns=6.0,
                    hot_pixels=0.001,
                    hot_current=1e6,
                ),
                "read_noise": 10.0,
                "row_noise": 8.0,
                "dark_current_300k": 1e3,
                "temperature": 320.0,
                "particles": protons,
                "blooming": 0.9,
                "row_time": 100e-6,
            },
            light=0.1,
            shown=20.0,
            turns=True,
        ),
    }


def rendered_panels(
    width: int, progress: ProgressCallback | None = None
) -> Iterator[tuple[str, Image8]]:
    """Title and 8-bit sRGB image of each panel.

    width : pixels; the height is three quarters of it
    progress : told of the light between surfaces while it is traced
    """
    scenario = load_scenario(SCENE)
    plain = _plain(scenario.cameras[CAMERA], width)
    with Simulator(scenario, progress=progress) as simulator:
        for title, panel in panels(_colour_detector()).items():
            detector = replace(plain.detector, **panel.detector)
            camera = replace(
                plain,
                detector=replace(detector, fill_factor=panel.dimmed * detector.fill_factor),
                exposure_time=panel.light * plain.exposure_time,
            )
            yield title, _panel_image(simulator, camera, panel)


def _colour_detector() -> Detector:
    """That of a shipped preset with filters."""
    place = {"position_icrf_m": [7e6, 0.0, 0.0], "boresight": [1.0, 0.0, 0.0]}
    tables = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "camera": {"colour": {"preset": "imx264_colour", **place}},
    }
    return scenario_from_dict(tables).cameras["colour"].detector


def _plain(camera: Camera, width: int) -> Camera:
    """The scene's camera with as many pixels over the same field, and no faults."""
    d = camera.detector
    detector = replace(
        d,
        width=width,
        height=3 * width // 4,
        pixel_pitch=d.pixel_pitch * d.width / width,
        pattern=FixedPattern(),
        read_noise=0.0,
        dark_current_300k=0.0,
        row_time=0.0,
        # Larger pixels collect no more.
        fill_factor=(width / d.width) ** 2,
    )
    return replace(camera, detector=detector, exposure_time=0.25 * camera.exposure_time)


def _panel_image(simulator: Simulator, camera: Camera, panel: Panel) -> Image8:
    scenario = simulator.scenario
    at = _turning(scenario, camera) if panel.turns else None
    state = _seen_by(scenario.at(scenario.epoch_tai_ns), camera)
    frame = simulator.capture(state, CAMERA, {Product.DN}, at).digital
    assert frame is not None
    shown = camera
    if panel.raw:
        shown = replace(camera, detector=replace(camera.detector, mosaic=None))
    return display_from_dn(frame.dn, shown, panel.shown)


def _seen_by(state: SceneState, camera: Camera) -> SceneState:
    placed = replace(state.cameras[CAMERA], camera=camera)
    return replace(state, cameras={CAMERA: placed})


def _turning(scenario: Scenario, camera: Camera) -> Callable[[int], SceneState]:
    """The scene of the epoch, seen by a camera that turns."""
    still = _seen_by(scenario.at(scenario.epoch_tai_ns), camera)

    def at(tai_ns: int) -> SceneState:
        angle = TURN_RATE * (tai_ns - scenario.epoch_tai_ns) * 1e-9
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        seen = still.cameras[CAMERA]
        turned = replace(seen, R_camera_from_icrf=turn @ seen.R_camera_from_icrf)
        return replace(still, tai_ns=tai_ns, cameras={CAMERA: turned})

    return at
