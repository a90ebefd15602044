"""The ``[lamp.NAME]`` tables: place, beam, power and spectrum."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.config.value_types import direction
from simgl.errors import ConfigError
from simgl.physics.spectrum import black_body_light
from simgl.scenario.schema import LampTable
from simgl.scenario.table_checks import named_spacecraft, place_on
from simgl.scene.lamps import Lamp
from simgl.scene.spacecraft import SpacecraftModel

# Limit of the surface shader's loop and of the shadow atlas.
MAX_LAMPS = 4
# The shadow map is a perspective image of the beam.
WIDEST_DEG = 75.0


def read_lamps(
    where: str, tables: dict[str, LampTable], models: dict[str, SpacecraftModel]
) -> dict[str, Lamp]:
    """The lamps of a scenario by name; models by spacecraft name."""
    if len(tables) > MAX_LAMPS:
        problem = f"holds {len(tables)} lamps, at most {MAX_LAMPS} are possible"
        raise ConfigError(where, "lamp", problem)
    return {n: _lamp(f"{where} [lamp.{n}]", n, t, models) for n, t in tables.items()}


def _lamp(where: str, name: str, table: LampTable, models: dict[str, SpacecraftModel]) -> Lamp:
    model = models[named_spacecraft(table.on, models, where, "on")]
    if table.look_at is not None:
        named_spacecraft(table.look_at, models, where, "look_at")
    if (table.look_at is None) == (table.boresight is None):
        raise ConfigError(where, "look_at", "or boresight is needed, and not both")
    if table.look_at == table.on:
        raise ConfigError(where, "look_at", "names the spacecraft that carries it")
    outer = table.half_angle_deg + table.edge_deg
    if outer > WIDEST_DEG:
        problem = f"and edge_deg must together stay within {WIDEST_DEG:g}, got {outer:g}"
        raise ConfigError(where, "half_angle_deg", problem)
    return Lamp(
        name=name,
        spacecraft=table.on,
        position_body=place_on(model, table, where),
        boresight_body=direction(table.boresight or (1.0, 0.0, 0.0), where, "boresight"),
        look_at=None
        if table.look_at is None
        else named_spacecraft(table.look_at, models, where, "look_at"),
        power=_power(where, table),
        half_angle=np.radians(table.half_angle_deg),
        edge=np.radians(table.edge_deg),
        radius=table.radius_m,
    )


def _power(where: str, table: LampTable) -> Array:
    """(4,) [W] in each band."""
    spectra = [k for k in ("temperature_k", "band_shares") if getattr(table, k) is not None]
    if isinstance(table.power_w, tuple):
        if spectra:
            problem = "contradicts power_w for each band; give power_w as one number"
            raise ConfigError(where, spectra[0], problem)
        _refuse_negative(where, "power_w", table.power_w)
        return np.array(table.power_w)
    _refuse_negative(where, "power_w", (table.power_w,))
    if len(spectra) != 1:
        given = " and ".join(spectra) if spectra else "neither of them"
        problem = f"as one number needs temperature_k or band_shares; got {given}"
        raise ConfigError(where, "power_w", problem)
    if table.temperature_k is not None:
        return black_body_light(table.power_w, table.temperature_k).irradiance
    assert table.band_shares is not None
    if sum(table.band_shares) > 1.0 + 1e-9:
        problem = f"must add up to at most 1, got {sum(table.band_shares):g}"
        raise ConfigError(where, "band_shares", problem)
    return table.power_w * np.array(table.band_shares)


def _refuse_negative(where: str, key: str, values: tuple[float, ...]) -> None:
    for value in values:
        if value < 0.0:
            raise ConfigError(where, key, f"must not be negative, got {value:g}")
