"""Temperatures of all spacecraft of a scene: steady, or going on from those of an earlier one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from simgl.lru_cache import LruCache
from simgl.progress import ProgressCallback, begin_stage
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.thermal.body import ThermalBody, thermal_body
from simgl.thermal.history import ThermalState, advanced, steady_state

# By spacecraft.
Temperatures = Mapping[str, ThermalState]
# Spacecraft whose networks stay, and steps of a history.
_MANY, _STEPS = 64, 256


@dataclass(frozen=True, eq=False)
class ThermalBodies:
    """The thermal networks of spacecraft, made when first needed.

    patches : of each, about
    """

    patches: int
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
        """What the temperatures would be, had the scene stood as it is for ever."""
        return {n: steady_state(self.of(n, b.model), state) for n, b in state.bodies.items()}

    def advanced(self, before: Temperatures, state: SceneState) -> Temperatures:
        """The temperatures in a later scene of the same spacecraft.

        Raises SimglError for a scene that is not later.
        """
        return {
            name: advanced(self.of(name, body.model), before[name], state)
            for name, body in state.bodies.items()
        }


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
