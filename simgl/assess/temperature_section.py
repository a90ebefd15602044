"""A target's temperatures along a run, for a report of a scenario with a thermal camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simgl.arrays import Array
from simgl.assess.time_plots import TimePlot
from simgl.assess.trajectory_assessment import Assignment
from simgl.figures.heat_map import part_temperatures, write_heat_map, write_temperatures
from simgl.figures.html_page import plot_source, png_source
from simgl.figures.style import BLUE, GREEN, INK, ORANGE, PURPLE, RED, SKY, SOFT, figure_style
from simgl.sequence.journal import Row
from simgl.simulator import Simulator
from simgl.thermal.body import ThermalBody
from simgl.thermal.history import ThermalState

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Parts of the largest area that a plot tells apart.
_COLOURS = RED, BLUE, GREEN, ORANGE, PURPLE, SKY


@dataclass(frozen=True, kw_only=True)
class TemperatureSection:
    """What the page shows.

    plot, heat_map : images as sources of the page
    warmest, warmest_ns, coldest, coldest_ns : of the target's surface [K], and when [TAI ns]
    history : how the temperatures came about
    """

    plot: str
    heat_map: str
    warmest: float
    warmest_ns: int
    coldest: float
    coldest_ns: int
    history: str


def temperature_section(
    work: Assignment, rows: Sequence[Row], simulator: Simulator, folder: Path
) -> TemperatureSection | None:
    """The target's temperatures at the run's epochs; None for a scenario without thermal cameras.

    Writes temperatures.csv and heat_map.png, of the epoch of the warmest surface, to the folder.
    """
    if all(camera.thermal is None for camera in work.scenario.cameras.values()):
        return None
    body = simulator.thermal_bodies.of(work.target, work.scenario.models[work.target])
    epochs = [int(row["tai_ns"] or 0) for row in rows]
    states = [simulator.temperatures.at(tai_ns)[work.target] for tai_ns in epochs]
    of_parts = np.stack([part_temperatures(body, state) for state in states])
    write_temperatures(folder / "temperatures.csv", body, states)
    lowest, highest = np.nanmin(of_parts[..., 0], axis=1), np.nanmax(of_parts[..., 2], axis=1)
    cold, hot = int(lowest.argmin()), int(highest.argmax())
    write_heat_map(folder / "heat_map.png", body, states[hot])
    return TemperatureSection(
        plot=plot_source(_plot(rows, body, of_parts)),
        heat_map=png_source((folder / "heat_map.png").read_bytes()),
        warmest=float(highest[hot]),
        warmest_ns=epochs[hot],
        coldest=float(lowest[cold]),
        coldest_ns=epochs[cold],
        history=_history(states),
    )


def _history(states: Sequence[ThermalState]) -> str:
    return ", ".join(dict.fromkeys(state.history for state in states))


def _plot(rows: Sequence[Row], body: ThermalBody, of_parts: Array) -> Figure:
    """Mean temperatures of the largest parts, and from the lowest to the highest of all.

    of_parts : (rows, parts, 4) of ``part_temperatures``
    """
    area = np.bincount(body.part, body.patches.areas, minlength=of_parts.shape[1])
    shown = [p for p in np.argsort(-area, kind="stable") if np.isfinite(of_parts[0, p, 1])]
    with figure_style():
        plot = TimePlot(rows, (), 2)
        surfaces, structures = plot.panels
        low, high = np.nanmin(of_parts[..., 0], axis=1), np.nanmax(of_parts[..., 2], axis=1)
        plot.band(surfaces, low, high, SOFT)
        marker = "o" if len(rows) < 40 else ""
        for part, colour in zip(shown, _COLOURS, strict=False):
            name = body.part_names[part]
            for panel, kind in ((surfaces, 1), (structures, 3)):
                values = of_parts[:, part, kind]
                panel.plot(plot.minutes, values, color=colour, label=name, marker=marker)
        surfaces.set_ylabel("surface [K]")
        structures.set_ylabel("structure [K]")
        surfaces.legend(loc="upper center", bbox_to_anchor=(0.5, 1.25), ncols=6, labelcolor=INK)
        return plot.finish()
