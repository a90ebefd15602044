"""What the shaders of the planet are told: the blocks and their values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from simgl.arrays import AnyArray, Array, Array32
from simgl.gpu.uniform_blocks import Block
from simgl.passes.background.earth_maps import HEIGHT
from simgl.physics import aurora
from simgl.physics.airglow import GLOW_DEPTH, glow_bottom, ground_irradiance, zenith_glow
from simgl.physics.atmosphere import albedo_from_below
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS
from simgl.physics.earth_spectra import ice_cloud, water_mirror
from simgl.physics.regolith import Regolith, geometric_albedo
from simgl.physics.sea_surface import (
    clear_water,
    foam_cover,
    foam_in_bands,
    mirror_laws,
    wave_slope_variance,
)
from simgl.physics.spectrum import Bands
from simgl.scene.earth import Earth
from simgl.scene.frost import ice_reflectance, snow_in_bands
from simgl.scene.noise_projection import LEVELS, SIZE, TEXEL_KM
from simgl.view.background import PlanetView
from simgl.view.image_box import Box

PLANET = Block(
    "Planet",
    4,
    np.dtype(
        [
            ("sphere_from_camera", "f4", (4, 4)),
            ("camera_in_sphere", "f4", 4),
            # Equatorial radius over each semi-axis: turns a sphere's point into the normal.
            ("sphere_axes", "f4", 4),
            ("sun_direction_itrf", "f4", 4),
            ("earth_sun_irradiance", "f4", 4),
            ("earth_albedo", "f4", 4),
            # Of water without foam and its surface's mirror, and of foam.
            ("clear_water", "f4", 4),
            ("foam", "f4", 4),
            # Of sea ice in the north and in the south.
            ("ice_reflectance", "f4", (2, 4)),
            # Of the ground that the light scattered by the air is made for, and of the clear air
            # from below.
            ("mean_ground", "f4", 4),
            ("air_from_below", "f4", 4),
            # Of the brightest lamps [W m-2 sr-1].
            # Of lamps of either kind, where the map is brightest.
            ("sodium_lamps", "f4", 4),
            ("white_lamps", "f4", 4),
            # The airglow's radiance for each Earth radius of way in its layers, what it sends down
            # to horizontal ground [W m-2], and as ``outside``, from the layers' bottoms and tops.
            ("glow", "f4", 4),
            ("glow_irradiance", "f4", 4),
            ("glow_outside", "f4", (2, 4)),
            # Cubics of the view's cosine (simgl/physics/sea_surface.py).
            ("sea_mirror", "f4", (3, 4)),
            # fx, fy, cx, cy [pixels]
            ("intrinsics", "f4", 4),
            # Of the image: its first corner [pixels]; of the target: clip space per pixel.
            ("area", "f4", 4),
            # Variance of the noise of hills and of ice fibres by the chart's halvings, and of
            # closed cells, open cells, cumulus and lumps.
            ("chart_variance", "f4", (LEVELS, 4)),
            ("cloud_variance", "f4", (LEVELS, 4)),
            # Halvings by which the maps of land, form, shores and lamps are coarser than form's.
            ("map_halvings", "f4", 4),
            ("weather_halvings", "f4"),
            ("outside", "f4"),
            # The same from the sphere that the clouds lie on.
            ("cloud_outside", "f4"),
            ("sun_angular_radius", "f4"),
            ("planet_km", "f4"),
            ("cloud_km", "f4"),
            ("high_cloud_thickness", "f4"),
            ("wave_slope_variance", "f4"),
            ("foam_cover", "f4"),
            # 1 where the camera is above the clouds.
            ("clouds_below", "f4"),
            # Of a texel of the map of form on the equator, and of the chart [km].
            ("map_texel_km", "f4"),
            ("chart_texel_km", "f4"),
            # The chart's last halving, and its repetitions between a face's middle and edge.
            ("chart_texels", "f4"),
            ("chart_last", "f4"),
            ("chart_repeats", "f4"),
            # Share of the year that is over.
            ("year_share", "f4"),
            # Of the airglow: rms of its waves over its mean, depth of its layers [km].
            ("glow_waves", "f4"),
            ("glow_depth_km", "f4"),
            # 1 where the wind over the sea differs from place to place.
            ("wind_varies", "f4"),
            # Of the highest towers above the layer of the clouds [km].
            ("tower_km", "f4"),
        ]
    ),
)

_LAYERS = len(aurora.HEIGHTS) - 1
# Standard deviation of an arc across its length [km].
_ARC_KM = 6.0

AURORA = Block(
    "Aurora",
    27,
    np.dtype(
        [
            # From geographic unit vectors, with 1 as the fourth component, to magnetic ones that
            # are to be normalised: columns.
            ("magnetic_north", "f4", (4, 4)),
            ("magnetic_south", "f4", (4, 4)),
            # Cosine and sine of midnight's magnetic longitude.
            ("midnight", "f4", 4),
            # Of the colatitude of the oval's edge towards the pole, towards the equator and of the
            # diffuse aurora: mean [rad], and the sine of the latitude that none exceeds; cosines
            # and sines of one to three times the local time.
            ("oval_mean", "f4", 4),
            ("oval_waves", "f4", (6, 4)),
            # As ``outside`` of the planet's block, from the layers' edges, in x.
            ("layer_outside", "f4", (_LAYERS + 1, 4)),
            # Radiance of the mean over the oval for each Earth radius of way in a layer.
            ("aurora_layers", "f4", (_LAYERS, 4)),
            ("aurora_seed", "f4"),
            ("arc_km", "f4"),
            ("arc_share", "f4"),
            ("rim", "f4"),
        ]
    ),
)

GROUND_BANDS = Block(
    "GroundBands",
    26,
    np.dtype(
        [
            # Reflectance of dry snow on open ground, and of an ice sheet.
            ("snow_in_bands", "f4", 4),
            ("dry_snow_in_bands", "f4", 4),
            # By how much growth changes from hill to hill: with the grain, and with the slope.
            ("growth_by_grain", "f4", 4),
            ("growth_by_slope", "f4", 4),
            # Reflectance of flat water over that of an index of 1.34; of thin high cloud over that
            # of one that absorbs nothing.
            ("water_mirror", "f4", 4),
            ("ice_cloud", "f4", 4),
        ]
    ),
)

REGOLITH = Block(
    "Regolith",
    25,
    np.dtype(
        [
            ("grain_albedo", "f4"),
            ("lobe_width", "f4"),
            ("lobe_backward", "f4"),
            ("surge_height", "f4"),
            ("surge_width", "f4"),
            # Of the slopes' mean angle, and what they leave of the cosine of a level plane.
            ("slope_tangent", "f4"),
            ("slope_chi", "f4"),
            # 2/3, a white Lambertian globe's geometric albedo, over this law's.
            ("regolith_scale", "f4"),
        ]
    ),
)

# Of the map of form on the equator [rad].
MAP_TEXEL = np.pi / HEIGHT
# On the equator [m].
MAP_TEXEL_M = MAP_TEXEL * WGS84_EQUATORIAL_RADIUS
# Brightest texel of the night map, all bands together [W m-2 sr-1]: 200 nW cm-2 sr-1, the core of
# a city of millions in VIIRS's day-night band (Elvidge et al. 2017), over 10 km; and its share in
# each band: of high-pressure sodium lamps, whose lines lie at 560 to 620 and 819 nm, and of white
# diodes of 4000 K.
_BRIGHTEST = 2e-3
_SODIUM_LAMPS = _BRIGHTEST * np.array([0.40, 0.35, 0.04, 0.21])
_WHITE_LAMPS = _BRIGHTEST * np.array([0.33, 0.43, 0.20, 0.04])
# Optical thickness of the thickest of the thin high clouds.
_HIGH_CLOUD = 1.5


# By R, G, B, N, as in shaders/planet/ground.glsl.
_BY_GRAIN, _BY_SLOPE = np.array([0.09, 0.06, 0.075, 0.0]), np.array([0.065, 0.0, 0.04, -0.05])


def ground_band_values(bands: Bands) -> dict[str, object]:
    """The block of land, sea and clouds in bands of a scenario."""
    snow, dry_snow = snow_in_bands(bands)
    return {
        "snow_in_bands": snow,
        "dry_snow_in_bands": dry_snow,
        "growth_by_grain": bands.of_rgbn(_BY_GRAIN.tolist()),
        "growth_by_slope": bands.of_rgbn(_BY_SLOPE.tolist()),
        "water_mirror": water_mirror(bands),
        "ice_cloud": ice_cloud(bands),
    }


def regolith_values(ground: Regolith) -> dict[str, object]:
    """The block of a ground of grains."""
    tangent = np.tan(ground.roughness)
    return {
        "grain_albedo": ground.single_scattering,
        "lobe_width": ground.lobe,
        "lobe_backward": ground.backward,
        "surge_height": ground.surge,
        "surge_width": ground.surge_width,
        "slope_tangent": tangent,
        "slope_chi": 1.0 / np.sqrt(1.0 + np.pi * tangent**2),
        "regolith_scale": 2.0 / 3.0 / geometric_albedo(ground),
    }


def _lamps(radiance: Array, bands: Bands) -> Array:
    """(4,) of lamps whose radiance in R, G, B, N is even there; no light beyond 1000 nm."""
    return np.array(bands.power_of_rgbn(radiance.tolist()))


def _glow(planet: PlanetView) -> Array:
    """(4,) radiance of the airglow for each Earth radius of way [W m-2 sr-1]."""
    bands = planet.earth.bands
    below = planet.height < float(glow_bottom(bands).max())
    each = planet.earth.equatorial_radius / GLOW_DEPTH
    return each * zenith_glow(from_below=below, bands=bands) * planet.earth.airglow


@lru_cache(maxsize=8)
def _glow_layers(earth: Earth) -> Array:
    """(2, 4) bottom and top of the airglow's layers, in Earth radii."""
    bottom = glow_bottom(earth.bands)
    return np.stack([bottom, bottom + GLOW_DEPTH]) / earth.equatorial_radius


