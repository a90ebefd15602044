"""A scenario and its simulator, both replaceable: what the renderer process renders with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import moderngl

from simgl.errors import BridgeError, ConfigError, ContextError
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Capture, Product, Simulator
from simgl.thermal.scene_temperatures import RememberedTemperatures, Temperatures
from simgl_bridge.public_text import public_text
from simgl_bridge.scenario_folder import scenario_names


class GpuLostError(BridgeError):
    """The OpenGL context failed during a capture; a new one may succeed."""


class RenderSession:
    """Renders one scenario at a time. Use it on one thread: OpenGL is bound to it.

    root : folder of the scenarios that a client may choose from, by name, and that all their files
        must lie in; None offers none
    open_simulator : makes the simulator of a scenario

    >>> with RenderSession(load_scenario("approach.toml")) as session:
    ...     capture = session.capture(session.scenario.at(epoch), "navcam")
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        root: Path | None = None,
        open_simulator: Callable[[Scenario], Simulator] = Simulator,
    ) -> None:
        self._root = None if root is None else root.resolve()
        self._open = open_simulator
        self._simulator: Simulator | None = open_simulator(scenario)
        self.renderer_name = self._simulator.renderer_name
        self.scenario = scenario
        self._temperatures = RememberedTemperatures()

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: frozenset[Product] = frozenset({Product.DN}),
        during: Callable[[int], SceneState] | None = None,
        draw: int = 0,
        temperatures: Temperatures | None = None,
    ) -> Capture:
        """The capture of one camera of a state.

        during : gives the scene at other epochs while the shutter is open; None for a fixed scene
        draw : which of several images of this epoch
        temperatures : of the spacecraft, for thermal cameras; None for the steady state

        Raises ConfigError where there is none, and GpuLostError where OpenGL failed; the next
        capture then starts with a new context.
        """
        simulator = self._opened_simulator()
        try:
            capture = simulator.capture(
                state, camera, products, during, draw=draw, temperatures=temperatures
            )
            error = simulator.gl_error
        except (moderngl.Error, ContextError) as failure:
            self._drop_context(simulator)
            raise GpuLostError(f"OpenGL failed: {_one_line(failure)}") from failure
        if error != "GL_NO_ERROR":
            self._drop_context(simulator)
            raise GpuLostError(f"OpenGL reports {error}")
        return capture

    def temperatures(self, state: SceneState, before: str) -> Temperatures:
        """Temperatures of the spacecraft, which are remembered by their name.

        before : name of those that they go on from; empty for the steady state

        Raises UnknownTemperaturesError for a name that is not remembered, and SimglError for
        temperatures that are not earlier.
        """
        return self._temperatures.reached(self._opened_simulator().thermal_bodies, state, before)

    def _opened_simulator(self) -> Simulator:
        if self._simulator is None:
            try:
                self._simulator = self._open(self.scenario)
            except (moderngl.Error, ContextError) as failure:
                raise GpuLostError(f"OpenGL cannot be opened: {_one_line(failure)}") from failure
        return self._simulator

    def _drop_context(self, simulator: Simulator) -> None:
        self._simulator = None
        try:
            simulator.close()
        except (moderngl.Error, ContextError):
            # The objects of a lost context are lost with it.
            return

    def without_folder(self, text: str) -> str:
        """A text for clients: files named relative to the folder of scenarios."""
        return public_text(text, () if self._root is None else (self._root,))

    def configure(self, name: str | None, seed: int | None) -> None:
        """Choose another scenario of the folder, or another seed.

        name : of a scenario in the folder; None keeps the scenario

        Raises SimglError where the scenario cannot be loaded; the present one then stays.
        """
        if name is None:
            self._set_seed(self.scenario.seed if seed is None else seed)
            return
        assert self._root is not None
        loaded = load_named(self._root, name)
        self._load(loaded if seed is None else replace(loaded, seed=seed))

    def _set_seed(self, seed: int) -> None:
        """The seed changes nothing of the scene, so the simulator stays."""
        self.scenario = replace(self.scenario, seed=seed)
        self._opened_simulator().scenario = self.scenario

    def _load(self, scenario: Scenario) -> None:
        simulator = self._open(scenario)
        self.close()
        self._simulator, self.scenario = simulator, scenario
        self._temperatures = RememberedTemperatures()
        self.renderer_name = simulator.renderer_name

    def close(self) -> None:
        """Close the simulator."""
        if self._simulator is not None:
            self._simulator.close()
            self._simulator = None

    def __enter__(self) -> RenderSession:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def load_named(root: Path, name: str) -> Scenario:
    """A scenario of a folder that clients may choose from; raises SimglError."""
    if name not in scenario_names(root):
        raise ConfigError(str(root), "", f'has no scenario "{name}"')
    return load_scenario(root / f"{name}.toml", root=root)


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
