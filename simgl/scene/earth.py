"""The Earth: an ellipsoid with ground, sea, clouds and atmosphere; map images from files."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image

from simgl.decoded_files import decoded_image
from simgl.errors import AssetError
from simgl.file_cache import FileCache
from simgl.input_files import read_file
from simgl.physics.atmosphere import Air
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS, WGS84_POLAR_RADIUS
from simgl.physics.earth_spectra import cloud_table, even_reflectance, land_in_bands
from simgl.physics.regolith import Regolith
from simgl.physics.spectral_form import scaled
from simgl.physics.spectrum import BANDS, Bands, PerBand, channels

# Of the ground alone and with clouds of the usual cover, in every band, for multiple scattering
# between them and the atmosphere: the albedo in the bands, 0.17 and 0.33, without the air's part.
CLEAR_ALBEDO, CLOUDY_ALBEDO = 0.13, 0.27
# In other bands that of the sea stays, as waves do most of it, and that of the land, of which these
# are the means and the share of the Earth, follows its spectrum.
_MEAN_LAND, _LAND_SHARE = (0.215, 0.198, 0.154, 0.340), 0.29


# Textures of this width are possible on every OpenGL 3.3 driver that runs simgl.
MAX_WIDTH = 16384


@dataclass(frozen=True, kw_only=True)
class MapImage:
    """The file of an equirectangular image of the full Earth, twice as wide as high.

    digest : SHA-256 of its content
    """

    path: Path
    digest: str

    def read(self, mode: str) -> Image.Image:
        """The image in mode "RGB" or "L".

        Raises AssetError for a file that has another content by now, or that ``load_map`` refuses.
        """
        content = read_file(self.path)
        if hashlib.sha256(content).hexdigest() != self.digest:
            raise AssetError(f"{self.path} has changed since it was loaded; load it again")
        return _decoded(self.path, content, mode)


@dataclass(frozen=True, kw_only=True)
class EarthMaps:
    """Images of the full Earth in place of the shipped ones.

    From 180 deg west to 180 deg east, north up.

    land : sRGB image; becomes reflectance as ``simgl.physics.land_reflectance`` says
    water : white on water, black on land
    night : brightness of lights, 0..1 of the brightest
    """

    land: MapImage | None = None
    water: MapImage | None = None
    night: MapImage | None = None


# Where towers end, at the tropopause [m].
_TROPOPAUSE = 13_000.0


@dataclass(frozen=True, kw_only=True)
class Clouds:
    """A thin layer of cloud.

    cover : mean fraction of the Earth under cloud, without thin high cloud
    seed : of the weather
    height : of the layer above the ground, for its shadows [m]
    image : cloud fraction from an image, as in ``EarthMaps``, in place of the procedural weather;
        ``cover`` is then ignored
    thickness : optical thickness of the cloud in an image
    """

    cover: float = 0.6
    seed: int = 0
    height: float = 4000.0
    image: MapImage | None = None
    thickness: float = 15.0

    @property
    def top(self) -> float:
        """Height of the highest towers [m]; an image of clouds lies at the height that is given."""
        return self.height if self.image is not None else max(self.height, _TROPOPAUSE)


@dataclass(frozen=True, kw_only=True)
class Earth:
    """Semi-axes [m] and the surface's reflectance.

    bands : of all that follows, and of the light
    albedo : Lambert albedo per band, without clouds; None uses the maps and the clouds
    regolith : reflection law of airless ground in place of Lambert's, scaled to the geometric
        albedo of a Lambertian globe of ``albedo``
    air : atmosphere; None for a bare ellipsoid
    wind : speed 12.5 m above the sea, which roughens it [m s-1]
    wind_varies : from place to place, about that mean
    clouds : None for a clear day everywhere
    frost : sea ice and snow on land change with the seasons
    moonlight, airglow : the Moon, and the glow of the atmosphere, light ground and clouds at night;
        the glow itself is drawn too
    longwave : heat that all its ground sends as a black body, without air [W m-2]; None for a
        climate, and clouds where there are maps
    airglow_waves : rms of the waves in that glow over its mean
    aurora_kp : magnetic activity Kp, 0 to 9, of the aurora; None draws none
    """

    equatorial_radius: float = WGS84_EQUATORIAL_RADIUS
    polar_radius: float = WGS84_POLAR_RADIUS
    bands: Bands = BANDS
    albedo: tuple[float, float, float, float] | None = None
    regolith: Regolith | None = None
    air: Air | None = None
    longwave: float | None = None
    wind: float = 7.0
    wind_varies: bool = False
    clouds: Clouds | None = None
    frost: bool = False
    moonlight: bool = False
    airglow: bool = False
    airglow_waves: float = 0.0
    aurora_kp: float | None = None
    maps: EarthMaps = field(default_factory=EarthMaps)

    @property
    def mean_albedo(self) -> tuple[float, float, float, float]:
        """Of the whole ground, per band."""
        if self.albedo is not None:
            return self.albedo
        if self.clouds is None:
            share = 0.0
        else:
            share = 1.0 if self.clouds.image is not None else self.clouds.cover / Clouds.cover
        if self.bands != BANDS:
            return _mean_albedo(self.bands, share)
        return (CLEAR_ALBEDO + (CLOUDY_ALBEDO - CLEAR_ALBEDO) * share,) * 4

    @property
    def radii(self) -> tuple[float, float, float]:
        """Semi-axes along the Earth-fixed x, y, z [m]."""
        return self.equatorial_radius, self.equatorial_radius, self.polar_radius


@lru_cache(maxsize=16)
def _mean_albedo(bands: Bands, cloudy: float) -> PerBand:
    """Of the ground in bands, with so much of the usual clouds; an estimate."""
    land = land_in_bands(np.array([_MEAN_LAND], dtype=np.float32), bands)[0].astype(np.float64)
    sea = CLEAR_ALBEDO - _LAND_SHARE * float(np.mean(_MEAN_LAND))
    lit = scaled((1.0,) * 4, even_reflectance, bands)
    clear = sea * lit + _LAND_SHARE * land
    # Clouds of medium thickness, the Sun at 60 deg from the zenith.
    dark = cloud_table(bands)[0, 11, 8] * lit
    return channels(clear + (CLOUDY_ALBEDO - CLEAR_ALBEDO) * cloudy * dark)


_maps = FileCache[tuple[Path, str], MapImage](64)


def load_map(path: Path, mode: str) -> MapImage:
    """A map image, decoded once in mode "RGB" or "L" to check it.

    Raises AssetError for a file that is missing, not an image, damaged, or of another shape.
    """
    return _maps.get((path, mode), lambda: _checked(path, mode))


def _checked(path: Path, mode: str) -> MapImage:
    if not os.path.exists(path):
        raise AssetError(f"there is no file {path}")
    content = read_file(path)
    _decoded(path, content, mode)
    return MapImage(path=path, digest=hashlib.sha256(content).hexdigest())


def _decoded(path: Path, content: bytes, mode: str) -> Image.Image:
    try:
        image = decoded_image(content, MAX_WIDTH * MAX_WIDTH // 2)
    except ValueError as error:
        raise AssetError(f"{path} {error}") from None
    width, height = image.size
    if width != 2 * height or width > MAX_WIDTH:
        raise AssetError(
            f"{path} must be twice as wide as high and at most {MAX_WIDTH} pixels wide, "
            f"it is {width} x {height}"
        )
    return image.convert(mode)
