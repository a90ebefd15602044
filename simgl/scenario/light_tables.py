"""The ``[sun]``, ``[earth]`` and ``[sky]`` tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simgl.config.path_sandbox import Base
from simgl.config.value_types import direction, fractions
from simgl.errors import ConfigError
from simgl.physics.atmosphere import ATMOSPHERES
from simgl.physics.constants import ASTRONOMICAL_UNIT, SOLAR_CONSTANT, SOLAR_RADIUS
from simgl.physics.solar_disc import UNIFORM, astm_g173_light, limb_darkening
from simgl.physics.spectrum import black_body_light
from simgl.scenario.earth_tables import read_ground, refuse_ground
from simgl.scenario.scenario import EphemerisSun
from simgl.scenario.schema import EarthTable, SkyTable, SunTable
from simgl.scene.earth import Earth
from simgl.scene.star_catalogue import StarCatalogue, shipped_stars
from simgl.scene.state import SunInDirection


def read_sun(table: SunTable, temperature: float, where: str) -> EphemerisSun | SunInDirection:
    """The Sun of a scenario; temperature of its spectrum [K]."""
    total = SOLAR_CONSTANT if table.irradiance_w_m2 is None else table.irradiance_w_m2
    if table.spectrum == "astm_g173":
        if table.temperature_k is not None:
            raise ConfigError(where, "temperature_k", 'contradicts spectrum = "astm_g173"')
        light = astm_g173_light(total)
    else:
        light = black_body_light(total, temperature)
    # A disc that is given by hand is the uniform one of textbook cases.
    by_hand = table.angular_diameter_deg is not None or table.direction_icrf is not None
    darkened = not by_hand if table.limb_darkening is None else table.limb_darkening
    limb = limb_darkening(temperature) if darkened else UNIFORM
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
        raise ConfigError(where, "radius_km", f'goes with shape = "sphere", got "{table.shape}"')
    albedo = None if table.albedo is None else fractions(table.albedo, where, "albedo")
    if table.shape == "none":
        if albedo is not None:
            raise ConfigError(where, "albedo", 'goes with an Earth, got shape = "none"')
        if table.atmosphere is not None:
            raise ConfigError(where, "atmosphere", 'goes with an Earth, got shape = "none"')
        refuse_ground(table, where, 'shape = "none"')
        return None
    default = "standard" if table.shape == "wgs84" else "none"
    air = ATMOSPHERES.get(table.atmosphere or default)
    if albedo is not None:
        refuse_ground(table, where, "albedo")
        earth = Earth(albedo=albedo, air=air)
    else:
        wind, clouds, maps = read_ground(table, where, base)
        earth = Earth(air=air, wind=wind, clouds=clouds, maps=maps)
        earth = _at_night(earth, table, where, by_hand=isinstance(sun, SunInDirection))
    if table.shape == "sphere":
        if table.radius_km is None:
            raise ConfigError(where, "radius_km", 'is missing; shape = "sphere" needs it')
        radius = table.radius_km * 1e3
        return replace(earth, equatorial_radius=radius, polar_radius=radius)
    return earth


def _at_night(earth: Earth, table: EarthTable, where: str, *, by_hand: bool) -> Earth:
    """The Earth with what lights it at night: under a Sun fixed by hand, what is asked for."""
    if table.moonlight and by_hand:
        raise ConfigError(where, "moonlight", "goes with a Moon, which a Sun fixed by hand has not")
    if table.airglow and earth.air is None:
        raise ConfigError(where, "airglow", "goes with an atmosphere, got none")
    airglow = earth.air is not None and not by_hand
    return replace(
        earth,
        moonlight=not by_hand if table.moonlight is None else table.moonlight,
        airglow=airglow if table.airglow is None else table.airglow,
    )


def read_sky(table: SkyTable, sun: EphemerisSun | SunInDirection) -> StarCatalogue | None:
    """The stars of a scene; None for a sky without them."""
    if table.stars is False:
        return None
    # A Sun fixed by hand makes a laboratory of the scene: no Moon, and no stars unless asked for.
    if table.stars is None and isinstance(sun, SunInDirection):
        return None
    return shipped_stars(table.faintest_star_mag)
