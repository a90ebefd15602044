"""The server without a protocol: a scenario before its simulator, both replaceable.

A front (``native.py`` is one) turns requests of its protocol into pictures of a Studio.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import moderngl

from simgl.errors import BridgeError, ContextError
from simgl.scenario.loader import load_scenario
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.simulator import Capture, Product, Simulator
from simgl_bridge.scene_hash import scene_hash


class GpuLostError(BridgeError):
    """The OpenGL context failed in the middle of a picture; another one may succeed."""


class RenderSession:
    """Takes pictures of one scenario at a time. Use it on one thread: OpenGL stays there.

    root : folder of the scenarios that a client may choose from, by name, and that all their files
        must lie in; None offers none
    open_simulator : makes the simulator of a scenario

    >>> with Studio(load_scenario("approach.toml")) as studio:
    ...     exposure = studio.capture(studio.scenario.at(epoch), "navcam")
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
        self.scene_hash = scene_hash(scenario)

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: frozenset[Product] = frozenset({Product.DN}),
        during: Callable[[int], SceneState] | None = None,
    ) -> Capture:
        """The picture that a camera of a state takes.

        during : the scene at other epochs, while the shutter is open; None stands still

        Raises ConfigError where there is none, and GpuLostError where OpenGL failed; the next
        capture then starts with a new context.
        """
        simulator = self._ready()
        try:
            exposure = simulator.capture(state, camera, products, during)
            error = simulator.gl_error
        except (moderngl.Error, ContextError) as failure:
            self._lose(simulator)
            raise GpuLostError(f"OpenGL failed: {_one_line(failure)}") from failure
        if error != "GL_NO_ERROR":
            self._lose(simulator)
            raise GpuLostError(f"OpenGL reports {error}")
        return exposure

    def _ready(self) -> Simulator:
        if self._simulator is None:
            try:
                self._simulator = self._open(self.scenario)
            except (moderngl.Error, ContextError) as failure:
                raise GpuLostError(f"OpenGL cannot be opened: {_one_line(failure)}") from failure
        return self._simulator

    def _lose(self, simulator: Simulator) -> None:
        self._simulator = None
        try:
            simulator.close()
        except (moderngl.Error, ContextError):
            # What a lost context held is lost with it.
            return

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """What ``configure`` may choose."""
        if self._root is None:
            return ()
        inside = [p for p in self._root.glob("*.toml") if p.resolve().parent == self._root]
        return tuple(sorted(p.stem for p in inside))

    def as_in_folder(self, text: str) -> str:
        """A text for clients: files by their names in the folder, wherever that lies."""
        return text.replace(f"{self._root}/", "")

    def configure(self, name: str | None, seed: int | None) -> None:
        """Another scenario of the folder, or another seed.

        name : one of ``scenario_names``; None keeps the scenario

        Raises SimglError where the scenario cannot be loaded; the present one then stays.
        """
        if name is None:
            self._sow(self.scenario.seed if seed is None else seed)
            return
        assert self._root is not None
        assert name in self.scenario_names
        loaded = load_scenario(self._root / f"{name}.toml", root=self._root)
        self._exchange(loaded if seed is None else replace(loaded, seed=seed))

    def _sow(self, seed: int) -> None:
        """Another seed: nothing of the scene changes, so the simulator stays."""
        self.scenario = replace(self.scenario, seed=seed)
        self._ready().scenario = self.scenario

    def _exchange(self, scenario: Scenario) -> None:
        simulator = self._open(scenario)
        self.close()
        self._simulator, self.scenario = simulator, scenario
        self.scene_hash = scene_hash(scenario)

    def close(self) -> None:
        """Free the simulator."""
        if self._simulator is not None:
            self._simulator.close()
            self._simulator = None

    def __enter__(self) -> RenderSession:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
