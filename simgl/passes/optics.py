"""Optics: from the radiance that a camera sees to the irradiance of its image plane."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.scene.camera import Camera
from simgl.scene.radiometry import irradiance_per_radiance

_OPTICS = Block(
    "Optics",
    6,
    np.dtype([("intrinsics", "f4", 4), ("irradiance_per_radiance", "f4", 4)]),
)


class OpticsPass:
    """The lens: E = pi L T cos^4 / (4 N^2)."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "optics/optics", _OPTICS, ["radiance"])

    def draw(
        self, camera: Camera, radiance: moderngl.Texture, target: moderngl.Framebuffer
    ) -> None:
        """Fill an RGBA32F target with irradiance per band [W m-2]."""
        k = camera.intrinsics
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        values = {
            "intrinsics": (k[0, 0], k[1, 1], k[0, 2], k[1, 2]),
            "irradiance_per_radiance": irradiance_per_radiance(camera),
        }
        self._program.draw(values, [radiance])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
