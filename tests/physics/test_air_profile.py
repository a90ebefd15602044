"""Vertical profiles of the air: against the published standard, integration and their columns."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from simgl.physics.air_profile import (
    AIR_TOP,
    MIDLATITUDE_OZONE,
    STRATOSPHERIC_AEROSOL,
    Exponential,
    Profile,
    UsStandard1976,
    column,
)
from simgl.physics.atmosphere import (
    SOURCE,
    STANDARD,
    Atmosphere,
    densities,
    optical_depth_to_space,
)
from tests.authorities.us_standard_1976 import DENSITIES, density_by_integration

AIR = UsStandard1976()


@pytest.mark.parametrize(("height_km", "density"), DENSITIES)
def test_the_air_is_as_dense_as_the_standard_says(height_km: float, density: float) -> None:
    # Four digits are printed.
    assert AIR.density(np.array(1e3 * height_km)) == pytest.approx(density, rel=2e-4)


def test_between_the_printed_heights_the_air_is_in_hydrostatic_balance() -> None:
    heights = np.linspace(0.0, 85e3, 60)
    # The integration's step, 10 m, leaves 1e-6.
    np.testing.assert_allclose(AIR.density(heights), density_by_integration(heights), rtol=1e-5)


def test_the_table_above_86_km_joins_the_layers_below() -> None:
    below, above = AIR.density(np.array([86e3 - 1.0, 86e3 + 1.0]))
    # Two metres of air, and four digits.
    assert above / below == pytest.approx(1.0, abs=2.0 / 5.6e3 + 2e-4)


def test_the_rayleigh_scattering_is_that_of_the_standards_density() -> None:
    heights = 1e3 * np.array([10.0, 20.0, 30.0, 40.0, 50.0])
    ground = densities(STANDARD, np.array(0.0))[0]
    expected = [density / 1.225 for km, density in DENSITIES if 1e3 * km in heights]
    np.testing.assert_allclose(densities(STANDARD, heights)[:, 0] / ground, expected, rtol=5e-4)


@pytest.mark.parametrize(
    "profile", [AIR, MIDLATITUDE_OZONE, STRATOSPHERIC_AEROSOL, Exponential(1.2e3)]
)
def test_a_column_is_the_integral_of_its_density(profile: Profile) -> None:
    def density(height: float) -> float:
        return float(profile.density(np.array(height)))

    edges = np.linspace(0.0, AIR_TOP, 121)
    pieces = [quad(density, a, b)[0] for a, b in pairwise(edges)]
    # The table's places near the kinks, 200 m apart at most.
    assert column(profile) == pytest.approx(np.sum(pieces), rel=2e-4)


@pytest.mark.parametrize("air", [STANDARD, SOURCE], ids=lambda a: a.name)
def test_a_vertical_ray_has_the_vertical_depths(air: Atmosphere) -> None:
    depth = optical_depth_to_space(air, 6.371e6, 0.0, np.ones(1))[0]
    expected = np.array(air.rayleigh) + np.array(air.aerosol) + np.array(air.ozone)
    # 160 nodes pass over the profiles' kinks: 1e-3 of the stratospheric aerosol and the ozone.
    np.testing.assert_allclose(depth, expected, atol=4e-5)


def test_the_stratosphere_holds_its_background_aerosol() -> None:
    nothing = (0.0, 0.0, 0.0, 0.0)
    aerosol = replace(STANDARD, rayleigh=nothing, ozone=nothing)
    green = optical_depth_to_space(aerosol, 6.371e6, 10e3, np.ones(1))[0, 1]
    # The troposphere leaves exp(-10 / 1.2) of 0.075 above 10 km, 2e-5.
    assert green == pytest.approx(0.005, abs=5e-5)


def test_ozone_is_densest_at_22_km() -> None:
    heights = np.arange(0.0, 60e3, 100.0)
    density = densities(STANDARD, heights)[:, 2]
    assert heights[np.argmax(density)] == pytest.approx(22e3, abs=200.0)
    # The standard's column in Dobson units [2.687e20 m-2]: 345 by Krueger and Minzner (1976).
    assert column(MIDLATITUDE_OZONE) * 1e17 / 2.687e20 == pytest.approx(345.0, rel=0.01)
