"""Band gap and dark current of silicon against worked numbers."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.camera.detector import band_gap, dark_current_ratio

# T [K], band gap [eV], dark current over that at 300 K, temperature step that doubles it [K].
TABLE = [
    (233.15, 1.127243, 9.616166e-4, 5.24),
    (243.15, 1.124978, 3.426783e-3, 5.68),
    (253.15, 1.122644, 1.108982e-2, 6.13),
    (263.15, 1.120241, 3.294812e-2, 6.61),
    (273.15, 1.117772, 9.070567e-2, 7.09),
    (283.15, 1.115237, 0.2332373, 7.60),
    (293.15, 1.112638, 0.5640448, 8.11),
    (298.15, 1.111315, 0.8588248, 8.38),
    (300.00, 1.110821, 1.0, 8.47),
    (303.15, 1.109976, 1.290570, 8.65),
    (313.15, 1.107253, 2.808478, 9.19),
    (323.15, 1.104470, 5.839465, 9.75),
    (333.15, 1.101628, 11.64771, 10.33),
    (343.15, 1.098729, 22.36781, 10.92),
    (353.15, 1.095773, 41.48564, 11.53),
]


@pytest.mark.parametrize(("temperature", "gap", "ratio", "doubling"), TABLE)
def test_dark_current_follows_its_table(
    temperature: float, gap: float, ratio: float, doubling: float
) -> None:
    # Seven printed digits.
    assert dark_current_ratio(temperature) == pytest.approx(ratio, rel=1e-6)
    assert band_gap(temperature) == pytest.approx(gap, abs=5e-7)
    # ln 2 over the logarithm's slope, to its printed digits.
    slope = np.log(dark_current_ratio(temperature + 0.05) / dark_current_ratio(temperature - 0.05))
    assert np.log(2.0) / (slope / 0.1) == pytest.approx(doubling, abs=0.006)


def test_the_sources_constant_makes_the_ratio_one_at_300_k() -> None:
    # Its b, with Boltzmann's constant as the source has it: 411915.8246 K^-1.5.
    exponent = np.exp(-band_gap(300.0) / (2.0 * 8.617333e-5 * 300.0))
    assert 411915.8246 * 300.0**1.5 * exponent == pytest.approx(1.0, rel=3e-6)
