"""The ``[lamp.NAME]`` tables: place, beam, power and spectrum."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array
from simgl.config.curve_files import read_curve_file
from simgl.config.path_sandbox import Base
from simgl.config.validation import exactly_one, shown
from simgl.config.value_types import direction
from simgl.errors import ConfigError
from simgl.physics.spectrum import (
    BANDS,
    LONGEST_NM,
    SHORTEST_NM,
    Bands,
    LineSpectrum,
    black_body_light,
    black_body_lines,
    lines_of,
)
from simgl.scenario.schema import LampTable
from simgl.scenario.table_checks import named_spacecraft, place_on
from simgl.scene.lamps import Lamp
from simgl.scene.spacecraft import SpacecraftModel

# Limit of the surface shader's loop and of the shadow atlas.
MAX_LAMPS = 4
# The shadow map is a perspective image of the beam.
WIDEST_DEG = 75.0


def read_lamps(
    where: str,
    tables: dict[str, LampTable],
    models: dict[str, SpacecraftModel],
    base: Base,
    bands: Bands,
) -> dict[str, Lamp]:
    """The lamps of a scenario by name.

    models : by spacecraft name
    base : folder of relative paths
    """
    if len(tables) > MAX_LAMPS:
        problem = f"holds {len(tables)} lamps, at most {MAX_LAMPS} are possible"
        raise ConfigError(where, "lamp", problem)
    return {n: _lamp(f"{where} [lamp.{n}]", n, t, models, base, bands) for n, t in tables.items()}


def _lamp(
    where: str,
    name: str,
    table: LampTable,
    models: dict[str, SpacecraftModel],
    base: Base,
    bands: Bands,
) -> Lamp:
    model = models[named_spacecraft(table.on, models, where, "on")]
    if table.look_at is not None:
        named_spacecraft(table.look_at, models, where, "look_at")
    exactly_one({"look_at": table.look_at, "boresight": table.boresight}, where)
    if table.look_at == table.on:
        raise ConfigError(where, "look_at", "names the spacecraft that carries it")
    outer = table.half_angle_deg + table.edge_deg
    if outer > WIDEST_DEG:
        problem = f"and edge_deg must together stay within {WIDEST_DEG:g}, got {outer:g}"
        raise ConfigError(where, "half_angle_deg", problem)
    power, spectrum = _light(where, table, base, bands)
    position_body, group = place_on(model, table, where)
    return Lamp(
        name=name,
        spacecraft=table.on,
        position_body=position_body,
        group=group,
        boresight_body=direction(table.boresight or (1.0, 0.0, 0.0), where, "boresight"),
        look_at=None
        if table.look_at is None
        else named_spacecraft(table.look_at, models, where, "look_at"),
        power=power,
        spectrum=spectrum,
        half_angle=np.radians(table.half_angle_deg),
        edge=np.radians(table.edge_deg),
        radius=table.radius_m,
    )


def _light(
    where: str, table: LampTable, base: Base, bands: Bands
) -> tuple[Array, LineSpectrum | None]:
    """(4,) power in each band [W], and the spectrum where it is known within the bands."""
    keys = ("wavelength_nm", "temperature_k", "band_shares")
    spectra = [k for k in keys if getattr(table, k) is not None]
    if table.line_weights is not None and not isinstance(table.wavelength_nm, list):
        raise ConfigError(where, "line_weights", "requires a list of lines in wavelength_nm")
    if isinstance(table.power_w, tuple):
        if spectra:
            problem = "contradicts power_w for each band; give power_w as one number"
            raise ConfigError(where, spectra[0], problem)
        _refuse_negative(where, "power_w", table.power_w)
        return np.array(bands.power_of_rgbn(table.power_w)), None
    _refuse_negative(where, "power_w", (table.power_w,))
    if len(spectra) != 1:
        given = " and ".join(spectra) if spectra else "none of them"
        problem = f"as one number needs wavelength_nm, temperature_k or band_shares; got {given}"
        raise ConfigError(where, "power_w", problem)
    if table.wavelength_nm is not None:
        spectrum = _line_spectrum(where, table.wavelength_nm, table.line_weights, base, bands)
        return table.power_w * spectrum.band_shares(bands), spectrum
    if table.temperature_k is not None:
        power = black_body_light(table.power_w, table.temperature_k, bands).irradiance
        return power, black_body_lines(table.temperature_k, bands).through_filter(bands)
    assert table.band_shares is not None
    if sum(table.band_shares) > 1.0 + 1e-9:
        problem = f"must add up to at most 1, got {sum(table.band_shares):g}"
        raise ConfigError(where, "band_shares", problem)
    return table.power_w * np.array(bands.power_of_rgbn(table.band_shares)), None


def _line_spectrum(
    where: str,
    given: float | list[float] | str,
    weights: list[float] | None,
    base: Base,
    bands: Bands,
) -> LineSpectrum:
    """Of a line [nm], of several, or of a file: what passes the filter of the bands."""
    if isinstance(given, str):
        return _curve_spectrum(where, given, base, bands)
    lines = given if isinstance(given, list) else [given]
    weights = [1.0] * len(lines) if weights is None else weights
    if len(weights) != len(lines) or not lines:
        problem = f"needs one number for each of {len(lines)} lines, got {len(weights)}"
        raise ConfigError(where, "line_weights", problem)
    low, high = (400.0, 1000.0) if bands == BANDS else (SHORTEST_NM, LONGEST_NM)
    for line in lines:
        if not low <= line <= high:
            problem = f"must lie in {low:g}..{high:g}, got {line:g}"
            raise ConfigError(where, "wavelength_nm", problem)
    share = np.array(weights) / sum(weights)
    spectrum = LineSpectrum(wavelength=np.array(lines) * 1e-9, share=share).through_filter(bands)
    if not spectrum.band_shares(bands).any():
        problem = f"must have a line in [bands] ({bands.edges_nm}), got {shown(lines)}"
        raise ConfigError(where, "wavelength_nm", problem)
    return spectrum


def _curve_spectrum(where: str, name: str, base: Base, bands: Bands) -> LineSpectrum:
    file, wavelength, power = read_curve_file(name, base, where, "wavelength_nm")
    if not all(0.0 <= value < np.inf for value in power) or not any(power):
        raise ConfigError(str(file), "power", "must be 0 or more, and more somewhere")
    spectrum = lines_of(np.array(wavelength) * 1e-9, np.array(power), bands).through_filter(bands)
    if not spectrum.band_shares(bands).any():
        within = "400..1000 nm" if bands == BANDS else f"[bands] ({bands.edges_nm})"
        raise ConfigError(str(file), "power", f"must not be 0 all over {within}")
    return spectrum


def _refuse_negative(where: str, key: str, values: tuple[float, ...]) -> None:
    for value in values:
        if value < 0.0:
            raise ConfigError(where, key, f"must not be negative, got {value:g}")
