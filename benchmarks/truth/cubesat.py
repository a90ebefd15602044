"""A CubeSat's temperatures: a published node model of it, and what it measured in orbit."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl

from benchmarks.truth.rows import Row, Table, difference
from tests.thermal.cubesat import (
    IN_FLIGHT,
    PUBLISHED,
    cubesat_body,
    in_orbit,
    under_published_heat,
)

# The published solver is good for 0.12 K, and holds the light of the last 5 s [K].
_SAME_PHYSICS = 0.2
_KINDS = ("mean", "lowest", "highest")


def table(gl: moderngl.Context) -> Table:
    """FUNcube-1 under published heat, and a day of it in simgl's own light against its flight."""
    return Table(
        title="Temperatures of a CubeSat",
        reference="FUNcube-1, 78 nodes by Meijering (2024, MSc thesis, TU Delft) under the same "
        "heat; four panels in flight, 13 August 2024 (samples in his repository), where the goal "
        "is the largest error of his model in that number of the four panels",
        quantity="temperature in the middle of a panel or board over an orbit [K]",
        error="difference [K]",
        rows=[*_published(), *_in_flight(gl)],
    )


def _published() -> Iterator[Row]:
    for name, seen in under_published_heat(cubesat_body()).items():
        for kind, truth, value in zip(_KINDS, PUBLISHED[name], seen, strict=True):
            yield difference(f"{_named(name)}, same heat, {kind}", truth, value, _SAME_PHYSICS)


def _in_flight(gl: moderngl.Context) -> Iterator[Row]:
    """Rows of a kind for all panels, then of the next."""
    day = in_orbit(gl)
    for number, kind in enumerate((*_KINDS, "swing")):
        goal = max(
            abs(_value(PUBLISHED[panel], number) - _value(IN_FLIGHT[panel], number))
            for panel in IN_FLIGHT
        )
        for panel, truth in IN_FLIGHT.items():
            case = f"{_named(panel)}, in flight, {kind}"
            yield difference(case, _value(truth, number), _value(day[panel], number), goal)


def _named(node: str) -> str:
    """``x+A``, the middle of a panel, and ``board_1A`` as words."""
    name = node.removesuffix("A").replace("_", " ")
    return f"panel {name}" if name[-1] in "+-" else name


def _value(statistics: tuple[float, float, float], number: int) -> float:
    """Mean, lowest, highest, or the highest less the lowest."""
    return statistics[number] if number < 3 else statistics[2] - statistics[1]
