"""The Moon before stars and the Sun, drawn in the few pixels that it touches."""

from __future__ import annotations

import moderngl
import numpy as np
from PIL import Image

from simgl import assets
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import ONE_MINUS_SRC1_COLOR, State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block
from simgl.passes.background.discs import FIELDS, disc_values
from simgl.passes.background.map_levels import map_levels, map_texture
from simgl.view.celestial import MoonDisc

_MOON_DISC = Block(
    "MoonDisc",
    21,
    np.dtype(
        [
            ("moon_radiance", "f4", 4),
            ("earthshine", "f4", 4),
            # Direction, and the share of Lommel-Seeliger in the disc function.
            ("moon_sun", "f4", 4),
            # Columns of the 2 x 2 matrix from pixels to units of the disc's radius.
            ("disc_from_pixel", "f4", 4),
            ("moon_from_disc", "f4", (4, 4)),
            *FIELDS,
            # Half width and height of the rectangle around the disc [pixels].
            ("half_size", "f4", 2),
            ("points", "i4"),
            # 0 for a Moon without seas, else 1.
            ("has_seas", "f4"),
            ("moon_disc_padding", "f4", 2),
        ]
    ),
)

# Points along the disc's diameter at which its light is taken, and at most along a pixel's edge.
_ACROSS = 192.0
_MAX_POINTS = 128


class MoonPass:
    """Lays the Moon over what is behind it, by the share of each pixel that it covers."""

    state = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = FullscreenProgram(ctx, "moon/moon", _MOON_DISC, ["seas"])
        self._seas: moderngl.Texture | None = None

    def draw(self, moon: MoonDisc, target: moderngl.Framebuffer) -> None:
        """Lay the Moon over what an RGBA32F target holds [W m-2 sr-1]."""
        self.state.apply(self._ctx, target, (0, 0, *target.size), moon.ellipse.box)
        points = np.ceil(0.5 * _ACROSS / moon.ellipse.radius)
        to_moon = np.zeros((4, 4), dtype=np.float32)
        if moon.moon_from_disc is not None:
            to_moon[:3, :3] = moon.moon_from_disc
        values = {
            "moon_from_disc": to_moon,
            "has_seas": float(moon.moon_from_disc is not None),
            "moon_radiance": moon.radiance,
            "earthshine": moon.earthshine,
            "moon_sun": (*moon.sun, moon.lommel_seeliger),
            "disc_from_pixel": moon.disc_from_pixel.T.ravel(),
            "half_size": np.sqrt(np.diag(np.linalg.inv(moon.ellipse.form))),
            "points": int(np.clip(points, 1, _MAX_POINTS)),
            **disc_values(moon.ellipse),
        }
        if self._seas is None:
            self._seas = _seas_texture(self._ctx)
        self._program.draw(values, [self._seas])

    def release(self) -> None:
        """Free everything."""
        self._program.release()
        if self._seas is not None:
            self._seas.release()


def _seas_texture(ctx: moderngl.Context) -> moderngl.Texture:
    """The map of the Moon's seas; most scenes show no Moon."""
    with Image.open(assets.data() / "sky" / "moon.png") as image:
        codes = np.asarray(image.convert("L"))
    return map_texture(ctx, map_levels(codes[..., None]))