def image_values(
    intrinsics: Array32,
    turns: Sequence[Array32],
    areas: Sequence[Box],
    target_size: tuple[int, int],
) -> dict[str, AnyArray]:
    """What the block holds of each of some images that one pinhole draws from one place.

    turns : ``PlanetView.sphere_from_camera`` of each
    """
    matrix = np.zeros((len(turns), 4, 4), dtype=np.float32)
    matrix[:, :3, :3] = turns
    width, height = target_size
    fx, fy, cx, cy = (intrinsics[place] for place in ((0, 0), (1, 1), (0, 2), (1, 2)))
    return {
        "sphere_from_camera": matrix,
        "area": np.array([(x, y, 2.0 / width, 2.0 / height) for x, y, _, _ in areas]),
        "intrinsics": np.array([(fx, fy, cx + x, cy + y) for x, y, _, _ in areas]),
    }


def planet_values(planet: PlanetView, sun_angular_radius: float) -> dict[str, object]:
    """What the block of a light holds of all of them, besides ``earth_values``."""
    earth, clouds = planet.earth, planet.earth.clouds
    cloud_height = clouds.height / earth.equatorial_radius if clouds else 0.0
    layers = _glow_layers(earth)
    return {
        "camera_in_sphere": (*planet.camera_in_sphere, 0.0),
        "sun_direction_itrf": (*planet.sun_direction_itrf, 0.0),
        "earth_sun_irradiance": planet.sun_irradiance,
        "ice_reflectance": ice_reflectance(planet.year_share, earth.bands),
        "year_share": planet.year_share,
        "glow": _glow(planet),
        "glow_outside": planet.outside - layers * (2.0 + layers),
        "outside": planet.outside,
        "cloud_outside": planet.outside - cloud_height * (2.0 + cloud_height),
        "clouds_below": float(clouds is not None and planet.height > clouds.height),
        "sun_angular_radius": sun_angular_radius,
    }


