"""Heat in model cards: of parts, of what is inside them, and the paths between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from simgl.config.validation import convert
from simgl.config.value_types import NonNegative, Positive, Table
from simgl.errors import ConfigError, did_you_mean
from simgl.model_files.surface_tables import ThermalSurfaceTable
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.thermal_surface import ThermalLink, ThermalNode, ThermalPart, links_problem


class ThermalPartTable(Table, frozen=True, kw_only=True):
    """Heat in a part's structure, and what its skin is in place of what its materials say."""

    power_w: NonNegative = 0.0
    heat_capacity_j_k: Positive | None = None
    sheet_conductance_w_k: NonNegative | None = None
    surface: ThermalSurfaceTable | None = None


class ThermalNodeTable(Table, frozen=True, kw_only=True):
    """What has no surface: a board, a battery, a rod."""

    heat_capacity_j_k: Positive
    power_w: NonNegative = 0.0


class ThermalLinkTable(Table, frozen=True, kw_only=True):
    """A path of heat between two structures of parts or nodes: conduction, radiation or both."""

    between: tuple[str, str]
    conductance_w_k: NonNegative = 0.0
    radiative_coupling_m2: NonNegative = 0.0


def read_thermal(
    model: SpacecraftModel,
    parts: Mapping[str, Any],
    nodes: Mapping[str, Any],
    links: Sequence[ThermalLinkTable],
    where: str,
) -> SpacecraftModel:
    """A model with the thermal tables of its card; raises ConfigError with one line.

    parts, nodes : tables of ``ThermalPartTable`` and ``ThermalNodeTable``, not yet read
    """
    for name in parts:
        if name not in model.parts:
            problem = f"names no part; {did_you_mean(name, model.parts)}"
            raise ConfigError(where, f"thermal.{name}", problem)
    made = replace(
        model,
        thermal={
            name: _part(convert(given, ThermalPartTable, f"{where} [thermal.{name}]"))
            for name, given in parts.items()
        },
        thermal_nodes={
            name: _node(convert(given, ThermalNodeTable, f"{where} [thermal_node.{name}]"))
            for name, given in nodes.items()
        },
        thermal_links=tuple(
            ThermalLink(
                between=table.between,
                conductance=table.conductance_w_k,
                radiative_coupling=table.radiative_coupling_m2,
            )
            for table in links
        ),
    )
    problem_of = links_problem(made.parts, made.thermal_nodes, made.thermal_links)
    if problem_of is not None:
        raise ConfigError(where, *problem_of)
    return made


def _part(table: ThermalPartTable) -> ThermalPart:
    return ThermalPart(
        power=table.power_w,
        heat_capacity=table.heat_capacity_j_k,
        sheet_conductance=table.sheet_conductance_w_k,
        surface=None if table.surface is None else table.surface.surface(),
    )


def _node(table: ThermalNodeTable) -> ThermalNode:
    return ThermalNode(heat_capacity=table.heat_capacity_j_k, power=table.power_w)
