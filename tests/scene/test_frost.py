"""Sea ice and snow by the season: the extents that are measured, and a year that goes round."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.passes.background.earth_maps import shore_map
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.scene.frost import frost_edges, frost_limits, ice_reflectance, year_share

# Mean extents of sea ice, 1981 to 2010, January to December [million km2] (NSIDC Sea Ice Index).
NORTH = (14.4, 15.3, 15.4, 14.7, 13.3, 11.8, 9.5, 7.2, 6.4, 8.4, 10.7, 12.8)
SOUTH = (5.0, 3.0, 4.0, 6.8, 10.2, 13.3, 16.1, 17.8, 18.5, 18.0, 15.8, 10.2)


@pytest.fixture(scope="module")
def sea() -> np.ndarray:
    """(2, 1012, 720) area of sea by distance from the north and the south pole [million km2]."""
    water = shore_map(None)[0][2::4, ::2, 0] > 128
    rows, columns = water.shape[0] // 2, frost_edges().shape[1]
    part = [water[:rows], water[::-1][:rows]]
    east = np.array([[b.mean(axis=1) for b in np.array_split(p, columns, axis=1)] for p in part])
    away = (np.arange(rows) + 0.5) * 0.5 * np.pi / rows
    cell = 6.371**2 * np.sin(away) * (0.5 * np.pi / rows) * (2.0 * np.pi / columns)
    return np.asarray(east.transpose(0, 2, 1) * cell[:, None])


@pytest.mark.parametrize(("side", "extent"), [(0, NORTH), (1, SOUTH)])
def test_there_is_as_much_ice_as_is_measured(
    side: int, extent: tuple[float, ...], sea: np.ndarray
) -> None:
    away = (np.arange(sea.shape[1]) + 0.5) * 90.0 / sea.shape[1]
    edges = 90.0 - np.abs(frost_edges()[..., side])
    ice = [float(sea[side][away[:, None] < line].sum()) for line in edges]
    # Another map of the shores, which counts the Baltic and the Great Lakes too; and the winding.
    np.testing.assert_allclose(ice, extent, rtol=0.06, atol=0.6)


def test_a_time_of_the_year_is_the_same_in_every_year() -> None:
    for date in ("01-01", "03-20", "07-15", "12-31"):
        epochs = [tai_ns_from_utc(f"{year}-{date}T12:00:00") for year in (1999, 2018, 2027)]
        around = np.exp(2j * np.pi * np.array([year_share(epoch) for epoch in epochs]))
        # Leap days move a date by one and a half days at most, a step is 9 hours.
        assert np.ptp(np.angle(around / around[0])) < 2.0 * np.pi * 2.0 / 365.0


def test_the_end_of_a_year_joins_its_beginning() -> None:
    for of_year in (frost_limits, lambda year: ice_reflectance(year).ravel()):
        before, after = np.array(of_year(1.0 - 1e-9)), np.array(of_year(0.0))
        np.testing.assert_allclose(before, after, atol=1e-6)


@pytest.mark.parametrize("year", np.arange(0.0, 1.0, 0.05))
def test_no_ice_lies_between_the_limits(year: float) -> None:
    south, north = np.degrees(frost_limits(year))
    month = 12.0 * year - 0.5
    first = int(np.floor(month))
    share = month - first
    edges = (1.0 - share) * frost_edges()[first % 12] + share * frost_edges()[(first + 1) % 12]
    assert np.all(edges[:, [0, 2]] > north)
    assert np.all(edges[:, 1] < south)