@lru_cache(maxsize=16)
def earth_values(earth: Earth, *, lamps: bool) -> Mapping[str, Any]:
    """What the block holds of an Earth from everywhere in any light; lamps : whether cities
    shine."""
    radii, clouds = np.array(earth.radii), earth.clouds
    return {
        "sphere_axes": (*(radii[0] / radii), 0.0),
        "earth_albedo": earth.albedo or (0.0, 0.0, 0.0, 0.0),
        "clear_water": clear_water(earth.bands),
        "foam": foam_in_bands(earth.bands),
        "foam_cover": foam_cover(earth.wind),
        "mean_ground": earth.mean_albedo,
        "air_from_below": albedo_from_below(earth.air) if earth.air else np.zeros(4),
        "glow_waves": earth.airglow_waves,
        "wind_varies": float(earth.wind_varies),
        "glow_depth_km": 1e-3 * GLOW_DEPTH,
        "sodium_lamps": _lamps(_SODIUM_LAMPS, earth.bands) * lamps,
        "white_lamps": _lamps(_WHITE_LAMPS, earth.bands) * lamps,
        "glow_irradiance": ground_irradiance(radii[0], earth.bands) * earth.airglow,
        "map_texel_km": MAP_TEXEL * radii[0] * 1e-3,
        "chart_texel_km": TEXEL_KM,
        "chart_texels": SIZE,
        "chart_last": LEVELS - 1,
        # In the middle of a face the chart is drawn together to 0.8, at its edges out to 1.0 of
        # this, and most between.
        "chart_repeats": radii[0] * 1e-3 / (1.2 * SIZE * TEXEL_KM),
        "planet_km": radii[0] * 1e-3,
        "cloud_km": clouds.height * 1e-3 if clouds else 0.0,
        "high_cloud_thickness": _HIGH_CLOUD if clouds else 0.0,
        "tower_km": (clouds.top - clouds.height) * 1e-3 if clouds else 0.0,
        "wave_slope_variance": wave_slope_variance(earth.wind),
        "sea_mirror": mirror_laws(wave_slope_variance(earth.wind)),
    }


