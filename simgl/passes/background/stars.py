"""Catalogue stars as points of light, added where nothing else has been drawn yet."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.pipeline_state import State
from simgl.gpu.program import load_program
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block, UniformBuffer
from simgl.view.celestial import CelestialView, StarPoints

_STARS = Block(
    "Stars",
    22,
    np.dtype(
        [
            ("image_size", "f4", 2),
            ("principal_point", "f4", 2),
            ("focal_length", "f4"),
            ("stars_padding_a", "f4"),
            ("stars_padding_b", "f4", 2),
        ]
    ),
)
_STAR = np.dtype([("pixel", "<f4", 2), ("width", "<f4", 2), ("irradiance", "<f4", 4)])


class StarPass:
    """Spreads each star over some pixels: radiances times solid angles sum to its irradiance."""

    state = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = load_program(ctx, "stars/stars", blocks=[_STARS])
        self._block = UniformBuffer(ctx, _STARS)
        self._stars: moderngl.Buffer | None = None
        self._array: moderngl.VertexArray | None = None

    def draw(self, view: CelestialView, stars: StarPoints, target: moderngl.Framebuffer) -> None:
        """Add the stars to what an RGBA32F target holds [W m-2 sr-1]."""
        data = np.zeros(len(stars.pixels), dtype=_STAR)
        data["pixel"], data["width"] = stars.pixels, stars.widths
        data["irradiance"] = stars.irradiance
        self._upload(data.tobytes())
        self.state.apply(self._ctx, target, (0, 0, *target.size))
        self._block.write(
            {
                "image_size": target.size,
                "principal_point": view.principal_point,
                "focal_length": view.focal_length,
            }
        )
        self._block.bind()
        assert self._array is not None
        self._array.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(data))

    def _upload(self, content: bytes) -> None:
        if self._stars is None or self._stars.size < len(content):
            self._free_stars()
            stars = self._ctx.buffer(reserve=2 * len(content))
            layout = (stars, "2f 2f 4f /i", "in_pixel", "in_width", "in_irradiance")
            self._array = self._ctx.vertex_array(self._program, [layout])
            self._stars = stars
        self._stars.write(content)

    def _free_stars(self) -> None:
        for owned in (self._array, self._stars):
            if owned is not None:
                owned.release()
        self._array = self._stars = None

    def release(self) -> None:
        """Free everything."""
        self._free_stars()
        self._block.release()
        self._program.release()
