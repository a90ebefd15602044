"""Where sea ice and snow end, by month and longitude: ``simgl/data/earth/frost_edges.csv``.

    pip install global-land-mask
    python -m tools.ice_edges SST.nc

SST.nc : monthly climatology of sea surface temperature, ``sst_clim_amip`` (12, 180, 360) [K], of
the AMIP boundary conditions (Taylor, Williamson and Zwiers 2000, PCMDI report 60).

Sea ice lies where the sea is coldest, over as much of it as is measured: the monthly extents of the
Sea Ice Index, means of 1981 to 2010 (NSIDC, Fetterer et al. 2017). Its edge is the latitude up to
which the sea is mostly free of it. Snow on land ends where ``_SNOW_LINE`` says, a hand-drawn line
of January that moves north until the Northern Hemisphere has as much snow as is measured: monthly
means of the Rutgers Global Snow Lab (Estilow et al. 2015).
"""

from __future__ import annotations

import sys
from importlib import resources
from pathlib import Path

import numpy as np
from scipy.io import netcdf_file

from simgl.arrays import Array, Mask

# Millions of km2, January to December.
_ICE_NORTH = (14.4, 15.3, 15.4, 14.7, 13.3, 11.8, 9.5, 7.2, 6.4, 8.4, 10.7, 12.8)
_ICE_SOUTH = (5.0, 3.0, 4.0, 6.8, 10.2, 13.3, 16.1, 17.8, 18.5, 18.0, 15.8, 10.2)
_SNOW = (47.1, 46.0, 40.4, 30.5, 19.1, 9.4, 3.9, 3.0, 5.3, 18.5, 34.2, 43.7)

# Longitudes of the table [deg]: the middles of strips 10 deg wide.
LONGITUDES = np.arange(-175.0, 180.0, 10.0)

# Latitude where snow ends in January at ``LONGITUDES``, smoothed from maps of snow cover: the north
# Pacific and the Atlantic push it to the north on western coasts, Asia's cold to the south.
_SNOW_LINE = np.array([
    62, 60, 59, 58, 56, 50, 43, 41, 39, 39, 41, 43, 46, 50, 56, 60,
    63, 61, 53, 49, 46, 46, 45, 43, 41, 39, 39, 39, 40, 40, 40, 38, 41, 50, 57, 62,
], dtype=np.float64)  # fmt: skip
# Latitude where the line meets the last of the snow in August [deg].
_SUMMER = 84.0


def _row_area(latitudes: Array) -> Array:
    """Of a cell of 1 deg [million km2]."""
    low, high = np.radians(latitudes - 0.5), np.radians(latitudes + 0.5)
    return 6.371**2 * np.radians(1.0) * (np.sin(high) - np.sin(low))


def _coldest(sst: Array, area: Array, extent: float) -> Mask:
    """The coldest cells of a sea that make up an area; NaN on land and in the other hemisphere."""
    order = np.argsort(np.where(np.isnan(sst), np.inf, sst), axis=None)
    taken = np.cumsum(np.broadcast_to(area[:, None], sst.shape).ravel()[order]) <= extent
    cells = np.zeros(sst.size, dtype=bool)
    cells[order[taken]] = True
    return cells.reshape(sst.shape)


def _edge(ice: Mask, sea: Mask, distance: Array) -> float:
    """Pole distance [deg] at which a strip's sea is no longer mostly ice; rows from the pole."""
    last, free = 0.0, 0
    for row in range(len(distance)):
        if not sea[row].any():
            continue
        if ice[row].sum() >= 0.5 * sea[row].sum():
            last, free = distance[row] + 0.5, 0
        else:
            free += 1
            # A polynya is no edge.
            if free == 3:
                break
    return last


