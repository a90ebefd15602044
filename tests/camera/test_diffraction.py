"""Diffraction of a circular pupil against numbers computed elsewhere in float64."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.camera.diffraction import airy_tail, defocus_otf, diffraction_mtf

# Modulation at a share of the cut-off.
MTF = {
    0.05: 0.936364559,
    0.10: 0.872888572,
    0.20: 0.747060078,
    0.25: 0.685037642,
    0.30: 0.623837665,
    0.40: 0.504631575,
    0.50: 0.391002219,
    0.60: 0.284756980,
    0.70: 0.188120404,
    0.75: 0.144293613,
    0.80: 0.104088039,
    0.90: 0.037386073,
    0.95: 0.013320011,
    1.00: 0.0,
}

# f/4: wavelength [nm], cut-off and modulation at 20, 50, 100, 133.33, 200, 266.67 cycles/mm.
F4 = {
    450: (555.556, 0.954173, 0.885563, 0.772061, 0.697382, 0.551736, 0.413200),
    500: (500.0, 0.949084, 0.872889, 0.747060, 0.664538, 0.504632, 0.354668),
    550: (454.545, 0.943996, 0.860227, 0.722164, 0.631944, 0.458416, 0.298422),
    600: (416.667, 0.938908, 0.847579, 0.697382, 0.599628, 0.413200, 0.244805),
    650: (384.615, 0.933821, 0.834946, 0.672726, 0.567618, 0.369099, 0.194210),
}
FREQUENCIES = np.array([20.0, 50.0, 100.0, 400.0 / 3.0, 200.0, 800.0 / 3.0])  # [cycles/mm]


@pytest.mark.parametrize(("share", "expected"), MTF.items())
def test_modulation_at_a_share_of_the_cut_off(share: float, expected: float) -> None:
    # The table has nine digits.
    assert diffraction_mtf(np.array(share)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("nanometres", F4)
def test_modulation_at_f4(nanometres: int) -> None:
    cut_off = 1e6 / (nanometres * 4.0)
    expected = F4[nanometres]
    assert cut_off == pytest.approx(expected[0], abs=5e-4)
    # Six digits are given.
    np.testing.assert_allclose(diffraction_mtf(FREQUENCIES / cut_off), expected[1:], atol=1e-6)


def test_system_modulation_at_nyquist() -> None:
    """Pixel of 3.75 um and lens of f/4 at 550 nm."""
    cycles_per_pixel = 0.5
    lens = diffraction_mtf(np.array(cycles_per_pixel / 3.75e-6 * 550e-9 * 4.0))
    assert lens * np.sinc(cycles_per_pixel) == pytest.approx(0.402308, abs=1e-6)


def test_a_lens_in_focus_has_the_transfer_of_diffraction() -> None:
    share = np.linspace(0.0, 1.0, 21)
    # The quadrature, with so little defocus that it does not show.
    np.testing.assert_allclose(defocus_otf(share, 1e-9), diffraction_mtf(share), atol=1e-6)


def test_defocus_of_many_waves_is_a_disc() -> None:
    """A disc of diameter D has the transfer 2 J1(pi D f) / (pi D f); first zero at D f = 1.2197."""
    waves = 20.0
    # Blur circle over wavelength times f-number: 8 N^2 lambda waves / N / (lambda N) = 8 waves.
    zero = 1.2197 / (8.0 * waves)
    share = np.array([0.9, 1.0, 1.1]) * zero
    below, at, above = defocus_otf(share, waves)
    # Geometric optics is the limit; at 20 waves its zero is off by 2 % of the transfer's slope.
    assert below > 0.02
    assert abs(at) < 0.01
    assert above < -0.02


def test_tail_of_a_point() -> None:
    # 550 nm, f/4, 3.75 um; four digits are given.
    assert airy_tail(550e-9, 4.0, 3.75e-6) == pytest.approx(0.0189, abs=5e-5)
