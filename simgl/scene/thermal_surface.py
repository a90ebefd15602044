"""Thermal properties of surfaces and parts: what temperatures need to know of a spacecraft."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ThermalSurface:
    """A surface and the skin that it covers.

    solar_absorptance : share of sunlight that it absorbs
    infrared_emissivity : hemispherical, at its temperature
    heat_capacity : of the skin [J m-2 K-1]
    conductance : from the skin to the structure of its part [W m-2 K-1]
    """

    solar_absorptance: float
    infrared_emissivity: float
    heat_capacity: float
    conductance: float


@dataclass(frozen=True, kw_only=True)
class ThermalPart:
    """A part's structure: one node, which its skin conducts to, and what differs in its skin.

    power : heat that is released in it [W]
    heat_capacity : of the structure [J K-1]; None for the default by its area
    sheet_conductance : of its skin along itself, conductivity times thickness [W K-1]
    surface : in place of what its materials give
    """

    power: float = 0.0
    heat_capacity: float | None = None
    sheet_conductance: float | None = None
    surface: ThermalSurface | None = None