def ice_edges(sst: Array, land: Mask, latitudes: Array) -> Array:
    """(12, 36, 2) latitude of the edge in the north and in the south [deg]; 90 where there is none.

    sst : (12, 180, 360) from the south pole and from the Greenwich meridian on [K]
    """
    area = _row_area(latitudes)
    edges = np.empty((12, len(LONGITUDES), 2))
    for month in range(12):
        for side, extent in enumerate((_ICE_NORTH[month], _ICE_SOUTH[month])):
            here = (latitudes > 0.0) == (side == 0)
            of_sea = np.where(land | ~here[:, None], np.nan, sst[month])
            ice = _coldest(of_sea, area, extent)
            rows = np.flatnonzero(here)
            rows = rows[::-1] if side == 0 else rows
            for strip, east in enumerate(LONGITUDES):
                columns = (int(east - 5.0) + np.arange(10)) % 360
                part = np.ix_(rows, columns)
                off = _edge(ice[part], ~land[part], 90.0 - np.abs(latitudes[rows]))
                edges[month, strip, side] = 90.0 - off
            edges[month, :, side] -= _shift(edges[month, :, side], land, latitudes, side, extent)
    return edges


def _shift(edges: Array, land: Mask, latitudes: Array, side: int, extent: float) -> float:
    """By how much edges lie too near to a pole for the sea within them to be an area [deg].

    A line by strips leaves out ice beyond open water.
    """
    area = _row_area(latitudes)
    columns = (np.arange(360) + 0.5 + 180.0) % 360.0 - 180.0
    across = np.interp(columns, LONGITUDES, edges, period=360.0)
    north = latitudes if side == 0 else -latitudes
    low, high = -5.0, 10.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        within = ~land & (north[:, None] > across - middle)
        too_much = float((within * area[:, None]).sum()) > extent
        low, high = (low, middle) if too_much else (middle, high)
    return low


def snow_edges(land: Mask, latitudes: Array) -> Array:
    """(12, 36) latitude where snow on land ends in the north [deg]."""
    area = _row_area(latitudes)
    columns = (np.arange(360) + 0.5 + 180.0) % 360.0 - 180.0
    lines = []
    for extent in _SNOW:
        low, high = -1.0, 1.0
        for _ in range(40):
            share = 0.5 * (low + high)
            # To the north as one, so that what lies far in the south melts first.
            line = _SNOW_LINE + share * (_SUMMER - _SNOW_LINE)
            across = np.interp(columns, LONGITUDES, line, period=360.0)
            snow = land & (latitudes[:, None] > across)
            more = float((snow * area[:, None]).sum()) > extent
            low, high = (share, high) if more else (low, share)
        lines.append(line)
    return np.array(lines)


def land_mask() -> Mask:
    """(180, 360) whether the middles of cells lie on land, from the south and from Greenwich on."""
    source = resources.files("global_land_mask") / "globe_combined_mask_compressed.npz"
    with resources.as_file(source) as path, np.load(path) as store:
        sea: Mask = store["mask"]
    # Its first cell is centred on 180 W, 90 N.
    step = sea.shape[0] // 180
    return np.roll(~sea[step // 2 :: step, step // 2 :: step][::-1], 180, axis=1)


def main(sst_file: Path, out: Path) -> None:
    """Write the table."""
    with netcdf_file(sst_file, mmap=False) as store:
        sst = np.array(store.variables["sst_clim_amip"][:])
        latitudes = np.array(store.variables["lat"][:])
    land = land_mask()
    ice, snow = ice_edges(sst, land, latitudes), snow_edges(land, latitudes)
    lines = ["month,longitude_deg,ice_north_deg,ice_south_deg,snow_north_deg"]
    for month in range(12):
        for strip, longitude in enumerate(LONGITUDES):
            north, south = ice[month, strip]
            values = f"{north:.1f},{-south:.1f},{snow[month, strip]:.1f}"
            lines.append(f"{month + 1},{longitude:.0f},{values}")
    out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    folder = Path(__file__).resolve().parents[1] / "simgl" / "data" / "earth"
    main(Path(sys.argv[1]), folder / "frost_edges.csv")
