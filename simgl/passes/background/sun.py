"""The Sun's disc behind everything but stars, drawn in the few pixels that it touches."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import ONE_MINUS_SRC1_COLOR, State
from simgl.gpu.uniform_blocks import Block
from simgl.passes.background.discs import FIELDS, disc_values
from simgl.view.celestial import SunDisc

_SUN_DISC = Block(
    "SunDisc",
    20,
    np.dtype(
        [
            ("sun_radiance", "f4", 4),
            ("sun_limb_u", "f4", 4),
            ("sun_limb_v", "f4", 4),
            *FIELDS,
            ("sun_disc_padding", "f4", 2),
        ]
    ),
)


class SunPass:
    """Lays the disc over stars, by the share of each pixel that it covers."""

    state = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "sun/sun", _SUN_DISC, [])

    def draw(self, sun: SunDisc, target: moderngl.Framebuffer) -> None:
        """Add the disc to what an RGBA32F target holds [W m-2 sr-1]."""
        self.state.apply(self._ctx, target, (0, 0, *target.size), sun.ellipse.box)
        values = {
            "sun_radiance": sun.radiance,
            "sun_limb_u": sun.limb[0],
            "sun_limb_v": sun.limb[1],
            **disc_values(sun.ellipse),
        }
        self._program.draw(values, [])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