def aurora_values(planet: PlanetView, kp: float) -> dict[str, object]:
    """The block for an activity Kp."""
    earth = planet.earth
    maps = np.zeros((2, 4, 4))
    maps[:, :3] = aurora.magnetic_maps()
    longitude = aurora.midnight(np.array(planet.sun_direction_itrf))
    oval = aurora.oval(kp)
    edges = np.zeros((7, 4))
    edges[:, :3] = oval.edges.T
    widest = float(oval.colatitudes(np.linspace(0.0, 24.0, 96)).max())
    edges[0, 3] = np.cos(min(widest + np.radians(3.0), 0.5 * np.pi))
    heights = aurora.HEIGHTS / earth.equatorial_radius
    outside = np.zeros((len(heights), 4))
    outside[:, 0] = planet.outside - heights * (2.0 + heights)
    light = aurora.mean_flux(kp) * aurora.layers().T @ aurora.brightness(earth.bands)
    return {
        "magnetic_north": maps[0],
        "magnetic_south": maps[1],
        "midnight": (np.cos(longitude), np.sin(longitude), 0.0, 0.0),
        "oval_mean": edges[0],
        "oval_waves": edges[1:],
        "layer_outside": outside,
        "aurora_layers": light / np.diff(heights)[:, None],
        "aurora_seed": float(earth.clouds.seed % 1000) if earth.clouds else 0.0,
        "arc_km": _ARC_KM,
        "arc_share": aurora.ARC_SHARE,
        "rim": aurora.RIM,
    }
