"""A thermal detector measured as on a test bench: NETD, response, MTF, time constant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table

from simgl.arrays import Array
from simgl.camera.diffraction import diffraction_mtf
from simgl.camera.infrared_detector import (
    NETD_TEMPERATURE,
    InfraredDetector,
    lagged,
    measured_netd,
)

# Black bodies at which NETD is measured [K].
_BLACK_BODIES = (280.0, NETD_TEMPERATURE, 320.0)
# Spatial frequency of the bar target [cycles per pixel].
_FREQUENCY = 0.25


@dataclass(frozen=True)
class InfraredResult:
    """A quantity as its preset says and as it is measured.

    tolerance : largest difference, as a share of what the preset says
    """

    quantity: str
    unit: str
    expected: float
    measured: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether they agree."""
        return abs(self.measured - self.expected) <= self.tolerance * abs(self.expected)


def examine_infrared(detector: InfraredDetector) -> list[InfraredResult]:
    """What frames of black bodies and of a bar target give, in DN only."""
    results = []
    per_dn = detector.electrons_per_dn if detector.table.kind == "photon" else 1.0
    for kelvin in _BLACK_BODIES:
        signal = detector.signal(detector.emission(np.array([kelvin])))
        # Quantisation adds a twelfth of a squared DN.
        noise = float(np.sqrt(detector.noise(signal)[0] ** 2 + per_dn**2 / 12.0))
        expected = 1e3 * noise / detector.response(kelvin)
        # 16,384 pixels of two frames: 0.55 %, 5 sigma, and the curvature of Planck over 4 K.
        measured = 1e3 * measured_netd(detector, kelvin)
        results.append(InfraredResult(f"NETD at {kelvin:g} K", "mK", expected, measured, 0.035))
    rise = detector.response(NETD_TEMPERATURE) / per_dn
    results.append(InfraredResult("response at 300 K", "DN/K", rise, _rise(detector), 0.01))
    results.append(_bar_target(detector))
    if detector.table.time_constant_ms > 0.0:
        results.append(_step_response(detector))
    return results


def _flat(detector: InfraredDetector, kelvin: float, number: int) -> Array:
    radiance = np.full((128, 128), float(detector.emission(np.array(kelvin))))
    return detector.digitised(radiance, (1,), number).astype(np.float64)


def _rise(detector: InfraredDetector) -> float:
    frames = [_flat(detector, NETD_TEMPERATURE + step, 9 + i) for i, step in enumerate((-1.0, 1.0))]
    return 0.5 * float(frames[1].mean() - frames[0].mean())


def _bar_target(detector: InfraredDetector) -> InfraredResult:
    """MTF at half the Nyquist frequency, from a sine target of 20 K."""
    low, high = detector.emission(np.array([NETD_TEMPERATURE - 10.0, NETD_TEMPERATURE + 10.0]))
    phase = 2.0 * np.pi * _FREQUENCY * (np.arange(128) + 0.5)
    target = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(phase) * np.ones((128, 1))
    dn = detector.digitised(target, (1,), 20).astype(np.float64)
    ends = detector.signal(np.array([low, high]))
    per_dn = detector.electrons_per_dn if detector.table.kind == "photon" else 1.0
    amplitude = 2.0 * float(np.mean((dn - dn.mean()) * np.cos(phase)))
    measured = amplitude / (0.5 * float(ends[1] - ends[0]) / per_dn)
    wavelengths = np.linspace(*detector.band, 5)
    cut_off = 1e-6 * detector.table.pixel_pitch_um / (wavelengths * detector.table.f_number)
    expected = float(diffraction_mtf(_FREQUENCY / cut_off).mean())
    return InfraredResult("optics MTF at Nyquist / 2", "", expected, measured, 0.01)


def _step_response(detector: InfraredDetector) -> InfraredResult:
    """The time constant from how much of a step is left after 5 ms."""
    seconds = 5e-3
    ends = detector.emission(np.array([NETD_TEMPERATURE, NETD_TEMPERATURE + 50.0]))
    before, after = (np.full((128, 128), float(value)) for value in ends)
    frames = [before, lagged(before, after, seconds, detector), after]
    cold, held, warm = (detector.digitised(f, (1,), 30 + i).mean() for i, f in enumerate(frames))
    measured = -1e3 * seconds / float(np.log((warm - held) / (warm - cold)))
    expected = detector.table.time_constant_ms
    return InfraredResult("time constant", "ms", expected, measured, 0.01)


def infrared_table(detector: InfraredDetector, results: list[InfraredResult]) -> Table:
    """The results for a terminal."""
    shown = Table(title=f"{detector.name}, {detector.table.kind} detector")
    for column in ("quantity", "preset", "measured", "unit", ""):
        shown.add_column(column)
    for r in results:
        verdict = "[green]ok[/]" if r.passed else "[red]off[/]"
        shown.add_row(r.quantity, f"{r.expected:.4g}", f"{r.measured:.4g}", r.unit, verdict)
    return shown


def infrared_document(
    detector: InfraredDetector, results: list[InfraredResult]
) -> Mapping[str, Any]:
    """The results as one JSON document."""
    return {
        "detector": detector.name,
        "kind": detector.table.kind,
        "results": [
            {
                "quantity": r.quantity,
                "unit": r.unit,
                "expected": r.expected,
                "measured": r.measured,
                "tolerance": r.tolerance,
                "passed": r.passed,
            }
            for r in results
        ],
    }
