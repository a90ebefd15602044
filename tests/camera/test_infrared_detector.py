"""Thermal detectors: NETD, response, smear, diffraction, drift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simgl.camera.infrared_detector import (
    diffracted,
    infrared_detectors,
    lagged,
    load_infrared_detector,
    measured_netd,
)
from simgl.errors import AssetError


def test_the_bolometers_netd_is_that_of_its_data_sheet() -> None:
    detector = load_infrared_detector("bolometer_lwir")
    # 16,384 pixels give a standard deviation to 0.55 %; DN of 19 mK add 1 % to 40 mK.
    assert measured_netd(detector) == pytest.approx(0.040, rel=0.035)


def test_the_photon_detectors_netd_is_shot_and_read_noise() -> None:
    detector = load_infrared_detector("insb_mwir")
    at_300 = np.array(300.0)
    mean = float(detector.signal(detector.emission(at_300)))
    noise = np.sqrt(mean + detector.table.read_noise_e**2 + detector.electrons_per_dn**2 / 12.0)
    expected = noise / detector.response(300.0)
    assert measured_netd(detector) == pytest.approx(expected, rel=0.03)


def test_netd_of_a_cooled_detector_falls_with_temperature_as_signals_rise() -> None:
    detector = load_infrared_detector("insb_mwir")
    assert measured_netd(detector, 330.0) < measured_netd(detector, 280.0)


@pytest.mark.parametrize("name", sorted(infrared_detectors()))
def test_a_wider_scene_fits_its_dn(name: str) -> None:
    detector = load_infrared_detector(name)
    radiance = detector.emission(np.linspace(220.0, 350.0, 64).reshape(8, 8))
    dn = detector.digitised(radiance, (1,), 2)
    assert 0 < dn.min() < dn.max() < detector.levels - 1


def test_a_bolometer_lags_by_its_time_constant() -> None:
    detector = load_infrared_detector("bolometer_lwir")
    before, after = np.zeros((2, 2)), np.ones((2, 2))
    tau = 1e-3 * detector.table.time_constant_ms
    held = lagged(before, after, tau, detector)
    np.testing.assert_allclose(held, 1.0 - np.exp(-1.0), rtol=1e-12)
    # Steps add up: two halves are one.
    twice = lagged(lagged(before, after, 0.5 * tau, detector), after, 0.5 * tau, detector)
    np.testing.assert_allclose(twice, held, rtol=1e-12)
    cooled = load_infrared_detector("insb_mwir")
    np.testing.assert_array_equal(lagged(before, after, 1e-6, cooled), after)


def test_diffraction_keeps_the_light_and_has_the_mtf_of_a_pupil() -> None:
    detector = load_infrared_detector("bolometer_lwir")
    n, cycles = 64, 8
    wave = 1.0 + 0.5 * np.cos(2.0 * np.pi * cycles * (np.arange(n) + 0.5) / n) * np.ones((n, 1))
    seen = diffracted(wave, detector)
    assert seen.mean() == pytest.approx(wave.mean(), rel=1e-12)
    # 1 / 8 cycle per pixel of 12 um at f/1 and 10.5 um: 0.109 of the cut-off.
    r = cycles / n / 12e-6 * 10.5e-6
    expected = 2.0 / np.pi * (np.arccos(r) - r * np.sqrt(1.0 - r * r))
    assert np.ptp(seen) / np.ptp(wave) == pytest.approx(expected, rel=2e-3)


def test_the_shutter_takes_off_the_drift() -> None:
    detector = load_infrared_detector("bolometer_lwir")
    flat = np.full((128, 128), float(detector.emission(np.array(300.0))))
    fresh = detector.digitised(flat, (1,), 5).astype(np.float64)
    later = replace(detector, minutes_since_shutter=4.0)
    drifted = later.digitised(flat, (1,), 5).astype(np.float64)
    # 0.05 K per root minute: 0.1 K after four; 16,384 pixels give it to 0.6 %.
    walk = float((drifted - fresh).std()) / detector.response(300.0)
    assert walk == pytest.approx(0.1, rel=0.03)
    # The fixed pattern stays, noise does not.
    other = detector.digitised(flat, (1,), 6).astype(np.float64)
    assert np.corrcoef(fresh.ravel(), other.ravel())[0, 1] > 0.15


def test_an_unknown_detector_gets_a_suggestion() -> None:
    with pytest.raises(AssetError, match='did you mean "bolometer_lwir"'):
        load_infrared_detector("bolometer_lwr")
