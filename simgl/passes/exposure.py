"""Exposure: from the light of the image plane to the mean electrons of each pixel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.camera_equation import irradiance_per_radiance, square_electrons_per_irradiance
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.render_targets import Format
from simgl.gpu.uniform_blocks import Block

# Four pixels a texel: on the CPU renderer a third of the cost of one.
ELECTRONS_FORMAT = Format("f4", 4, packed=True)

_EXPOSURE = Block(
    "Exposure",
    14,
    # fx, fy, cx, cy [pixels]
    np.dtype([("electrons_per_light", "f4", (4, 4)), ("intrinsics", "f4", 4)]),
)


class ExposurePass:
    """Pixels that collect photons over the exposure time and turn them into electrons."""

    fills = State()
    adds = State(blend=(moderngl.ONE, moderngl.ONE))

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, ...], FullscreenProgram] = {}

    def draw(
        self,
        camera: Camera,
        photons_per_joule: Array,
        irradiance: moderngl.Texture,
        target: moderngl.Framebuffer,
    ) -> None:
        """Fill a target of ``ELECTRONS_FORMAT`` with mean electrons.

        photons_per_joule : (4,) of the light's spectrum in each band
        """
        self.fills.apply(self._ctx, target, (0, 0, *target.size))
        folded = square_electrons_per_irradiance(camera, photons_per_joule)
        self._draw(camera, folded, {"light": irradiance})

    def draw_through_lens(
        self,
        camera: Camera,
        photons_per_joule: Array,
        radiance: moderngl.Texture,
        relative_illumination: moderngl.Texture | None,
        target: moderngl.Framebuffer,
    ) -> None:
        """The same from what pixels see, where a lens keeps their light apart.

        relative_illumination : map of what is left off the axis; None for cos^4
        """
        self.fills.apply(self._ctx, target, (0, 0, *target.size))
        light = {"light": radiance}
        self._draw_seen(camera, photons_per_joule, light, relative_illumination)

    def add_through_lens(
        self,
        camera: Camera,
        photons_per_joule: Array,
        radiance: moderngl.Texture,
        relative_illumination: moderngl.Texture | None,
        target: moderngl.Framebuffer,
    ) -> None:
        """Add electrons to those of a target."""
        self.adds.apply(self._ctx, target, (0, 0, *target.size))
        light = {"light": radiance}
        self._draw_seen(camera, photons_per_joule, light, relative_illumination)

    def _draw_seen(
        self,
        camera: Camera,
        photons_per_joule: Array,
        textures: Mapping[str, moderngl.Texture],
        relative_illumination: moderngl.Texture | None,
    ) -> None:
        folded = square_electrons_per_irradiance(camera, photons_per_joule)
        defines = ["LENS"]
        if relative_illumination is not None:
            textures = {**textures, "relative_illumination": relative_illumination}
            defines.append("MAPPED")
        self._draw(camera, folded * irradiance_per_radiance(camera), textures, defines)

    def _draw(
        self,
        camera: Camera,
        electrons_per_light: Array,
        textures: Mapping[str, moderngl.Texture],
        defines: Sequence[str] = (),
    ) -> None:
        if camera.detector.mosaic is not None:
            defines = [*defines, "MOSAIC"]
        variant = tuple(defines)
        if variant not in self._programs:
            self._programs[variant] = FullscreenProgram(
                self._ctx, "exposure/exposure", _EXPOSURE, list(textures), variant
            )
        k = camera.intrinsics
        values = {
            "electrons_per_light": electrons_per_light,
            "intrinsics": (k[0, 0], k[1, 1], k[0, 2], k[1, 2]),
        }
        self._programs[variant].draw(values, list(textures.values()))

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()
