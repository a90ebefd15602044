"""A server whose camera always has its picture ready: what is left is the loop's own cost."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from threading import Event
from typing import Any, cast

import numpy as np
from simgl_bridge.native import WINDOW, NativeFront
from simgl_bridge.server import serve
from simgl_bridge.studio import Studio
from simgl_bridge.turns import Turns

from simgl import Exposure, Scenario, Simulator, load_scenario
from simgl.images import DigitalFrame, FrameInfo
from simgl.scene.state import SceneState


class StillSimulator:
    """Stands where a Simulator would; every capture is the same noise at once."""

    renderer_name = "none"
    gl_error = "GL_NO_ERROR"

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        detector = next(iter(scenario.cameras.values())).detector
        rng = np.random.default_rng(1)
        shape = (detector.height, detector.width)
        self._dn = rng.integers(0, 4000, shape, dtype=np.uint16)

    def capture(self, state: SceneState, camera: str, products: Any) -> Exposure:
        """The picture, with the pose of the state."""
        del products
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
        return Exposure(info=info, digital=DigitalFrame(info=info, dn=self._dn))

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
