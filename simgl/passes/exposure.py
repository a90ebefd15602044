"""Exposure: from the irradiance of the image plane to the mean electrons of each pixel."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.scene.camera import Camera
from simgl.scene.radiometry import electrons_per_irradiance

_EXPOSURE = Block("Exposure", 14, np.dtype([("electrons_per_irradiance", "f4", 4)]))


class ExposurePass:
    """Pixels that collect photons over the exposure time and turn them into electrons."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "exposure/exposure", _EXPOSURE, ["irradiance"])

    def draw(
        self,
        camera: Camera,
        photons_per_joule: NDArray[np.float64],
        irradiance: moderngl.Texture,
        target: moderngl.Framebuffer,
    ) -> None:
        """Fill an R32F target with mean electrons.

        photons_per_joule : (4,) of the light's spectrum in each band
        """
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        folded = electrons_per_irradiance(camera, photons_per_joule)
        self._program.draw({"electrons_per_irradiance": folded}, [irradiance])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
