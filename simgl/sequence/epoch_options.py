"""Options of the command line that choose the epochs of a trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import typer


class Event(StrEnum):
    """An event along a trajectory.

    ECLIPSE_ENTRY : the target's sunlight falls below 99 %, behind the Earth or its atmosphere
    UMBRA_ENTRY : the target's sunlight falls below 1 %
    UMBRA_EXIT, ECLIPSE_EXIT : it rises above these limits again
    SUN_IN_VIEW : the Sun's disc enters the image
    LIMB_BEHIND_TARGET : the Earth's limb passes behind the target, as seen by the camera
    """

    ECLIPSE_ENTRY = "eclipse_entry"
    UMBRA_ENTRY = "umbra_entry"
    UMBRA_EXIT = "umbra_exit"
    ECLIPSE_EXIT = "eclipse_exit"
    SUN_IN_VIEW = "sun_in_view"
    LIMB_BEHIND_TARGET = "limb_behind_target"


@dataclass(frozen=True, kw_only=True)
class SpanOptions:
    """A span of time as asked for.

    start, stop : UTC; the scenario's epoch if no start is given
    duration : instead of a stop [s]
    """

    start: Annotated[
        str | None,
        typer.Option("--from", help="First epoch in UTC; the scenario's epoch if not given."),
    ] = None
    stop: Annotated[str | None, typer.Option("--to", help="Last epoch in UTC.")] = None
    duration: Annotated[float | None, typer.Option(help="Length in seconds, instead of --to.")] = (
        None
    )


@dataclass(frozen=True, kw_only=True)
class EpochOptions(SpanOptions):
    """Epochs as asked for; exactly one of step, count, random and an event says how.

    step : between frames [s]
    count : frames spread over the span
    random : frames at random in the span, by ``seed``
    """

    step: Annotated[float | None, typer.Option(help="Seconds between epochs.")] = None
    count: Annotated[int | None, typer.Option(help="Number of epochs at equal steps.")] = None
    random: Annotated[int | None, typer.Option(help="Number of epochs drawn at random.")] = None
    seed: Annotated[int, typer.Option(min=0, help="Seed of --random.")] = 0


@dataclass(frozen=True, kw_only=True)
class EventOptions:
    """An event as asked for.

    target : spacecraft that it is about; the first if None
    search_step : between the epochs at which the scene is looked at [s]
    """

    event: Annotated[Event | None, typer.Option(help="Epochs at which this event begins.")] = None
    target: Annotated[
        str | None, typer.Option(help="Spacecraft that --event is about; the first if not given.")
    ] = None
    search_step: Annotated[
        float, typer.Option(help="Step in seconds of the search for --event.")
    ] = 10.0
