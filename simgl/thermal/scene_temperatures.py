"""Temperatures of all spacecraft of a scene: steady, or going on from those of an earlier one."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from simgl.errors import SimglError
from simgl.lru_cache import LruCache
from simgl.progress import ProgressCallback, begin_stage
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.thermal.between_bodies import neighbours, scene_heat_loads
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.history import ThermalState, advanced_under, steady_state, steady_under
from simgl.thermal.sky_light import Skies

# By spacecraft.
Temperatures = Mapping[str, ThermalState]
# Spacecraft whose networks stay, and steps of a history.
_MANY, _STEPS = 64, 256
# Steady states of bodies near each other agree to this [K], after so many rounds at most.
_AGREED, _ROUNDS = 0.005, 100
# Temperatures that are remembered by name.
_NAMED, _NAMED_BYTES = 4096, 256 << 20


class UnknownTemperaturesError(SimglError):
    """No temperatures of a name are remembered."""


def name_of(temperatures: Temperatures) -> str:
    """Hash of all that the temperatures of a scene depend on."""
    names = [state.digest for state in temperatures.values()]
    if len(names) == 1:
        return names[0]
    return hashlib.blake2b("+".join(names).encode(), digest_size=16).hexdigest()


def history_of(temperatures: Temperatures) -> str:
    """How they came about: "steady" without a history."""
    return ", ".join(sorted({state.history for state in temperatures.values()}))


@dataclass(frozen=True, eq=False)
class ThermalBodies:
    """The thermal networks of spacecraft, made when first needed.

    patches : of each, about
    skies : what they have around them
    """

    patches: int
    skies: Skies
    _bodies: LruCache[tuple[str, str, str], ThermalBody] = field(
        default_factory=lambda: LruCache(_MANY), repr=False
    )

    def of(
        self, name: str, model: SpacecraftModel, progress: ProgressCallback | None = None
    ) -> ThermalBody:
        """The network of a spacecraft, the same for all values of its joints."""
        stored = model if model.stored is None else model.stored

        def make() -> ThermalBody:
            begin_stage(progress, f"how the surfaces of {name} see each other")
            return thermal_body(name, stored, self.patches)

        return self._bodies.get((name, stored.mesh.digest, stored.surface_digest), make)

    def steady(self, state: SceneState) -> Temperatures:
        """What the temperatures would be, had the scene stood as it is for ever.

        Bodies near each other warm each other: their steady states are repeated until they agree.
        """
        bodies = self._all(state)
        skies = {name: self.skies.heat(state, name) for name in bodies}
        states = {name: steady_state(body, state, skies[name]) for name, body in bodies.items()}
        near = neighbours(bodies, state)
        for _ in range(_ROUNDS if near.hidden else 0):
            before = {name: states[name].temperatures for name in bodies}
            loads = scene_heat_loads(bodies, state, skies, before, near)
            for name in near.hidden:
                start = before[name]
                states[name] = steady_under(bodies[name], loads[name], state.tai_ns, start)
            change = (states[name].temperatures - before[name] for name in near.hidden)
            if max(float(np.abs(one).max()) for one in change) < _AGREED:
                break
        return states

    def advanced(self, before: Temperatures, state: SceneState) -> Temperatures:
        """The temperatures in a later scene of the same spacecraft.

        Those near each other are warmed by the others' temperatures before the step. Raises
        SimglError for a scene that is not later.
        """
        bodies = self._all(state)
        earlier = {name: before[name].temperatures for name in bodies}
        skies = {name: self.skies.heat(state, name) for name in bodies}
        loads = scene_heat_loads(bodies, state, skies, earlier)
        return {
            name: advanced_under(body, before[name], loads[name], state.tai_ns)
            for name, body in bodies.items()
        }

    def _all(self, state: SceneState) -> dict[str, ThermalBody]:
        return {name: self.of(name, body.model) for name, body in state.bodies.items()}


class RememberedTemperatures:
    """Temperatures by their names, which later ones go on from.

    A name stands for all the light since the start: whoever asks, and whatever else was asked
    between, the same request gives the same temperatures.
    """

    def __init__(self) -> None:
        self._by_name: LruCache[str, Temperatures] = LruCache(_NAMED, max_bytes=_NAMED_BYTES)

    def reached(self, bodies: ThermalBodies, state: SceneState, before: str) -> Temperatures:
        """Those of a scene, going on from others.

        before : their name, whose time may be that of the scene; empty for the steady state

        Raises UnknownTemperaturesError for a name that is not remembered, and SimglError for
        temperatures that are later than the scene.
        """
        if not before:
            temperatures = bodies.steady(state)
        else:
            earlier = self._by_name.find(before)
            if earlier is None:
                raise UnknownTemperaturesError("is not remembered; start without it")
            known_ns = max(one.tai_ns for one in earlier.values())
            if known_ns > state.tai_ns:
                problem = f"is of {1e-9 * (known_ns - state.tai_ns):g} s later than tai_ns"
                raise SimglError(problem)
            if known_ns == state.tai_ns:
                return earlier
            temperatures = bodies.advanced(earlier, state)
        size = sum(one.temperatures.nbytes * 3 for one in temperatures.values())
        self._by_name.put(name_of(temperatures), temperatures, size)
        return temperatures


class TemperatureHistory:
    """Temperatures along the laws of a scenario from its epoch on, at any time.

    They are stepped on a fixed grid of times, from the steady state at the scenario's epoch, and by
    what remains to the time asked for: a pure function of that time, whatever was asked before.

    scene_at : the scene at a time [TAI ns]
    first_ns : the scenario's epoch; before it there is no history, and temperatures are steady
    step_ns : of the grid [ns]
    """

    def __init__(
        self,
        bodies: ThermalBodies,
        scene_at: Callable[[int], SceneState],
        first_ns: int,
        step_ns: int,
    ) -> None:
        self._bodies, self._scene_at = bodies, scene_at
        self._first_ns, self._step_ns = first_ns, step_ns
        self._known: dict[int, Temperatures] = {}

    def at(self, tai_ns: int) -> Temperatures:
        """Of all spacecraft at a time."""
        if tai_ns <= self._first_ns:
            return self._bodies.steady(self._scene_at(tai_ns))
        last = (tai_ns - self._first_ns) // self._step_ns
        if not self._known:
            self._known[0] = self._bodies.steady(self._scene_at(self._first_ns))
        start = max(step for step in self._known if step <= last)
        for step in range(start + 1, last + 1):
            scene = self._scene_at(self._first_ns + step * self._step_ns)
            self._known[step] = self._bodies.advanced(self._known[step - 1], scene)
            # The latest steps serve the frames that follow, the first one those before.
            if step > _STEPS:
                self._known.pop(step - _STEPS, None)
        grid_ns = self._first_ns + last * self._step_ns
        if grid_ns == tai_ns:
            return self._known[last]
        return self._bodies.advanced(self._known[last], self._scene_at(tai_ns))
