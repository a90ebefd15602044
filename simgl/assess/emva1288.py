"""A camera test by EMVA 1288: flat fields and dark frames through the detector's passes.

Configured parameters are compared with those that photon transfer recovers, as a laboratory without
data sheet would measure them. Uniform light falls on the image plane, without optics or scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import moderngl
import numpy as np
from rich.table import Table

from simgl.arrays import Array, Image16
from simgl.assess.exposure_advice import full_electrons
from simgl.assess.photon_transfer import (
    SpatialStatistics,
    TransferCurve,
    pair_statistics,
    slope,
    spatial_statistics,
)
from simgl.camera.camera import Camera
from simgl.camera.presets import read_camera
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.physics.constants import SOLAR_TEMPERATURE
from simgl.physics.spectrum import BANDS, black_body_light
from simgl.progress import ProgressCallback, silent
from simgl.rendering.camera_pipeline import CameraPipeline
from simgl.scenario.schema import CameraTable

# Of a larger sensor, a part is tested; width and height [pixels].
LARGEST = (1280, 960)
# Of the flat fields [s]; short enough to make their dark current negligible.
_EXPOSURE = 1e-3
# Light of the last flat field over the full well: it saturates the sensor.
_BRIGHTEST = 1.12
# Number of levels of light between dark and the first of the evenly spaced ones.
_FAINT = 8
# Photons of the flat fields and dark frames, R, G, B and N.
_GREEN = np.array([0.0, 1.0, 0.0, 0.0])
# Electrons that the longest dark exposure collects on average.
_DARK_ELECTRONS = 200.0


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One quantity as configured and as recovered.

    allowed : largest difference that passes
    """

    name: str
    unit: str
    configured: float
    recovered: float
    allowed: float

    @property
    def difference(self) -> float:
        """Recovered minus configured."""
        return self.recovered - self.configured

    @property
    def passed(self) -> bool:
        """Whether the difference is within the allowed one."""
        return abs(self.difference) <= self.allowed


