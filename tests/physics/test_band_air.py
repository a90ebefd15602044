"""The air in bands of a scenario, against published numbers and integrals over wavelength."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.physics.atmosphere import STANDARD, band_transmittance, optical_depth_to_space
from simgl.physics.band_air import air_in_bands, rayleigh_depth
from simgl.physics.eclipse import sunlit_transmission
from simgl.physics.spectrum import BANDS, Bands
from tests.reference.gas_lines import GASES, gas_transmittance

RADIUS = 6371e3


def _bands(*edges_nm: tuple[float, float]) -> Bands:
    names = tuple("abcd"[: len(edges_nm)])
    return Bands(names=names, edges=tuple((low * 1e-9, high * 1e-9) for low, high in edges_nm))


def _passed(bands: Bands, *masses: float) -> np.ndarray:
    """(masses, 4) transmittance of the air above sea level for zenith angles of some air masses."""
    air = air_in_bands(bands)
    depth = optical_depth_to_space(air, RADIUS, 0.0, 1.0 / np.array(masses))
    return band_transmittance(air, depth)


def test_rayleigh_scattering_is_the_known_one_and_falls_by_its_law() -> None:
    assert float(rayleigh_depth(np.array(550e-9))) == pytest.approx(0.0973, rel=2e-3)
    # Bodhaine et al. 1999, J. Atmos. Oceanic Technol. 16, 1854, at 45 deg north, sea level.
    for nm, depth in ((300.0, 1.2237), (400.0, 0.3628), (700.0, 0.0360), (1000.0, 0.00852)):
        assert float(rayleigh_depth(np.array(nm * 1e-9))) == pytest.approx(depth, rel=0.02)
    air = air_in_bands(_bands((549.0, 551.0), (1099.0, 1101.0)))
    blue, red = air.all_shares[:2] @ np.concatenate([one.rayleigh for one in air.parts])
    # 2^4 by the fourth power, and 2.9 % for how the refractive index of air changes.
    assert blue / red == pytest.approx(16.0 * 1.0278, rel=2e-3)


def test_bands_that_are_r_g_b_have_the_air_of_r_g_b() -> None:
    tinted = _bands(*((1e9 * low, 1e9 * high) for low, high in BANDS.edges[:3]))
    depth = optical_depth_to_space(STANDARD, RADIUS, 0.0, np.array([1.0, 0.5]))
    # R, G, B have the depths at their middles, and no lines.
    nm = np.arange(602.5, 700.0, 5.0) * 1e-9
    lines = [gas_transmittance(gas, nm, np.array([1.0, 2.0])) for gas in ("water", "oxygen")]
    default = np.exp(-depth)[:, :3]
    default[:, 0] *= (lines[0] * lines[1]).mean(axis=0)
    np.testing.assert_allclose(_passed(tinted, 1.0, 2.0)[:, :3], default, rtol=0.01)


# Mean transmittance of 1.5 air masses in gases' bands, by ASTM G173's direct beam over that outside
# the air and over what scattering leaves of it beside the band.
@pytest.mark.parametrize(
    ("gas", "low", "high", "published"),
    [
        ("oxygen", 755.0, 775.0, 0.781),
        ("oxygen", 685.0, 695.0, 0.885),
        ("water", 715.0, 735.0, 0.874),
        ("water", 810.0, 840.0, 0.893),
        ("water", 890.0, 990.0, 0.679),
    ],
)
def test_gases_take_what_the_reference_spectrum_lacks(
    gas: str, low: float, high: float, published: float
) -> None:
    pieces = np.arange(low + 2.5, high, 5.0) * 1e-9
    passed = gas_transmittance(gas, pieces, np.array([1.5]))
    # The straight line beside the band is good to 0.01.
    assert float(passed.mean()) == pytest.approx(published, abs=0.012)


# Beyond 1000 nm bands are wide, and a line drawn between their ends is not free of gas: carbon
# dioxide takes most of the light at 2000 nm. So this is the direct beam over that outside the air
# and over what molecules and the standard's own aerosol leave, 0.084 at 500 nm, of which any
# exponent from 1.0 to 1.6 changes it by less than 0.008.
@pytest.mark.parametrize(
    ("low", "high", "published"),
    [
        (1090.0, 1200.0, 0.616),
        (1300.0, 1500.0, 0.264),
        (1750.0, 2000.0, 0.223),
        (1950.0, 2100.0, 0.589),
        (2300.0, 2500.0, 0.581),
        (1200.0, 2500.0, 0.625),
    ],
)
def test_gases_take_what_the_reference_spectrum_lacks_in_the_short_wave_infrared(
    low: float, high: float, published: float
) -> None:
    assert _gases_pass(low, high, 1.5) == pytest.approx(published, abs=0.008)


# SPCTRL2 (Bird and Riordan 1984, SERI/TR-215-2436): wavelength [nm], coefficients of water per
# g cm-2 and of mixed gases. Its wavelengths lie up to 60 nm apart.
_SPCTRL2 = np.array(
    [
        *((1070.0, 1e-3, 0.0), (1100.0, 3.2, 0.0), (1120.0, 115.0, 0.0), (1130.0, 70.0, 0.0)),
        *((1145.0, 75.0, 0.0), (1161.0, 10.0, 0.0), (1170.0, 5.0, 0.0), (1200.0, 2.0, 0.0)),
        *((1290.0, 0.1, 0.02), (1320.0, 4.0, 2e-4), (1350.0, 200.0, 1.1e-4)),
        *((1395.0, 1000.0, 1e-5), (1442.5, 185.0, 0.05), (1462.5, 80.0, 0.011)),
        *((1477.0, 80.0, 5e-3), (1497.0, 12.0, 6e-4), (1520.0, 0.16, 0.0), (1539.0, 2e-3, 5e-3)),
        *((1558.0, 5e-4, 0.13), (1578.0, 1e-4, 0.04), (1592.0, 1e-5, 0.06), (1610.0, 1e-4, 0.13)),
        *((1630.0, 1e-3, 1e-3), (1646.0, 0.01, 1.4e-3), (1678.0, 0.036, 1e-4), (1740.0, 1.1, 1e-5)),
        *((1800.0, 130.0, 1e-5), (1860.0, 1000.0, 1e-4), (1920.0, 500.0, 1e-3)),
        *((1960.0, 100.0, 4.3), (1985.0, 4.0, 0.2), (2005.0, 2.9, 21.0)),
    ]
)


@pytest.mark.parametrize("masses", [1.0, 2.0, 5.0])
@pytest.mark.parametrize(
    ("low", "high"), [(1090.0, 1200.0), (1300.0, 1500.0), (1500.0, 1700.0), (1750.0, 2000.0)]
)
def test_gases_take_what_another_band_model_has(low: float, high: float, masses: float) -> None:
    # Of other data, on other paths than those that the amounts were set for.
    nm, water, mixed = _SPCTRL2.T
    of_water, of_mixed = 1.42 * masses * water, masses * mixed
    other = np.exp(
        -0.2385 * of_water / (1.0 + 20.07 * of_water) ** 0.45
        - 1.41 * of_mixed / (1.0 + 118.3 * of_mixed) ** 0.45
    )
    pieces = np.arange(low + 2.5, high, 5.0)
    expected = float(np.interp(pieces, nm, other).mean())
    # What its wide steps leave: half of the flank of a band within 60 nm of 200.
    assert _gases_pass(low, high, masses) == pytest.approx(expected, abs=0.07)


def _gases_pass(low: float, high: float, masses: float) -> float:
    """Mean transmittance of all gases between two wavelengths [nm]."""
    pieces = np.arange(low + 2.5, high, 5.0) * 1e-9
    each = [gas_transmittance(gas, pieces, np.array([masses])) for gas in GASES]
    return float(np.prod(each, axis=0).mean())


def test_oxygen_at_762_nm_takes_the_share_of_the_vertical_path_that_its_lines_do() -> None:
    passed = _passed(_bands((755.0, 775.0)), 1.0)[0, 0]
    scattered = np.exp(-(0.0258 + 0.0575 + 0.0018))
    # Sixty lines of 17 cm-1 in the mean, 0.035 cm-1 wide at the middle of the air: 2 sqrt(S u a)
    # each, less a fifth where they overlap, of 342 cm-1 (HITRAN's band: 2.24e-22 cm).
    wide = 60.0 * 2.0 * np.sqrt(17.0 * 0.035) * 0.8 / 342.0
    assert passed / scattered == pytest.approx(1.0 - wide, abs=0.06)


def test_terms_pass_what_their_states_pass_on_any_path() -> None:
    bands = _bands((935.0, 945.0), (759.0, 771.0), (300.0, 400.0))
    masses = np.array([1.0, 2.0, 5.0, 12.0])
    air = air_in_bands(bands)
    depth = np.outer(masses, _vertical(air))
    got = band_transmittance(air, depth)
    for index, (low, high) in enumerate(bands.edges):
        nm = np.arange(low * 1e9 + 0.5, high * 1e9) * 1e-9
        passed = np.ones((len(nm), len(masses)))
        for gas in GASES:
            passed = passed * gas_transmittance(gas, nm, masses)
        ozone = _ozone(nm)
        other = rayleigh_depth(nm) + 0.08 * 550e-9 / nm + ozone
        photons = (
            1.0 / nm**4 / np.expm1(6.62607015e-34 * 299792458.0 / (nm * 1.380649e-23 * 5772.0))
        )
        expected = (photons @ (passed * np.exp(-np.outer(other, masses)))) / photons.sum()
        np.testing.assert_allclose(got[:, index], expected, atol=0.01)


def _vertical(air: object) -> np.ndarray:
    parts = air.parts  # type: ignore[attr-defined]
    return np.concatenate(
        [
            np.add(np.add(one.rayleigh, one.aerosol), one.ozone)
            + np.sum([gas.depth for gas in one.absorbers], axis=0)
            for one in parts
        ]
    )


def _ozone(wavelength: np.ndarray) -> np.ndarray:
    """300 Dobson units of the table, in pieces of 5 nm."""
    from simgl import assets

    table = np.loadtxt(assets.data() / "air_absorption.csv", delimiter=",", skiprows=1)
    rows = np.floor((wavelength * 1e9 - 300.0) / 5.0 + 1e-6).astype(int)
    return 0.3 * table[rows, 1]


def test_ozone_makes_300_nm_opaque_and_leaves_400_nm() -> None:
    uv, blue = _passed(_bands((300.0, 305.0), (395.0, 400.0)), 1.0)[0, :2]
    # Molina and Molina 1986: 3.9e-19 to 1.9e-19 cm2 from 300 to 305 nm.
    assert uv == pytest.approx(np.exp(-1.2 - 0.14 - 8.07e18 * 2.8e-19), rel=0.3)
    assert blue == pytest.approx(np.exp(-0.371 - 0.11), rel=0.01)


def test_sunlight_past_the_limb_reddens_by_wavelength() -> None:
    radii = np.full(3, RADIUS)
    distance = RADIUS + 400e3
    # The Sun stands 15 km over the limb.
    low = np.arcsin((RADIUS + 15e3) / distance)
    position = np.array([distance, 0.0, 0.0])
    sun = np.array([-np.cos(low), np.sin(low), 0.0])
    bands = _bands((300.0, 400.0), (545.0, 555.0), (840.0, 860.0), (1550.0, 1750.0))
    light = sunlit_transmission(position, sun, 0.00465, radii, air_in_bands(bands))
    assert light[0] < 0.1 < light[1] < light[2] < light[3] < 1.0
    green = sunlit_transmission(position, sun, 0.00465, radii, STANDARD)[1]
    # The default's G is 550 nm. Its ozone is 0.002 more of the vertical, 40 times that here.
    assert light[1] == pytest.approx(green, rel=0.12)
