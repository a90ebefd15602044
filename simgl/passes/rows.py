"""Rows: the mean of what each row sees over its exposure, from drawings of several moments."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.gpu.fullscreen import Screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import table_texture

_UNITS = {"seen": 0, "row_shares": 1, "behind": 2}


class RowsPass:
    """Adds up radiances, each with a weight for every row."""

    fills = State()
    adds = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        seen = {name: unit for name, unit in _UNITS.items() if name != "behind"}
        self._whole = Screen(ctx, "rows/rows", 0.0, [], seen)
        self._beyond = Screen(ctx, "rows/rows", 0.0, [], _UNITS, {"LESS": 1})

    def copy(self, seen: moderngl.Texture, shares: Array, target: moderngl.Framebuffer) -> None:
        """Fill the rows that have a share, (height,), with that share of a radiance."""
        self._draw(self._whole, self.fills, [seen], shares, target)

    def add(self, seen: moderngl.Texture, shares: Array, target: moderngl.Framebuffer) -> None:
        """Add shares, (height,), of a radiance to a target."""
        self._draw(self._whole, self.adds, [seen], shares, target)

    def add_beyond(
        self,
        seen: moderngl.Texture,
        behind: moderngl.Texture,
        shares: Array,
        target: moderngl.Framebuffer,
    ) -> None:
        """Add shares of what a radiance is more than another."""
        self._draw(self._beyond, self.adds, [seen, behind], shares, target)

    def _draw(
        self,
        screen: Screen,
        state: State,
        textures: list[moderngl.Texture],
        shares: Array,
        target: moderngl.Framebuffer,
    ) -> None:
        rows = np.flatnonzero(shares)
        if not rows.size:
            return
        first, count = int(rows[0]), int(rows[-1] - rows[0] + 1)
        weights = table_texture(self._ctx, shares.astype(np.float32)[:, None])
        for unit, texture in zip((0, 2), textures, strict=False):
            texture.use(unit)
        weights.use(_UNITS["row_shares"])
        area = (0, first, target.width, count)
        state.apply(self._ctx, target, area, area)
        screen.draw()
        weights.release()

    def release(self) -> None:
        """Free everything."""
        self._whole.release()
        self._beyond.release()
