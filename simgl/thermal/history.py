"""Temperatures along a trajectory: a pure function of the start and of the light since."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from simgl.arrays import Array
from simgl.errors import SimglError
from simgl.progress import ProgressCallback, silent
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.thermal.body import ThermalBody
from simgl.thermal.heat_loads import HeatLoads, heat_loads
from simgl.thermal.sky_light import Skies, SkyLight

Start = Literal["steady", "periodic"]

# A span is repeated until its ends agree to this, at most so often.
_SETTLED = 0.05  # [K]
_MAX_PERIODS = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalState:
    """Temperatures of a body at an epoch.

    temperatures : (n,) of its nodes [K]
    sunlight : (p,) on its patches now, from outside [W m-2]
    heat : (n,) that its nodes absorb now, and internal power [W]
    history : how they came about: "steady" without a history, else "periodic" or "steady" start
    digest : hash of all that they depend on: the network, the start, and the light at each epoch
    """

    tai_ns: int
    temperatures: Array
    sunlight: Array
    heat: Array
    history: str
    digest: str


def steady_state(body: ThermalBody, state: SceneState, sky: SkyLight) -> ThermalState:
    """What a body's temperatures would be, had the scene stood as it is for ever.

    sky : its heat (``Skies.heat``)
    """
    return steady_under(body, heat_loads(body, state, sky), state.tai_ns)


def steady_under(
    body: ThermalBody, loads: HeatLoads, tai_ns: int, start: Array | None = None
) -> ThermalState:
    """The same under known heat; start : (n,) first guess [K]."""
    return ThermalState(
        tai_ns=tai_ns,
        temperatures=body.network.steady(loads.heat, start),
        sunlight=loads.sunlight,
        heat=loads.heat,
        history="steady",
        digest=_digest(body.network.digest, b"steady", loads.heat),
    )


def advanced_under(
    body: ThermalBody, before: ThermalState, loads: HeatLoads, tai_ns: int
) -> ThermalState:
    """The state at a later time; the light changes evenly from one end to the other.

    Raises SimglError for a time that is not later.
    """
    seconds = 1e-9 * (tai_ns - before.tai_ns)
    if seconds <= 0.0:
        raise SimglError(f"temperatures go on from an earlier time, not from {-seconds:g} s later")
    history = before.history if " " in before.history else f"from the {before.history} state"
    return ThermalState(
        tai_ns=tai_ns,
        temperatures=body.network.step(before.temperatures, before.heat, loads.heat, seconds),
        sunlight=loads.sunlight,
        heat=loads.heat,
        history=history,
        digest=_digest(before.digest, repr(seconds).encode(), loads.heat),
    )


def thermal_history(
    body: ThermalBody,
    scenario: Scenario,
    epochs: Sequence[int],
    skies: Skies,
    start: Start = "steady",
    progress: ProgressCallback | None = None,
) -> Iterator[ThermalState]:
    """A body's state at each epoch, the first included.

    epochs : [TAI ns], increasing; between them light changes evenly
    skies : those of a simulator (``Simulator.skies``), or ``EmptySkies`` without an Earth
    start : the steady state of the first epoch, or the state that comes back when the span repeats
    """
    report = silent if progress is None else progress
    ends = list(epochs)
    loads = []
    for number, end in enumerate(ends):
        state = scenario.at(end)
        loads.append(heat_loads(body, state, skies.heat(state, body.name)))
        report(number + 1, len(ends))
    first = loads[0]
    if start == "periodic":
        seconds = [1e-9 * (b - a) for a, b in pairwise(ends)]
        heats = [one.heat for one in loads]
        temperatures = _periodic(body, heats, seconds)
        key = hashlib.blake2b(body.network.digest.encode() + heats[0].tobytes(), digest_size=16)
        for heat, length in zip(heats[1:], seconds, strict=True):
            key.update(heat.tobytes() + repr(length).encode())
        digest = key.hexdigest()
    else:
        temperatures = body.network.steady(first.heat)
        digest = _digest(body.network.digest, b"steady", first.heat)
    reached = ThermalState(
        tai_ns=ends[0],
        temperatures=temperatures,
        sunlight=first.sunlight,
        heat=first.heat,
        history=start,
        digest=digest,
    )
    yield reached
    for light, end in zip(loads[1:], ends[1:], strict=True):
        reached = advanced_under(body, reached, light, end)
        yield reached


def _periodic(body: ThermalBody, heats: Sequence[Array], seconds: Sequence[float]) -> Array:
    """(n,) temperatures that come back after the span [K].

    Starts from the steady state under the mean heat, which is near for slow nodes.
    """
    if not seconds:
        raise SimglError("a periodic start needs at least one step")
    steps = [(*ends, length) for ends, length in zip(pairwise(heats), seconds, strict=True)]
    mean = np.average([0.5 * (a + b) for a, b, _ in steps], axis=0, weights=seconds)
    t = body.network.steady(mean)
    change = np.inf
    for _ in range(_MAX_PERIODS):
        before = t
        for a, b, length in steps:
            t = body.network.step(t, a, b, length)
        change = float(np.max(np.abs(t - before)))
        if change < _SETTLED:
            return t
    raise SimglError(f"temperatures still change by {change:.2g} K from one span to the next")


def _digest(before: str, label: bytes, heat: Array) -> str:
    digest = hashlib.blake2b(before.encode(), digest_size=16)
    digest.update(label + heat.tobytes())
    return digest.hexdigest()
