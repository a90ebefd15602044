"""Plots of a camera test."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from simgl.assess.emva1288 import CameraReport
from simgl.figures.style import BLUE, GREEN, RED, SOFT, figure_style

_MEASURED: dict[str, Any] = {"marker": ".", "linestyle": "", "color": BLUE}
_FITTED: dict[str, Any] = {"color": RED, "linewidth": 1.0}


def plot_report(report: CameraReport, title: str, path: Path) -> None:
    """Six panels in one PNG: photon transfer, linearity, signal to noise, dark signal, patterns."""
    with figure_style():
        figure = Figure(figsize=(13.0, 7.5), layout="constrained")
        figure.suptitle(title)
        panels = figure.subplots(2, 3).ravel().tolist()
        for panel, draw in zip(
            panels,
            (_transfer, _linearity, _signal_to_noise, _dark_signal, _dark_pattern, _histograms),
            strict=True,
        ):
            draw(panel, report)
        figure.savefig(path, dpi=110)


def _transfer(panel: Axes, report: CameraReport) -> None:
    curve = report.curve
    panel.plot(curve.signal, curve.variance - curve.variance[0], **_MEASURED)
    end = curve.signal[curve.saturation]
    panel.plot([0.0, end], [0.0, curve.gain * end], label=f"K = {curve.gain:.5g} DN/e-", **_FITTED)
    panel.axvline(end, color=SOFT, linestyle=":", label="saturation")
    panel.set(title="Photon transfer", xlabel="signal [DN]", ylabel="temporal variance [DN²]")
    panel.legend()


def _linearity(panel: Axes, report: CameraReport) -> None:
    curve = report.curve
    photons = curve.photons[curve.linear_part]
    panel.plot(photons, 100.0 * curve.deviations, **_MEASURED)
    panel.axhline(0.0, **_FITTED)
    panel.axhspan(-0.05, 0.05, color=GREEN, alpha=0.15, label="±0.05 %")
    panel.set(
        title=f"Linearity, LE = {100.0 * curve.linearity_error:.4f} %",
        xlabel="photons per pixel, 500-600 nm",
        ylabel="deviation from the line [%]",
    )
    panel.legend()


def _signal_to_noise(panel: Axes, report: CameraReport) -> None:
    curve = report.curve
    lit = slice(1, curve.saturation)
    snr = curve.signal[lit] / np.sqrt(curve.variance[lit])
    panel.loglog(curve.photons[lit], snr, label="measured", **_MEASURED)
    photons = np.geomspace(1.0, curve.photons[curve.saturation], 100)
    electrons = curve.quantum_efficiency * photons
    noise = np.sqrt(curve.dark_noise**2 + 1.0 / (12.0 * curve.gain**2) + electrons)
    panel.loglog(photons, electrons / noise, label="from the parameters", **_FITTED)
    panel.axvline(curve.threshold, color=SOFT, linestyle=":", label="threshold")
    panel.set(
        title=f"DR {20.0 * np.log10(curve.dynamic_range):.1f} dB, "
        f"SNR max {20.0 * np.log10(curve.snr_max):.1f} dB",
        xlabel="photons per pixel, 500-600 nm",
        ylabel="signal / noise",
    )
    panel.legend()


def _dark_signal(panel: Axes, report: CameraReport) -> None:
    panel.plot(report.dark_times, report.dark_means, **_MEASURED)
    line = np.polyfit(report.dark_times, report.dark_means, 1)
    rate = line[0] / report.curve.gain
    panel.plot(
        report.dark_times,
        np.polyval(line, report.dark_times),
        label=f"{rate:.4g} e-/s at {report.camera.detector.temperature:.1f} K",
        **_FITTED,
    )
    panel.set(title="Dark current", xlabel="exposure time [s]", ylabel="mean in the dark [DN]")
    panel.legend()


def _dark_pattern(panel: Axes, report: CameraReport) -> None:
    part = report.dark.mean[:200, :300] / report.curve.gain
    middle, spread = np.median(part), max(float(np.std(part)), 1e-6)
    image = panel.imshow(
        part - middle, cmap="gray", vmin=-3.0 * spread, vmax=3.0 * spread, interpolation="nearest"
    )
    panel.figure.colorbar(image, ax=panel, label="e- from the median", shrink=0.7)
    panel.grid(False)
    panel.set(title="Mean of dark frames, a corner", xlabel="column", ylabel="row")


def _histograms(panel: Axes, report: CameraReport) -> None:
    signal = report.flat.mean - report.dark.mean
    edges = np.arange(-8.0, 8.5, 0.5)
    for name, values in (("dark", report.dark.mean), ("half of saturation", signal)):
        spread = float(values.std())
        if spread > 0.0:
            counts = np.histogram((values - values.mean()) / spread, bins=edges)[0]
            label = f"{name}, sigma {spread / report.curve.gain:.3g} e-"
            panel.stairs(counts, edges, label=label)
            bell = np.diff(stats.norm.cdf(edges)) * values.size
    panel.stairs(bell, edges, label="normal distribution", color=SOFT, linestyle=":")
    panel.set(
        title="Pixels' deviations after averaging",
        xlabel="deviation [sigma]",
        ylabel="pixels",
        yscale="log",
        ylim=(0.5, None),
    )
    panel.legend(loc="lower center")
