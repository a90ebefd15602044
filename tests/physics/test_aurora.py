"""The aurora's oval stands where published tables put it, and shines as much as comes down."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.physics import aurora
from simgl.physics.airglow import RAYLEIGH
from simgl.physics.constants import LIGHT_SPEED, PLANCK
from simgl.physics.ephemeris import itrf_from_icrf, sun_position, tai_ns_from_utc

# Geographic latitude and longitude, and latitude and longitude in AACGM-v2 at 110 km (2020) [deg].
STATIONS = {
    "Tromso": (69.6, 19.2, 67.02, 101.00),
    "Fairbanks": (64.8, -147.7, 65.19, -91.72),
    "Yellowknife": (62.5, -114.4, 68.84, -54.75),
    "Reykjavik": (64.1, -21.9, 64.30, 64.37),
    "Hobart": (-42.9, 147.3, -53.78, -132.69),
    "Syowa": (-69.0, 39.6, -66.85, 73.69),
    "South Pole": (-89.9, 0.0, -74.59, 18.84),
}


def up_at(latitude: float, longitude: float) -> np.ndarray:
    a, b = np.radians([latitude, longitude])
    return np.array([[np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)]])


def sun_at(utc: str) -> np.ndarray:
    time = tai_ns_from_utc(utc)
    sun = itrf_from_icrf(time) @ sun_position(time)
    return np.asarray(sun / np.linalg.norm(sun))


def magnetic_place(up: Array, sun_direction_itrf: Array) -> tuple[Array, Array]:
    """Magnetic latitude [rad], negative in the south, and local time [h] of unit vectors (n, 3)."""
    maps = aurora.magnetic_maps()
    both = np.einsum("hij,nj->hni", maps[:, :, :3], up) + maps[:, None, :, 3]
    both /= np.linalg.norm(both, axis=-1, keepdims=True)
    place = np.where(up[:, 2:] > 0.0, both[0], both[1])
    turn = np.arctan2(place[:, 1], place[:, 0]) - aurora.midnight(sun_direction_itrf)
    return np.arcsin(place[:, 2]), np.mod(np.degrees(turn) / 15.0, 24.0)


@pytest.mark.parametrize("name", STATIONS)
def test_places_have_the_magnetic_latitude_and_time_of_the_geomagnetic_model(name: str) -> None:
    """1.7 deg is the fit's largest error; 0.3 deg are five years of the field."""
    latitude, longitude, magnetic, east = STATIONS[name]
    # Local midnight is where a magnetic longitude of 0 has 18.69 h at this time.
    got, hours = magnetic_place(up_at(latitude, longitude), sun_at("2025-01-15T00:00:00"))
    assert np.degrees(got[0]) == pytest.approx(magnetic, abs=2.0)
    late = (hours[0] - 18.69 - east / 15.0 + 12.0) % 24.0 - 12.0
    assert late * 15.0 * np.cos(np.radians(magnetic)) == pytest.approx(0.0, abs=2.0)


def test_the_quiet_oval_is_feldsteins() -> None:
    """At quiet times it spans 65 to 71 deg at midnight and 74 to 77 at noon (Feldstein 1963)."""
    pole_side, equator_side, diffuse = 90.0 - np.degrees(
        aurora.oval(2.0).colatitudes(np.array([0.0, 12.0]))
    )
    np.testing.assert_allclose(equator_side, [66.0, 74.5], atol=1.5)
    np.testing.assert_allclose(pole_side, [70.5, 76.5], atol=1.5)
    assert (diffuse < equator_side).all()


def test_the_oval_grows_and_brightens_with_activity() -> None:
    edges = [aurora.oval(kp).colatitudes(np.array([0.0]))[1, 0] for kp in (0.0, 2.0, 4.0, 6.0, 9.0)]
    assert (np.diff(edges) > 0.0).all()
    power = [aurora.hemispheric_power(kp) for kp in (0.0, 2.0, 5.0, 5.001, 9.0)]
    assert (np.diff(power) > 0.0).all()
    # The two laws meet at Kp 5.
    assert power[2] == pytest.approx(power[3], rel=0.02)


def test_ten_kilorayleighs_of_green_go_with_six_milliwatts() -> None:
    """The second international brightness coefficient, within 5 %; green has no other line in G."""
    green = aurora.brightness()[:, 1].sum() * 6.2e-3
    assert green == pytest.approx(10e3 * RAYLEIGH * PLANCK * LIGHT_SPEED / 557.7e-9, rel=0.05)


def test_green_has_its_lower_border_at_100_km_and_red_at_200() -> None:
    middle = 0.5e-3 * (aurora.HEIGHTS[1:] + aurora.HEIGHTS[:-1])
    density = aurora.layers() / np.diff(aurora.HEIGHTS)
    np.testing.assert_allclose(aurora.layers().sum(axis=1), 1.0, rtol=1e-12)
    for law, border in ((0, 103.0), (1, 200.0)):
        peak = int(density[law].argmax())
        half = np.interp(0.5 * density[law, peak], density[law, : peak + 1], middle[: peak + 1])
        assert half == pytest.approx(border, abs=0.06 * border)
    assert density[0].argmax() < density[1].argmax()
