"""Spread: point spread, scattered light and ghosts of a lens, by Fourier transforms on the CPU.

The shader gives those sums of the bands of the image plane's irradiance that spread. These
planes, 4 bytes a pixel each, go to the CPU, and the result comes back: on a CPU renderer that is a
copy, and its transforms are far faster than any that shaders could do there.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.arrays import Array, Array32
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance
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
_SPREAD = Block(
    "Spread",
    30,
    np.dtype(
        [
            ("mixture", "f4", (_MAX_PLANES, 4)),
            # fx, fy, cx, cy [pixels]
            ("intrinsics", "f4", 4),
            ("irradiance_per_radiance", "f4", 4),
        ]
    ),
)

# Of the cached kernels of cameras; those of the last camera stay.
_MAX_BYTES = 512 << 20


@dataclass(frozen=True)
class Seen:
    """What the pixels of a camera see.

    relative_illumination : map of what is left off the axis; None for cos^4
    """

    radiance: moderngl.Texture
    relative_illumination: moderngl.Texture | None

    @property
    def textures(self) -> list[moderngl.Texture]:
        """Those that there are."""
        maps = self.relative_illumination
        return [self.radiance] if maps is None else [self.radiance, maps]


class SpreadPass:
    """A lens that spreads light: the irradiance of its image plane, or the electrons it makes.

    executor : for the transforms
    """

    state = State()

    def __init__(self, ctx: moderngl.Context, executor: Executor) -> None:
        self._ctx, self._executor = ctx, executor
        self._programs: dict[tuple[int, bool], FullscreenProgram] = {}
        self._spreads = LruCache[object, Spread](MANY, max_bytes=_MAX_BYTES)
        self._target: ImageTarget | None = None

    def bands(self, camera: Camera, sun: SunInCamera | None, seen: Seen) -> list[Array32]:
        """(height, width) irradiance of each band [W m-2]."""
        return self._apply(camera, None, sun, seen)

    def electrons(
        self, camera: Camera, square: Array, sun: SunInCamera | None, seen: Seen
    ) -> Array32:
        """(height, width) mean electrons.

        square : (4, 4) electrons per irradiance and exposure time of the pixels (0, 0), (1, 0),
            (0, 1), (1, 1) in each band [e- W-1 m2 s-1]
        """
        weights, filters = np.unique(square, axis=0, return_inverse=True)
        results = self._apply(camera, weights, sun, seen)
        for result in results:
            result *= np.float32(camera.exposure_time)
        if len(results) == 1:
            return results[0]
        mosaic = np.empty_like(results[0])
        for place, index in enumerate(filters):
            of = np.s_[place // 2 :: 2, place % 2 :: 2]
            mosaic[of] = results[index][of]
        return mosaic

    def _apply(
        self, camera: Camera, weights: Array | None, sun: SunInCamera | None, seen: Seen
    ) -> list[Array32]:
        # Neither exposure time nor electronics: a control loop may set them for every image.
        key = (
            camera.lens,
            camera.geometry,
            camera.detector.pixel_pitch,
            None if weights is None else weights.tobytes(),
        )
        spread = self._spreads.get(
            key, lambda: Spread(camera, weights, self._executor), lambda spread: spread.nbytes
        )
        return spread.apply(self._planes(camera, spread.mixture, seen), sun)

    def _planes(self, camera: Camera, mixture: Array, seen: Seen) -> list[Array32]:
        """(height, width) sums of the bands of the irradiance, by the rows of ``mixture``."""
        count, size = len(mixture), seen.radiance.size
        if self._target is None or (self._target.size, len(self._target.textures)) != (size, count):
            self._release_target()
            self._target = ImageTarget(self._ctx, size, [_PLANE] * count)
        target = self._target
        self.state.apply(self._ctx, target.framebuffer, (0, 0, *target.framebuffer.size))
        padded = np.zeros((_MAX_PLANES, 4))
        padded[:count] = mixture
        k = camera.intrinsics
        values = {
            "mixture": padded,
            "intrinsics": (k[0, 0], k[1, 1], k[0, 2], k[1, 2]),
            "irradiance_per_radiance": irradiance_per_radiance(camera),
        }
        self._program(count, mapped=seen.relative_illumination is not None).draw(
            values, seen.textures
        )
        return [target.read(plane) for plane in range(count)]

    def _program(self, planes: int, *, mapped: bool) -> FullscreenProgram:
        variant = planes, mapped
        if variant not in self._programs:
            samplers = ["radiance", "relative_illumination"] if mapped else ["radiance"]
            defines = {"PLANES": planes} | ({"MAPPED": 1} if mapped else {})
            self._programs[variant] = FullscreenProgram(
                self._ctx, "spread/spread", _SPREAD, samplers, defines
            )
        return self._programs[variant]

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
