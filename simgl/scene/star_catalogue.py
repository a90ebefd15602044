"""The shipped star catalogue, and the observer's place for parallax and aberration."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simgl import assets
from simgl.arrays import Array, Array32, IndexArray, UIntArray
from simgl.decoded_files import arrays_in
from simgl.errors import AssetError
from simgl.file_cache import FileCache
from simgl.input_files import read_file
from simgl.physics.planets import Planet, planets
from simgl.physics.spectrum import BANDS, Bands
from simgl.physics.starlight import (
    MILLIARCSECOND,
    band_irradiance,
    earth_from_barycentre,
    years_since_catalogue,
)
from simgl.physics.zodiacal_light import mean_diffuse_sky

# The shipped catalogue ends here [mag].
FAINTEST = 7.5


@dataclass(frozen=True, kw_only=True, eq=False)
class StarCatalogue:
    """Stars, the brightest first, at J1991.25 in ICRS axes.

    hip : (n,) numbers in the Hipparcos catalogue
    magnitude : (n,) Johnson's V
    direction : (n, 3) unit
    motion : (n, 3) of the unit vector [rad per Julian year]
    parallax : (n,) [rad]
    irradiance : (n, 4) per band, facing the star [W m-2]
    """

    hip: UIntArray
    magnitude: Array
    direction: Array
    motion: Array
    parallax: Array
    irradiance: Array

    @cached_property
    def _coarse_direction(self) -> Array32:
        """(3, n) of the directions, for a first choice among them."""
        return np.ascontiguousarray(self.direction.T, dtype=np.float32)

    def around(self, direction: Array, angle: float) -> IndexArray:
        """Rows of all stars within an angle [rad] of a direction (3,) unit, and some beyond, by
        1e-6 in the angle's cosine."""
        cosine = direction.astype(np.float32) @ self._coarse_direction
        return np.flatnonzero(cosine > np.float32(np.cos(angle) - 1e-6))

    @cached_property
    def mean_radiance(self) -> Array:
        """(4,) of all stars, spread over the sky [W m-2 sr-1]."""
        return self.irradiance.sum(axis=0) / (4.0 * np.pi)


@dataclass(frozen=True, kw_only=True, eq=False)
class StarSky:
    """A catalogue seen from near the Earth at an instant.

    years : since the catalogue's epoch [Julian years]
    earth_position, earth_velocity : (3,) of the Earth's centre from the solar system's barycentre
        [m], [m s-1]
    tai_ns, bands : of the planets that are drawn with the stars; None draws none
    diffuse : whether zodiacal light and stars too faint for the catalogue shine between them
    """

    catalogue: StarCatalogue
    years: float
    earth_position: Array
    earth_velocity: Array
    tai_ns: int | None = None
    bands: Bands = BANDS
    diffuse: bool = False

    @cached_property
    def planets(self) -> tuple[Planet, ...]:
        """Those drawn with the stars; nobody asks where the Earth hides them all."""
        return () if self.tai_ns is None else planets(self.tai_ns, self.bands)

    def mean_radiance(self, bands: Bands) -> Array:
        """(4,) of all that shines in it but the planets, spread over the sky [W m-2 sr-1]."""
        stars = self.catalogue.mean_radiance
        return stars + mean_diffuse_sky(bands) if self.diffuse else stars


def star_sky(catalogue: StarCatalogue, tai_ns: int, bands: Bands = BANDS) -> StarSky:
    """The whole sky at an epoch."""
    position, velocity = earth_from_barycentre(tai_ns)
    return StarSky(
        catalogue=catalogue,
        years=years_since_catalogue(tai_ns),
        earth_position=position,
        earth_velocity=velocity,
        tai_ns=tai_ns,
        bands=bands,
        diffuse=True,
    )


# Of 3 MB at most.
_catalogues = FileCache[tuple[Path, float, Bands], StarCatalogue](8)


def shipped_stars(
    faintest: float = FAINTEST, path: Path | None = None, bands: Bands = BANDS
) -> StarCatalogue:
    """The shipped stars down to a magnitude V.

    path : of another file of the same form

    Raises AssetError where the file is missing, damaged or of another form.
    """
    file = assets.data() / "sky" / "hipparcos.npz" if path is None else path
    key = file, faintest, bands
    return _catalogues.get(key, lambda: _read_stars(file, faintest, bands))


def _read_stars(path: Path, faintest: float, bands: Bands) -> StarCatalogue:
    try:
        content = read_file(path)
    except AssetError as error:
        raise AssetError(f"{error}; reinstall simgl") from None
    try:
        return _catalogue(arrays_in(content), faintest, bands)
    except (KeyError, ValueError, TypeError):
        raise AssetError(f"{path}: is not a whole star catalogue; reinstall simgl") from None


def _catalogue(
    columns: dict[str, NDArray[np.generic]], faintest: float, bands: Bands
) -> StarCatalogue:
    """The catalogue of the columns that ``tools.star_catalogue`` writes."""
    v = columns["v"].astype(np.float64) / 1e3
    count = int(np.searchsorted(v, faintest, side="right"))
    numbers = {name: column[:count].astype(np.float64) for name, column in columns.items()}
    turn = 2.0 * np.pi / 2.0**32
    alpha, delta = turn * numbers["right_ascension"], turn * numbers["declination"]
    ca, sa, cd, sd = np.cos(alpha), np.sin(alpha), np.cos(delta), np.sin(delta)
    east = np.stack([-sa, ca, np.zeros(count)], axis=1)
    north = np.stack([-sd * ca, -sd * sa, cd], axis=1)
    pm_east, pm_north = (MILLIARCSECOND * numbers["motion_mas_per_year"]).T
    return StarCatalogue(
        hip=columns["hip"][:count].astype(np.uint32),
        magnitude=v[:count],
        direction=np.stack([cd * ca, cd * sa, sd], axis=1),
        motion=pm_east[:, None] * east + pm_north[:, None] * north,
        parallax=MILLIARCSECOND * numbers["parallax_mas"],
        irradiance=band_irradiance(v[:count], numbers["b_v"] / 1e3, numbers["v_i"] / 1e3, bands),
    )
