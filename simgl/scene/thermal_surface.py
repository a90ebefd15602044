"""Thermal properties of surfaces, of parts, and of what is inside a spacecraft."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from simgl.errors import did_you_mean


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


@dataclass(frozen=True, kw_only=True)
class ThermalNode:
    """What has no surface of its own: a board, a battery, a rod.

    heat_capacity : [J K-1]; power : heat that is released in it [W]
    """

    heat_capacity: float
    power: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ThermalLink:
    """A path of heat between two of the structures of parts and the nodes, by their names.

    conductance : [W K-1]
    radiative_coupling : of radiation, area times emissivity times Gebhart's factor [m2]
    """

    between: tuple[str, str]
    conductance: float = 0.0
    radiative_coupling: float = 0.0


def links_problem(
    parts: Sequence[str], nodes: Mapping[str, ThermalNode], links: Sequence[ThermalLink]
) -> tuple[str, str] | None:
    """What keeps nodes and links from being a network: the key of a model card and the problem.

    A node that no path joins to a part could not give off its heat.
    """
    for name in nodes:
        if name in parts:
            return f"thermal_node.{name}", "has the name of a part"
    known, count = {*parts, *nodes}, Counter(parts)
    joined: dict[str, set[str]] = {name: set() for name in known}
    for index, link in enumerate(links):
        key = f"thermal_link[{index}]"
        for name in link.between:
            if name not in known:
                problem = f'has "{name}", no part or thermal_node; {did_you_mean(name, known)}'
                return f"{key}.between", problem
            if count[name] > 1:
                problem = f'has part "{name}", of which the file has {count[name]}'
                return f"{key}.between", problem
        if link.between[0] == link.between[1]:
            return f"{key}.between", f'joins "{link.between[0]}" with itself'
        sizes = link.conductance, link.radiative_coupling
        if min(sizes) < 0.0 or max(sizes) == 0.0:
            return key, "needs conductance_w_k or radiative_coupling_m2 above 0, and none below"
        first, second = link.between
        joined[first].add(second)
        joined[second].add(first)
    reached = set(parts)
    newest = set(parts)
    while newest:
        newest = set().union(*(joined[name] for name in newest)) - reached
        reached |= newest
    for name in nodes:
        if name not in reached:
            return f"thermal_node.{name}", "is joined to no part by any thermal_link"
    return None
