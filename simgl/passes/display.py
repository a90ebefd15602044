"""Display: a radiance image as a screen shows it."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.display_colours import shown_channels, srgb_from_bands, white_radiance
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import State
from simgl.gpu.uniform_blocks import Block
from simgl.physics.spectrum import BANDS, Bands

_DISPLAY = Block(
    "Display",
    8,
    np.dtype(
        [
            # of the three channels shown: full white [W m-2 sr-1]; the fourth is not used
            ("white_radiance", "f4", 4),
            # x, y, width, height of the image in the window [px], y upwards
            ("rectangle", "f4", 4),
            # shown as red, green and blue; the fourth is not used
            ("shown_channels", "i4", 4),
            # Columns of linear sRGB from these over the white
            ("srgb_from_bands", "f4", (3, 4)),
        ]
    ),
)


class DisplayPass:
    """Exposure, white point and sRGB transfer, from an image to a part of a window."""

    state = State()

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "display/display", _DISPLAY, ["radiance"])

    def draw(
        self,
        radiance: moderngl.Texture,
        target: moderngl.Framebuffer,
        rectangle: tuple[int, int, int, int],
        exposure_value: float = 0.0,
        bands: Bands = BANDS,
    ) -> None:
        """Fill a rectangle (x, y, width, height; y upwards) of an 8-bit target, its top row last.

        exposure_value : brightens by two to this power [EV]; at 0 the Sun's white is full white
        bands : of the radiance
        """
        self.state.apply(self._ctx, target, rectangle)
        white = white_radiance(bands) * 2.0**-exposure_value
        values = {
            "white_radiance": (*white, 1.0),
            "rectangle": rectangle,
            "shown_channels": (*shown_channels(bands), 0),
            "srgb_from_bands": np.pad(srgb_from_bands(bands).T, ((0, 0), (0, 1))),
        }
        self._program.draw(values, [radiance])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