@dataclass(frozen=True, kw_only=True, eq=False)
class CameraReport:
    """Results of a camera test.

    dark, flat : averages of dark frames and of frames at half of saturation
    dark_times, dark_means : exposure times [s] and mean dark signals [DN]
    """

    camera: Camera
    renderer: str
    curve: TransferCurve
    dark: SpatialStatistics
    flat: SpatialStatistics
    dark_times: Array
    dark_means: Array
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether every quantity was recovered."""
        return all(finding.passed for finding in self.findings)


def camera_under_test(preset: str, largest: tuple[int, int] = LARGEST) -> Camera:
    """A preset's camera, cropped and shielded from particles.

    preset : name of a shipped preset, or a file
    largest : width and height that the sensor is cropped to [px]

    Raises AssetError for an unknown preset, ConfigError for a file with impossible values.
    """
    table = CameraTable(preset=preset, exposure_time_s=_EXPOSURE)
    camera = read_camera("command line", "camera", table, SOLAR_TEMPERATURE, Path())
    d = camera.detector
    width, height = (min(a, b) for a, b in zip((d.width, d.height), largest, strict=True))
    return replace(camera, detector=replace(d, width=width, height=height, particles=None))


class _TestBench:
    """Uniform light on a camera; the noise differs from frame to frame."""

    def __init__(self, ctx: moderngl.Context, camera: Camera, seed: int) -> None:
        self.camera = camera
        self._ctx = ctx
        self._seed = seed
        self._frames = 0
        self._photons = black_body_light(1.0, SOLAR_TEMPERATURE).photons_per_joule
        self._camera_pipeline = CameraPipeline(ctx)
        d = camera.detector
        self._light = ImageTarget(ctx, (d.width, d.height), [Format("f4", 4)])
        # One colour at a time: the first green pixel of each square, or every pixel.
        self.place = (0, 0) if d.mosaic is None else divmod(d.mosaic.order.index("G"), 2)[::-1]

    def frame(self, photons: Array, exposure_time: float = _EXPOSURE) -> Image16:
        """DN of every pixel; photons (4,) per pixel and band during the exposure."""
        camera = replace(self.camera, exposure_time=exposure_time)
        area = camera.detector.pixel_pitch**2
        irradiance = photons / (self._photons * area * exposure_time)
        red, green, blue, infrared = irradiance.tolist()
        area_px = (0, 0, *self._light.size)
        self._light.framebuffer.clear(red, green, blue, infrared, viewport=area_px)
        self._frames += 1
        electrons = self._camera_pipeline.electrons(camera, self._photons, self._light)
        frame: Image16 = self._camera_pipeline.digital(
            camera, self._frames, self._seed, electrons
        ).read()
        return frame

    def one_colour(self, frame: Image16, place: tuple[int, int] | None = None) -> Image16:
        """The pixels of one colour; place (column, row) in the square of filters."""
        column, row = self.place if place is None else place
        return frame if self.camera.detector.mosaic is None else frame[row::2, column::2]

    def frames(self, count: int, photons: Array) -> Iterator[Image16]:
        """Several frames of one colour."""
        for _ in range(count):
            yield self.one_colour(self.frame(photons))

    def release(self) -> None:
        """Free everything."""
        release_all(self._ctx, self._light, self._camera_pipeline)


def measure_camera(
    ctx: moderngl.Context,
    camera: Camera,
    *,
    levels: int = 58,
    repeats: int = 16,
    seed: int = 1,
    progress: ProgressCallback = silent,
) -> CameraReport:
    """Photon-transfer test of a camera.

    ctx : OpenGL context to draw in, from ``open_context``
    camera : to be measured, for instance from ``camera_under_test``
    levels : number of light levels, with a pair of frames each
    repeats : frames averaged for each fixed pattern
    seed : of the noise
    progress : called with the number of finished steps and of all steps
    """
    done, steps = 0, levels + 4

    def step() -> None:
        nonlocal done
        done += 1
        progress(done, steps)

    test_bench = _TestBench(ctx, camera, seed)
    try:
        curve = _transfer_curve(test_bench, levels, step)
        dark = spatial_statistics(test_bench.frames(repeats, 0.0 * _GREEN))
        step()
        half = 0.5 * curve.photons[curve.saturation]
        flat = spatial_statistics(test_bench.frames(repeats, half * _GREEN))
        step()
        times = _EXPOSURE + np.linspace(0.0, _longest(camera), 6)
        means = [test_bench.one_colour(test_bench.frame(0.0 * _GREEN, t)).mean() for t in times]
        step()
        efficiencies = list(_efficiencies(test_bench, curve))
        step()
    finally:
        test_bench.release()
    findings = (*_findings(camera, curve, dark, flat, slope(times.tolist(), means)), *efficiencies)
    return CameraReport(
        camera=camera,
        renderer=ctx.info["GL_RENDERER"],
        curve=curve,
        dark=dark,
        flat=flat,
        dark_times=times,
        dark_means=np.array(means),
        findings=findings,
    )


def _transfer_curve(test_bench: _TestBench, levels: int, step: Callable[[], None]) -> TransferCurve:
    """Pairs of flat fields from the dark to saturation."""
    camera = test_bench.camera
    full = full_electrons(camera) / _efficiency(camera, test_bench.place)[1]
    # A few faint levels show where dark noise dominates.
    faint = full * np.geomspace(1e-4, 0.02, _FAINT)
    even = np.linspace(0.0, _BRIGHTEST * full, levels - _FAINT)
    photons = np.sort(np.concatenate([faint, even]))
    points = []
    for level in photons.tolist():
        points.append(pair_statistics(*test_bench.frames(2, level * _GREEN)))
        step()
    mean, variance = np.array(points).T
    return TransferCurve(photons=photons, mean=mean, variance=variance)


def _efficiency(camera: Camera, place: tuple[int, int]) -> Array:
    """(4,) electrons per photon on the pixel area, at a place (column, row) of the mosaic."""
    d = camera.detector
    return d.fill_factor * np.array(d.square[place[0] + 2 * place[1]])


def _longest(camera: Camera) -> float:
    """Longest exposure of the dark frames [s]."""
    current = _mean_dark_current(camera)
    return _DARK_ELECTRONS / current if current > 0.0 else 1.0


def _mean_dark_current(camera: Camera) -> float:
    d = camera.detector
    return d.dark_current + d.pattern.hot_pixels * d.hot_current


def _efficiencies(test_bench: _TestBench, curve: TransferCurve) -> Iterator[Finding]:
    """Of each colour in each band, at half of saturation."""
    camera = test_bench.camera
    mosaic = camera.detector.mosaic
    letters = "-" if mosaic is None else "RGB"
    for letter in letters:
        index = 0 if mosaic is None else mosaic.order.index(letter)
        place = (index % 2, index // 2)
        expected = _efficiency(camera, place)
        for band, name in enumerate(BANDS.names):
            if expected[band] == 0.0:
                continue
            photons = np.zeros(4)
            photons[band] = 0.5 * full_electrons(camera) / expected.max()
            frame = test_bench.one_colour(test_bench.frame(photons), place)
            recovered = (frame.mean() - curve.mean[0]) / curve.gain / photons[band]
            low, high = (round(1e9 * edge) for edge in BANDS.edges[band])
            pixel = "" if mosaic is None else f" of {letter} pixels"
            yield Finding(
                name=f"QE{pixel}, {name} {low}-{high} nm",
                unit="e-/photon",
                configured=float(expected[band]),
                recovered=float(recovered),
                # 0.5 % of the gain, and half a DN for the mean of the dark frames.
                allowed=0.005 * float(expected[band]) + 0.5 / curve.gain / photons[band],
            )


def _resolved(rms: float, standard_error: float) -> float:
    """Smallest difference of an rms that four standard errors of its square make sure of."""
    return float(np.sqrt(rms**2 + 4.0 * standard_error)) - rms


def _findings(
    camera: Camera,
    curve: TransferCurve,
    dark: SpatialStatistics,
    flat: SpatialStatistics,
    dark_rate: float,
) -> Iterator[Finding]:
    d, p, gain = camera.detector, camera.detector.pattern, curve.gain

    def finding(
        name: str,
        unit: str,
        configured: float,
        recovered: float,
        share: float,
        minimum: float = 0.0,
    ) -> Finding:
        allowed = max(share * configured, minimum)
        return Finding(
            name=name, unit=unit, configured=configured, recovered=recovered, allowed=allowed
        )

    dark_mean = _mean_dark_current(camera) * _EXPOSURE
    noise = float(np.sqrt(d.read_noise**2 + d.row_noise**2 + dark_mean))
    hot = np.sqrt(2.0 * p.hot_pixels - p.hot_pixels**2) * d.hot_current * _EXPOSURE
    dsnu = float(np.sqrt(p.dsnu**2 + p.rows**2 + p.columns**2 + hot**2))
    response = float(np.sqrt(max(flat.variance - dark.variance, 0.0)))
    prnu = response / (flat.mean.mean() - dark.mean.mean())
    dead = np.sqrt((p.dead_pixels * (1.0 - p.dead_pixels)) + (1.0 - p.dead_pixels) * p.prnu**2)
    yield finding("gain K", "DN/e-", d.gain_dn_per_e, gain, 0.005)
    yield finding("dark noise", "e-", noise, curve.dark_noise, 0.015)
    yield finding("dark current", "e-/s", _mean_dark_current(camera), dark_rate / gain, 0.02)
    minimum = _resolved(dsnu, dark.standard_error / gain**2)
    yield finding("DSNU", "e-", dsnu, float(np.sqrt(dark.variance)) / gain, 0.02, minimum)
    for name, rms, part, count in (
        ("  of rows", p.rows, dark.rows, len(dark.mean)),
        ("  of columns", p.columns, dark.columns, len(dark.mean[0])),
    ):
        if rms > 0.0:
            # Four standard errors of an rms over that number.
            share = 4.0 / np.sqrt(2.0 * count)
            yield finding(name, "e-", rms, float(np.sqrt(part)) / gain, share)
    expected = float(dead / (1.0 - p.dead_pixels))
    error = (flat.standard_error + dark.standard_error) / (flat.mean.mean() - dark.mean.mean()) ** 2
    minimum = max(0.01, 100.0 * _resolved(expected, error))
    yield finding("PRNU", "%", 100.0 * expected, 100.0 * prnu, 0.02, minimum)
    yield finding("linearity error", "%", 0.0, 100.0 * curve.linearity_error, 0.0, 0.05)
    full = full_electrons(camera)
    # Noise clips a few standard deviations below the full well, which is located to one level.
    largest_step = float(np.diff(curve.photons).max() / curve.photons[-1]) * _BRIGHTEST
    share = 4.0 / np.sqrt(full) + largest_step
    yield finding("saturation capacity", "e-", full, curve.saturation_capacity, share)


def report_document(report: CameraReport, name: str) -> dict[str, object]:
    """The report as ``simgl camera test --json`` prints it."""
    detector, curve = report.camera.detector, report.curve
    return {
        "camera": name,
        "renderer": report.renderer,
        "passed": report.passed,
        "width_px": detector.width,
        "height_px": detector.height,
        "quantities": [
            {
                "name": finding.name.strip(),
                "unit": finding.unit,
                "configured": finding.configured,
                "recovered": finding.recovered,
                "allowed_difference": finding.allowed,
                "passed": bool(finding.passed),
            }
            for finding in report.findings
        ],
        "absolute_threshold_photons": float(curve.threshold),
        "dynamic_range_db": float(20.0 * np.log10(curve.dynamic_range)),
        "max_snr_db": float(20.0 * np.log10(curve.snr_max)),
    }


def table(report: CameraReport, name: str) -> Table:
    """Configured and recovered quantities, for a terminal."""
    d = report.camera.detector
    title = f"{name}, {d.width} x {d.height} pixels, serial {d.serial}\n{report.renderer}"
    # Without lines it fits 80 columns.
    rows = Table(title=title, box=None, padding=(0, 2, 0, 0), pad_edge=False)
    rows.add_column("", no_wrap=True)
    rows.add_column("unit", no_wrap=True)
    for column in ("configured", "recovered", "difference", "allowed"):
        rows.add_column(column, justify="right", no_wrap=True)
    for f in report.findings:
        rows.add_row(
            f.name,
            f.unit,
            f"{f.configured:.5g}",
            f"{f.recovered:.5g}",
            f"{f.difference:+.2g}",
            f"{f.allowed:.2g}",
            style=None if f.passed else "red",
        )
    curve = report.curve
    rows.add_row()
    for label, unit, value in (
        ("absolute threshold", "photons", curve.threshold),
        ("dynamic range", "dB", 20.0 * np.log10(curve.dynamic_range)),
        ("largest signal / noise", "dB", 20.0 * np.log10(curve.snr_max)),
    ):
        rows.add_row(label, unit, "", f"{value:.4g}", "", "")
    return rows
