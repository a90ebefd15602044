"""Spread: point spread, scattered light and ghosts of a lens, by Fourier transforms on the CPU.

A frame goes to the CPU and back: on a CPU renderer that is a copy, and its transforms are far
faster than any that shaders could do there.
"""

from __future__ import annotations

from concurrent.futures import Executor

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.camera.point_spread import Spread, SunInCamera
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.gpu.uniform_blocks import Block
from simgl.lru_cache import MANY, LruCache

# The most planes that one draw writes, and pixels of a texel in each.
_MAX_PLANES = 4
_PLANE = Format("f4", 4, packed=True)
_SPREAD = Block("Spread", 30, np.dtype([("mixture", "f4", (_MAX_PLANES, 4))]))

# Of the cached kernels of cameras; those of the last camera stay.
_MAX_BYTES = 512 << 20


class SpreadPass:
    """Convolves the irradiance of an image plane, or the electrons that it makes.

    executor : for the transforms
    """

    state = State()

    def __init__(self, ctx: moderngl.Context, executor: Executor) -> None:
        self._ctx, self._executor = ctx, executor
        self._programs: dict[int, FullscreenProgram] = {}
        self._spreads = LruCache[object, Spread](MANY, max_bytes=_MAX_BYTES)
        self._target: ImageTarget | None = None

    def bands(
        self,
        camera: Camera,
        sun: SunInCamera | None,
        irradiance: moderngl.Texture,
        target: moderngl.Texture,
    ) -> None:
        """Write all bands [W m-2] into an RGBA32F texture."""
        target.write(np.stack(self._apply(camera, None, sun, irradiance), axis=-1).data)

    def electrons(
        self,
        camera: Camera,
        square: Array,
        sun: SunInCamera | None,
        irradiance: moderngl.Texture,
    ) -> Array32:
        """(height, width) mean electrons.

        square : (4, 4) electrons per irradiance of the pixels (0, 0), (1, 0), (0, 1), (1, 1) in
            each band [e- W-1 m2]
        """
        weights, filters = np.unique(square, axis=0, return_inverse=True)
        results = self._apply(camera, weights, sun, irradiance)
        if len(results) == 1:
            return results[0]
        mosaic = np.empty_like(results[0])
        for place, index in enumerate(filters):
            of = np.s_[place // 2 :: 2, place % 2 :: 2]
            mosaic[of] = results[index][of]
        return mosaic

    def _apply(
        self,
        camera: Camera,
        weights: Array | None,
        sun: SunInCamera | None,
        irradiance: moderngl.Texture,
    ) -> list[Array32]:
        key = (camera.lens, camera.detector, None if weights is None else weights.tobytes())
        spread = self._spreads.get(
            key, lambda: Spread(camera, weights, self._executor), lambda spread: spread.nbytes
        )
        return spread.apply(self._planes(spread.mixture, irradiance), sun)

    def _planes(self, mixture: Array, irradiance: moderngl.Texture) -> list[Array32]:
        count = len(mixture)
        if self._target is None or (self._target.size, len(self._target.textures)) != (
            irradiance.size,
            count,
        ):
            self._release_target()
            self._target = ImageTarget(self._ctx, irradiance.size, [_PLANE] * count)
        if count not in self._programs:
            self._programs[count] = FullscreenProgram(
                self._ctx, "spread/spread", _SPREAD, ["bands"], {"PLANES": count}
            )
        target = self._target
        self.state.apply(self._ctx, target.framebuffer, (0, 0, *target.framebuffer.size))
        padded = np.zeros((_MAX_PLANES, 4))
        padded[:count] = mixture
        self._programs[count].draw({"mixture": padded}, [irradiance])
        return [target.read(plane) for plane in range(count)]

    def _release_target(self) -> None:
        if self._target is not None:
            release_all(self._ctx, self._target)
            self._target = None

    def release(self) -> None:
        """Free everything."""
        self._release_target()
        for program in self._programs.values():
            program.release()
        self._programs.clear()
