"""The ``[sun]``, ``[earth]`` and ``[sky]`` tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.config.path_sandbox import Base
from simgl.config.value_types import direction, fractions
from simgl.errors import AssetError, ConfigError
from simgl.physics.atmosphere import ATMOSPHERES, STANDARD, Air
from simgl.physics.band_air import air_in_bands
from simgl.physics.constants import ASTRONOMICAL_UNIT, SOLAR_CONSTANT, SOLAR_RADIUS
from simgl.physics.solar_disc import UNIFORM, astm_g173_light, limb_darkening
from simgl.physics.spectrum import BANDS, Bands, black_body_light
from simgl.scenario.scenario import EphemerisSun
from simgl.scenario.schema import CloudsTable, EarthTable, SkyTable, SunTable
from simgl.scene.earth import Clouds, Earth, EarthMaps, MapImage, load_map
from simgl.scene.star_catalogue import FAINTEST, StarCatalogue, shipped_stars
from simgl.scene.state import SunInDirection

# Keys of an Earth with maps; one with a given albedo, or none, does not have them.
_MAP_KEYS = (
    "wind_m_s",
    "moonlight",
    "airglow",
    "airglow_waves",
    "aurora_kp",
    "clouds",
    "ice_and_snow",
    "land_picture",
    "water_picture",
    "night_picture",
)


def read_sun(
    table: SunTable, temperature: float, where: str, bands: Bands
) -> EphemerisSun | SunInDirection:
    """The Sun of a scenario; temperature of its spectrum [K]."""
    total = SOLAR_CONSTANT if table.irradiance_w_m2 is None else table.irradiance_w_m2
    if table.spectrum == "astm_g173":
        if table.temperature_k is not None:
            raise ConfigError(where, "temperature_k", 'contradicts spectrum = "astm_g173"')
        light = astm_g173_light(total, bands)
    else:
        light = black_body_light(total, temperature, bands)
    # A disc whose size or direction is given is uniform, as in textbook cases.
    given = table.angular_diameter_deg is not None or table.direction_icrf is not None
    darkened = not given if table.limb_darkening is None else table.limb_darkening
    limb = limb_darkening(temperature, bands) if darkened else UNIFORM
    radius = SOLAR_RADIUS
    if table.angular_diameter_deg is not None:
        radius = ASTRONOMICAL_UNIT * np.sin(np.radians(0.5 * table.angular_diameter_deg))
    if table.direction_icrf is None:
        return EphemerisSun(light_at_1_au=light, radius=radius, visible=table.visible, limb=limb)
    return SunInDirection(
        direction_icrf=direction(table.direction_icrf, where, "direction_icrf"),
        light=light,
        angular_radius=float(np.arcsin(radius / ASTRONOMICAL_UNIT)),
        visible=table.visible,
        limb=limb,
    )


def read_earth(
    table: EarthTable, where: str, base: Base, sun: EphemerisSun | SunInDirection
) -> Earth | None:
    """The Earth of a scenario; None in deep space. Relative paths start at ``base``."""
    if table.radius_km is not None and table.shape != "sphere":
        raise ConfigError(where, "radius_km", f'requires shape = "sphere", got "{table.shape}"')
    albedo = None if table.albedo is None else fractions(table.albedo, where, "albedo")
    if table.longwave_w_m2 is not None and albedo is None:
        problem = "requires albedo; an Earth with maps has a climate and clouds"
        raise ConfigError(where, "longwave_w_m2", problem)
    if table.shape == "none":
        if albedo is not None:
            raise ConfigError(where, "albedo", 'requires an Earth, got shape = "none"')
        if table.atmosphere is not None:
            raise ConfigError(where, "atmosphere", 'requires an Earth, got shape = "none"')
        _refuse_map_keys(table, where, 'shape = "none"')
        return None
    default = "standard" if table.shape == "wgs84" else "none"
    bands = sun.bands
    air = _air_of(table.atmosphere or default, bands, where)
    if albedo is not None:
        _refuse_map_keys(table, where, "albedo")
        earth = Earth(
            bands=bands, albedo=bands.of_rgbn(albedo), air=air, longwave=table.longwave_w_m2
        )
    else:
        wind, clouds, maps = _read_maps(table, where, base)
        frost = maps.land is None if table.ice_and_snow is None else table.ice_and_snow
        earth = Earth(
            bands=bands,
            air=air,
            wind=wind,
            wind_varies=table.wind_m_s is None,
            clouds=clouds,
            maps=maps,
            frost=frost,
        )
        earth = _at_night(earth, table, where, fixed_sun=isinstance(sun, SunInDirection))
    if table.shape == "sphere":
        if table.radius_km is None:
            raise ConfigError(where, "radius_km", 'is missing; shape = "sphere" needs it')
        radius = table.radius_km * 1e3
        return replace(earth, equatorial_radius=radius, polar_radius=radius)
    return earth


def _air_of(name: str, bands: Bands, where: str) -> Air | None:
    """Air by its name; None for none."""
    air = ATMOSPHERES.get(name)
    if bands == BANDS or air is None:
        return air
    if air != STANDARD:
        problem = f'must be "standard" or "none" with [bands], got "{name}"'
        raise ConfigError(where, "atmosphere", f"{problem}: it is known in R, G, B and N alone")
    return air_in_bands(bands)


def _at_night(earth: Earth, table: EarthTable, where: str, *, fixed_sun: bool) -> Earth:
    """The Earth with moonlight and airglow; with a fixed Sun only where they are asked for."""
    if table.moonlight and fixed_sun:
        raise ConfigError(where, "moonlight", "requires a Moon; a scene with a fixed Sun has none")
    if table.airglow and earth.air is None:
        raise ConfigError(where, "airglow", "requires an atmosphere, got none")
    airglow = earth.air is not None and not fixed_sun
    return replace(
        earth,
        moonlight=not fixed_sun if table.moonlight is None else table.moonlight,
        airglow=airglow if table.airglow is None else table.airglow,
        airglow_waves=table.airglow_waves or 0.0,
        aurora_kp=table.aurora_kp,
    )


def read_sky(
    table: SkyTable, where: str, sun: EphemerisSun | SunInDirection
) -> StarCatalogue | None:
    """The stars of a scene; None for a sky without them."""
    # A fixed Sun makes a test scene: no Moon, and stars only where they are asked for.
    stars = not isinstance(sun, SunInDirection) if table.stars is None else table.stars
    if stars:
        faintest = FAINTEST if table.faintest_star_mag is None else table.faintest_star_mag
        return shipped_stars(faintest, bands=sun.bands)
    if table.faintest_star_mag is not None:
        problem = "requires stars = true; by default, a scene with a fixed Sun has no stars"
        raise ConfigError(where, "faintest_star_mag", problem)
    return None


def _refuse_map_keys(table: EarthTable, where: str, because: str) -> None:
    """Raise ConfigError for keys that only an Earth with maps has."""
    for key in _MAP_KEYS:
        if getattr(table, key) is not None:
            raise ConfigError(where, key, f"requires an Earth with maps, got {because}")


def _read_maps(table: EarthTable, where: str, base: Base) -> tuple[float, Clouds | None, EarthMaps]:
    """Wind [m s-1], clouds and maps; relative paths start at ``base``."""
    wind = Earth.wind if table.wind_m_s is None else table.wind_m_s
    maps = EarthMaps(
        land=_map_image(table.land_picture, where, "land_picture", "RGB", base),
        water=_map_image(table.water_picture, where, "water_picture", "L", base),
        night=_map_image(table.night_picture, where, "night_picture", "L", base),
    )
    return wind, _clouds(table.clouds or CloudsTable(), f"{where[:-1]}.clouds]", base), maps


def _clouds(table: CloudsTable, where: str, base: Base) -> Clouds | None:
    if table.picture is None:
        if table.optical_thickness is not None:
            raise ConfigError(where, "optical_thickness", "requires picture, which is missing")
        if table.cover == 0.0:
            return None
        return Clouds(
            cover=Clouds.cover if table.cover is None else table.cover,
            seed=Clouds.seed if table.seed is None else table.seed,
            height=table.height_km * 1e3,
        )
    for key in ("cover", "seed"):
        if getattr(table, key) is not None:
            raise ConfigError(where, key, "contradicts picture, which says where clouds are")
    thickness = table.optical_thickness
    return Clouds(
        image=_map_image(table.picture, where, "picture", "L", base),
        height=table.height_km * 1e3,
        thickness=Clouds.thickness if thickness is None else thickness,
    )


def _map_image(name: str | None, where: str, key: str, mode: str, base: Base) -> MapImage | None:
    if name is None:
        return None
    try:
        return load_map(base / name, mode)
    except AssetError as error:
        raise ConfigError(where, key, str(error)) from None
