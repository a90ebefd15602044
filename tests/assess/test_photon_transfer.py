"""Photon transfer: the analysis on frames of known statistics, and on the shipped cameras."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array, Image16
from simgl.assess.camera_plots import plot_report
from simgl.assess.emva1288 import camera_under_test, measure_camera
from simgl.assess.photon_transfer import (
    TransferCurve,
    pair_statistics,
    spatial_statistics,
)
from simgl.camera.detector import FixedPattern
from simgl.camera.presets import shipped_presets

GAIN, EFFICIENCY, NOISE, FULL = 0.34125, 0.6, 4.0, 12000.0


def ideal_curve() -> TransferCurve:
    """A camera of 12,000 e- at 0.34125 DN/e-, without noise in its statistics."""
    electrons = np.linspace(0.0, 13000.0, 105)
    collected = np.minimum(electrons, FULL)
    variance = GAIN**2 * (NOISE**2 + np.where(electrons < FULL, electrons, 0.0)) + 1.0 / 12.0
    return TransferCurve(
        photons=electrons / EFFICIENCY, mean=63.5 + GAIN * collected, variance=variance
    )


def test_a_transfer_curve_gives_back_its_camera() -> None:
    curve = ideal_curve()
    assert curve.gain == pytest.approx(GAIN, rel=1e-12)
    assert curve.quantum_efficiency == pytest.approx(EFFICIENCY, rel=1e-12)
    assert curve.dark_noise == pytest.approx(NOISE, rel=1e-12)
    # The last level below the full well: steps of 125 e-.
    assert FULL - 125.0 <= curve.saturation_capacity <= FULL
    assert curve.linearity_error < 1e-12
    dark = np.sqrt(GAIN**2 * NOISE**2 + 1.0 / 12.0) / GAIN
    assert curve.threshold == pytest.approx((dark + 0.5) / EFFICIENCY, rel=1e-12)


def test_the_worked_levels_of_a_12_bit_camera() -> None:
    """Signals and variances of 100, 1000 and 6000 e- by EMVA's model, no pedestal."""
    for electrons, signal, variance in (
        (100.0, 33.625, 13.5917),
        (1000.0, 340.75, 118.398),
        (6000.0, 2047.0, 700.656),
    ):
        assert GAIN * electrons - 0.5 == pytest.approx(signal, abs=1e-9)
        assert GAIN**2 * (NOISE**2 + electrons) + 1 / 12 == pytest.approx(variance, rel=1e-5)


def test_a_bend_shows_as_linearity_error() -> None:
    curve = ideal_curve()
    x = curve.photons / curve.photons[-1]
    bent = replace(curve, mean=curve.mean[0] + curve.signal * (1.0 + 0.02 * x))
    # 2 % of bend over the range; the line takes up most of it.
    assert 1e-4 < bent.linearity_error < 5e-3


def frames(draw: Callable[[np.random.Generator], Array], count: int) -> list[Image16]:
    rng = np.random.default_rng(1)
    return [np.round(draw(rng)).astype(np.uint16) for _ in range(count)]


def test_a_pair_of_frames_loses_what_both_have() -> None:
    pattern = np.random.default_rng(2).normal(0.0, 50.0, (400, 400))
    a, b = frames(lambda rng: 1000.0 + pattern + rng.normal(0.0, 5.0, (400, 400)), 2)
    mean, variance = pair_statistics(a, b)
    # 160,000 pixels: five standard errors.
    assert mean == pytest.approx(a.mean(), abs=0.1)
    assert variance == pytest.approx(25.0 + 1.0 / 12.0, rel=5.0 * np.sqrt(2.0 / 160_000))


def test_spatial_variance_splits_into_rows_columns_and_pixels() -> None:
    rng = np.random.default_rng(3)
    rows = rng.normal(0.0, 3.0, (1000, 1))
    columns = rng.normal(0.0, 4.0, (1, 1000))
    pixels = rng.normal(0.0, 5.0, (1000, 1000))
    pattern = 1000.0 + rows + columns + pixels
    found = spatial_statistics(frames(lambda r: pattern + r.normal(0.0, 8.0, pattern.shape), 8))
    # What these draws hold, not what they were drawn from; rounding adds 1/12 in eight frames.
    assert found.rows == pytest.approx(rows.var(), rel=0.01)
    assert found.columns == pytest.approx(columns.var(), rel=0.01)
    assert found.pixels == pytest.approx(pixels.var(), rel=0.01)
    assert found.variance == pytest.approx(pattern.var(), rel=0.01)


@pytest.mark.parametrize("preset", shipped_presets())
def test_every_shipped_camera_gives_back_what_its_preset_says(
    gl: moderngl.Context, preset: str
) -> None:
    """Gain 0.5 %, noise 1.5 %, DSNU, PRNU and dark current 2 %, linearity 0.05 %, QE 0.5 %."""
    camera = camera_under_test(preset, (512, 480))
    report = measure_camera(gl, camera, levels=28, repeats=8)
    wrong = [f"{f.name}: {f.recovered} for {f.configured}" for f in report.findings if not f.passed]
    assert not wrong
    assert {"gain K", "dark noise", "dark current", "DSNU", "PRNU", "linearity error"} <= {
        f.name for f in report.findings
    }


@pytest.mark.parametrize("seed", [1, 2])
def test_a_camera_without_fixed_pattern_passes(gl: moderngl.Context, seed: int) -> None:
    """No DSNU and no PRNU are recovered as well as the frames' noise allows, within 4 sigma."""
    camera = camera_under_test("mt9m034", (128, 128))
    without = replace(camera.detector, pattern=FixedPattern(), serial=seed)
    report = measure_camera(gl, replace(camera, detector=without), levels=20, repeats=4)
    for finding in report.findings:
        if finding.name in ("DSNU", "PRNU"):
            assert finding.configured == 0.0
            assert finding.passed, finding
            # Read noise of 4 e- in four frames: sqrt(4 * 4^2 / 4 * sqrt(2 / 128^2)) e-.
            assert finding.unit != "e-" or 0.3 < finding.allowed < 0.6


def test_a_camera_that_is_not_as_configured_fails(gl: moderngl.Context, tmp_path: Path) -> None:
    """The laboratory measures what the passes do: 3 % of PRNU do not pass for 1 %."""
    camera = camera_under_test("mt9m034", (256, 256))
    wrong = replace(camera.detector, pattern=FixedPattern(prnu=0.03, dsnu=2.0))
    report = measure_camera(gl, replace(camera, detector=wrong), levels=20, repeats=4)
    (prnu,) = [f for f in report.findings if f.name == "PRNU"]
    assert prnu.recovered == pytest.approx(3.0, rel=0.03)
    assert not replace(prnu, configured=1.0, allowed=0.02).passed
    plot_report(report, "camera", tmp_path / "plots.png")
    assert (tmp_path / "plots.png").stat().st_size > 20_000
