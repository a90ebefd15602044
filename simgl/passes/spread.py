"""Spread: point spread, scattered light and ghosts of a lens, by Fourier transforms on the CPU.

A frame goes to the CPU and back: on a CPU renderer that is a copy, and its transforms are far
faster than any that shaders could do there.
"""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.optics.spread import Spread, SunBefore
from simgl.scene.camera import Camera

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

_SPREAD = Block("Spread", 30, np.dtype([("mixture", "f4", (4, 4))]))

# Kernels of a few cameras are kept.
_KEPT = 8


class SpreadPass:
    """Convolves the irradiance of an image plane, or one weighted sum of its bands."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "spread/spread", _SPREAD, ["bands"])
        self._spreads: dict[object, Spread] = {}
        self._target: moderngl.Framebuffer | None = None

    def bands(
        self,
        camera: Camera,
        sun: SunBefore | None,
        irradiance: moderngl.Texture,
        target: moderngl.Texture,
    ) -> None:
        """Write all bands [W m-2] into an RGBA32F texture."""
        target.write(np.stack(self._apply(camera, None, sun, irradiance), axis=-1).data)

    def electrons(
        self,
        camera: Camera,
        electrons_per_irradiance: Array,
        sun: SunBefore | None,
        irradiance: moderngl.Texture,
    ) -> Floats:
        """(height, width) mean electrons of a monochrome detector.

        electrons_per_irradiance : (4,) [e- W-1 m2]
        """
        (result,) = self._apply(camera, electrons_per_irradiance, sun, irradiance)
        return result

    def _apply(
        self,
        camera: Camera,
        weights: Array | None,
        sun: SunBefore | None,
        irradiance: moderngl.Texture,
    ) -> list[Floats]:
        key = (camera.lens, camera.detector, None if weights is None else weights.tobytes())
        spread = self._spreads.pop(key, None) or Spread(camera, weights)
        self._spreads[key] = spread
        if len(self._spreads) > _KEPT:
            self._spreads.pop(next(iter(self._spreads)))
        return spread.apply(self._planes(spread.mixture, irradiance), sun)

    def _planes(self, mixture: Array, irradiance: moderngl.Texture) -> list[Floats]:
        width, height = size = irradiance.size
        if self._target is None or self._target.size != size:
            self._release_target()
            planes = [self._ctx.texture(size, 1, dtype="f4") for _ in range(4)]
            self._target = self._ctx.framebuffer(planes)
        self.state.apply(self._ctx, self._target, (0, 0, width, height))
        padded = np.zeros((4, 4))
        padded[: len(mixture)] = mixture
        self._program.draw({"mixture": padded}, [irradiance])
        return [
            np.frombuffer(plane.read(), dtype=np.float32).reshape(height, width)
            for plane in self._target.color_attachments[: len(mixture)]
            if isinstance(plane, moderngl.Texture)
        ]

    def _release_target(self) -> None:
        if self._target is not None:
            self._ctx.detect_framebuffer(0).use()
            for plane in self._target.color_attachments:
                plane.release()
            self._target.release()
            self._target = None

    def release(self) -> None:
        """Free everything."""
        self._release_target()
        self._program.release()
