"""Optics: from radiance to the mean electrons of each pixel."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.blocks import Block
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.state import State
from simgl.scene.camera import Camera
from simgl.scene.radiometry import electrons_per_radiance

_OPTICS = Block(
    "Optics",
    6,
    np.dtype([("intrinsics", "f4", 4), ("electrons_per_radiance", "f4", 4)]),
)


class OpticsPass:
    """Lens and exposure: E = pi L T cos^4 / (4 N^2), then photons, then electrons."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "optics/optics", _OPTICS, ["radiance"])

    def draw(
        self,
        camera: Camera,
        photons_per_joule: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
        radiance: moderngl.Texture,
        target: moderngl.Framebuffer,
    ) -> None:
        """Fill an R32F target with mean electrons.

        photons_per_joule : (4,) of the light's spectrum in each band
        """
        k = camera.intrinsics
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        values = {
            "intrinsics": (k[0, 0], k[1, 1], k[0, 2], k[1, 2]),
            "electrons_per_radiance": electrons_per_radiance(camera, photons_per_joule),
        }
        self._program.draw(values, [radiance])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
