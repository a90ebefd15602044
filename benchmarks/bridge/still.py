"""A server whose renderer process draws nothing, to measure the cost of the loop alone."""

from __future__ import annotations

import sys
from typing import Any
from unittest.mock import patch

import numpy as np
from simgl_bridge import commands, processes, render_process

from simgl import Capture, Scenario
from simgl.arrays import Image16
from simgl.images import DigitalFrame, FrameInfo
from simgl.scene.state import SceneState

# Images up to this size encode the time of their state: 256 x 192 pixels.
SMALL_PIXELS = 49152
# One more than the largest DN.
LEVELS = 4000


class StillSimulator:
    """Takes the place of a Simulator; every capture is the same noise, without delay.

    The first pixels of small images encode the state's time; large ones are always the same.
    """

    renderer_name = "none"
    gl_error = "GL_NO_ERROR"

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        detector = next(iter(scenario.cameras.values())).detector
        self._shape = (detector.height, detector.width)
        self._dn = np.random.default_rng(1).integers(0, LEVELS, self._shape, dtype=np.uint16)

    def _pixels(self, tai_ns: int) -> Image16:
        if self._dn.size > SMALL_PIXELS:
            return self._dn
        dn = self._dn.copy()
        dn[0, :6] = [tai_ns // LEVELS**digit % LEVELS for digit in range(6)]
        return dn

    def capture(
        self,
        state: SceneState,
        camera: str,
        products: Any = None,
        during: Any = None,
        draw: int = 0,
        temperatures: Any = None,
    ) -> Capture:
        """The image, with the pose of the state."""
        del products, during, temperatures
        camera_state = state.cameras[camera]
        sun = state.sun.seen_from(camera_state.position)
        info = FrameInfo(
            scenario=self.scenario.name,
            camera=camera_state.camera,
            epoch_tai_ns=state.tai_ns,
            position=camera_state.position,
            R_camera_from_icrf=camera_state.R_camera_from_icrf,
            sun_direction_icrf=sun.direction_icrf,
            sun_irradiance=sun.irradiance,
            seed=self.scenario.seed,
            renderer=self.renderer_name,
            draw=draw,
        )
        return Capture(info=info, digital=DigitalFrame(info=info, dn=self._pixels(state.tai_ns)))

    def close(self) -> None:
        """Nothing to free."""


def render() -> None:
    """The renderer process, with a simulator that draws nothing."""
    with patch.object(render_process, "Simulator", lambda scenario, **_: StillSimulator(scenario)):
        render_process.main()


def main() -> None:
    """``python -m benchmarks.bridge.still SCENARIO --address ADDRESS``."""
    program = "from benchmarks.bridge.still import render; render()"
    with patch.object(processes, "RENDERER_COMMAND", (sys.executable, "-c", program)):
        commands.main()


if __name__ == "__main__":
    main()
