"""A server whose camera always has its picture ready: what is left is the loop's own cost."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from threading import Event
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from simgl_bridge.native import WINDOW, NativeFront
from simgl_bridge.server import serve
from simgl_bridge.studio import Studio
from simgl_bridge.turns import Turns

from simgl import Exposure, Scenario, Simulator, load_scenario
from simgl.images import DigitalFrame, FrameInfo
from simgl.scene.state import SceneState

# Pictures up to this many pixels are made anew for each state: 64 x 48.
SMALL_PIXELS = 3072


class StillSimulator:
    """Stands where a Simulator would; every capture is noise, and there at once.

    Small pictures differ from state to state, large ones are always the same.
    """

    renderer_name = "none"
    gl_error = "GL_NO_ERROR"

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        detector = next(iter(scenario.cameras.values())).detector
        self._shape = (detector.height, detector.width)
        self._dn = self._noise(1)

    def _noise(self, seed: int) -> NDArray[np.uint16]:
        rng = np.random.default_rng(seed)
        return rng.integers(0, 4000, self._shape, dtype=np.uint16)

    def capture(
        self, state: SceneState, camera: str, products: Any, during: Any = None
    ) -> Exposure:
        """The picture, with the pose of the state."""
        del products, during
        there = state.cameras[camera]
        sun = state.sun.seen_from(there.position)
        info = FrameInfo(
            scenario=self.scenario.name,
            camera=there.camera,
            epoch_tai_ns=state.tai_ns,
            position=there.position,
            R_camera_from_icrf=there.R_camera_from_icrf,
            sun_direction_icrf=sun.direction_icrf,
            sun_irradiance=sun.irradiance,
            seed=self.scenario.seed,
            renderer=self.renderer_name,
        )
        dn = self._noise(state.tai_ns) if self._dn.size <= SMALL_PIXELS else self._dn
        return Exposure(info=info, digital=DigitalFrame(info=info, dn=dn))

    def close(self) -> None:
        """Nothing to free."""


def main() -> None:
    """``python -m benchmarks.bridge.still SCENARIO --address ADDRESS``."""
    path, _, address = sys.argv[1:]
    stop = Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    turns = Turns(WINDOW)

    def open_still(scenario: Scenario) -> Simulator:
        return cast(Simulator, StillSimulator(scenario))

    with (
        Studio(load_scenario(Path(path)), open_simulator=open_still) as studio,
        NativeFront(studio, turns, address) as front,
    ):
        serve([front], turns, stop)


if __name__ == "__main__":
    main()
