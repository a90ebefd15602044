"""Resolve: the samples of a tile averaged per pixel and laid over the background."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from simgl.camera.camera import Camera
from simgl.camera.distortion import field
from simgl.gpu.fullscreen import FullscreenProgram
from simgl.gpu.pipeline_state import ONE_MINUS_SRC1_COLOR, State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.uniform_blocks import Block
from simgl.view.raster_tiles import RasterTile

_RESOLVE = Block(
    "Resolve",
    5,
    np.dtype(
        [
            # Columns of the 2 x 2 matrices from pixel to raster directions and back.
            ("raster_from_pixel", "f4", 4),
            ("pixel_from_raster", "f4", 4),
            # Raster coordinates of the tile's corner, and the tile's place in the image.
            ("raster_origin", "f4", 2),
            ("tile_origin", "f4", 2),
            # Tile coordinates of the corner of a window's raster.
            ("window_origin", "f4", 2),
            ("window_size", "i4", 2),
            ("pinhole_reach", "i4"),
            ("window_samples", "f4"),
            # Of the tile; the texture of its samples may be larger, with those of others.
            ("raster_size", "i4", 2),
            # Low x and y, high x and y in the pinhole's image: whose middles' pixels are drawn.
            ("owned", "f4", 4),
        ]
    ),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class DistortedView:
    """A camera whose lens distorts, and the table of ``WarpPass.places``."""

    camera: Camera
    places: moderngl.Texture


class ResolvePass:
    """Each pixel of a tile becomes mean of samples + (1 - covered share) x background.

    A lens that distorts moves the samples: each goes to the pixel that its line of sight ends on.
    """

    state = State(blend=(moderngl.ONE, ONE_MINUS_SRC1_COLOR))
    hiding = State(blend=(moderngl.ZERO, ONE_MINUS_SRC1_COLOR))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._programs: dict[tuple[str, ...], FullscreenProgram] = {}

    def draw(
        self,
        tile: RasterTile,
        samples: moderngl.Texture,
        target: moderngl.Framebuffer,
        lens: DistortedView | None = None,
    ) -> None:
        """Lay the tile over the radiance that the target already holds."""
        self._draw(self.state, tile, samples, target, lens)

    def hide(
        self,
        tile: RasterTile,
        samples: moderngl.Texture,
        target: moderngl.Framebuffer,
        lens: DistortedView | None = None,
    ) -> None:
        """Leave of what the target holds only what is seen past the tile's spacecraft."""
        self._draw(self.hiding, tile, samples, target, lens)

    def _draw(
        self,
        state: State,
        tile: RasterTile,
        samples: moderngl.Texture,
        target: moderngl.Framebuffer,
        lens: DistortedView | None,
    ) -> None:
        box = tile.x, tile.y, tile.width, tile.height
        textures = {"samples": samples}
        defines = [] if tile.window is None else ["WINDOW"]
        if lens is not None:
            box = _distorted_box(tile, lens.camera)
            textures["places"] = lens.places
            defines.append("DISTORTED")
        state.apply(self._ctx, target, (0, 0, *target.size), box)
        self._program_for(tuple(defines), list(textures)).draw(
            _values(tile), list(textures.values())
        )

    def _program_for(self, defines: tuple[str, ...], samplers: list[str]) -> FullscreenProgram:
        if defines not in self._programs:
            self._programs[defines] = FullscreenProgram(
                self._ctx, "resolve/resolve", _RESOLVE, samplers, defines
            )
        return self._programs[defines]

    def release(self) -> None:
        """Free everything."""
        for program in self._programs.values():
            program.release()
        self._programs.clear()


def _distorted_box(tile: RasterTile, camera: Camera) -> tuple[int, int, int, int]:
    """x, y, width, height of the pixels that are drawn from a tile of the pinhole's image."""
    places, (x0, y0, x1, y1) = field(camera).places, tile.owned
    inside = np.all((places >= (x0, y0)) & (places < (x1, y1)), axis=-1)
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    if not rows.size:
        return 0, 0, 0, 0
    x, y = int(columns[0]), int(rows[0])
    return x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y


def _values(tile: RasterTile) -> dict[str, object]:
    turn, window = tile.sample_grid.turn, tile.window
    back, origin, size, samples = np.linalg.inv(turn), np.zeros(2), (0, 0), 0.0
    if window is not None:
        back = window.image_from_raster[:, :2]
        origin = window.image_from_raster[:, 2] - (tile.x, tile.y)
        size, samples = window.size, window.samples_per_pixel
    return {
        "raster_from_pixel": turn.T.ravel(),
        "pixel_from_raster": back.T.ravel(),
        "raster_origin": tile.sample_grid.raster_from_pixel(tile.width)[:, 2],
        "tile_origin": (tile.x, tile.y),
        "window_origin": origin,
        "window_size": size,
        "pinhole_reach": tile.sample_grid.reach,
        "window_samples": samples,
        "raster_size": tile.raster_size,
        "owned": tile.owned,
    }
