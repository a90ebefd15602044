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
from simgl.thermal.heat_loads import heat_loads

Start = Literal["steady", "periodic"]

# A span is repeated until its ends agree to this, at most so often.
_SETTLED = 0.05  # [K]
_MAX_PERIODS = 60


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalState:
    """Temperatures of a body at an epoch.

    temperatures : (n,) of its nodes [K]
    history : how they came about: "steady" without a history, else "periodic" or "steady" start
    digest : hash of all that they depend on: the network, the start, and each step's light
    """

    tai_ns: int
    temperatures: Array
    history: str
    digest: str


def steady_state(body: ThermalBody, state: SceneState) -> ThermalState:
    """What a body's temperatures would be, had the scene stood as it is for ever."""
    heat = heat_loads(body, state).heat
    return ThermalState(
        tai_ns=state.tai_ns,
        temperatures=body.network.steady(heat),
        history="steady",
        digest=_digest(body.network.digest, b"steady", heat),
    )


def advanced(body: ThermalBody, before: ThermalState, heat: Array, tai_ns: int) -> ThermalState:
    """The state at a later epoch.

    heat : (n,) mean over the time between [W]
    """
    seconds = 1e-9 * (tai_ns - before.tai_ns)
    history = before.history if " " in before.history else f"from the {before.history} state"
    return ThermalState(
        tai_ns=tai_ns,
        temperatures=body.network.step(before.temperatures, heat, seconds),
        history=history,
        digest=_digest(before.digest, repr(seconds).encode(), heat),
    )


def thermal_history(
    body: ThermalBody,
    scenario: Scenario,
    epochs: Sequence[int],
    start: Start = "steady",
    progress: ProgressCallback | None = None,
) -> Iterator[ThermalState]:
    """A body's state at each epoch, the first included.

    epochs : [TAI ns], increasing; the implicit steps between them take the light of their middles
    start : the steady state of the first epoch, or the state that comes back when the span repeats
    """
    report = silent if progress is None else progress
    ends = list(epochs)
    middles = [(a + b) // 2 for a, b in pairwise(ends)]
    heats = []
    for number, middle in enumerate(middles):
        heats.append(heat_loads(body, scenario.at(middle)).heat)
        report(number + 1, len(middles))
    state = steady_state(body, scenario.at(ends[0]))
    if start == "periodic":
        seconds = [1e-9 * (b - a) for a, b in pairwise(ends)]
        first = _periodic(body, heats, seconds)
        key = hashlib.blake2b(body.network.digest.encode(), digest_size=16)
        for heat, length in zip(heats, seconds, strict=True):
            key.update(heat.tobytes() + repr(length).encode())
        state = ThermalState(
            tai_ns=ends[0], temperatures=first, history="periodic", digest=key.hexdigest()
        )
    yield state
    for heat, end in zip(heats, ends[1:], strict=True):
        state = advanced(body, state, heat, end)
        yield state


def _periodic(body: ThermalBody, heats: Sequence[Array], seconds: Sequence[float]) -> Array:
    """(n,) temperatures that come back after the span [K].

    Starts from the steady state under the mean heat, which is near for slow nodes.
    """
    if not heats:
        raise SimglError("a periodic start needs at least one step")
    mean = np.average(heats, axis=0, weights=seconds)
    t = body.network.steady(mean)
    change = np.inf
    for _ in range(_MAX_PERIODS):
        before = t
        for heat, length in zip(heats, seconds, strict=True):
            t = body.network.step(t, heat, length)
        change = float(np.max(np.abs(t - before)))
        if change < _SETTLED:
            return t
    raise SimglError(f"temperatures still change by {change:.2g} K from one span to the next")


def _digest(before: str, label: bytes, heat: Array) -> str:
    digest = hashlib.blake2b(before.encode(), digest_size=16)
    digest.update(label + heat.tobytes())
    return digest.hexdigest()
