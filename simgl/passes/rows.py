"""Rows: the mean of what each row sees over its exposure, from drawings of several moments."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import Array
from simgl.gpu.fullscreen import Screen
from simgl.gpu.pipeline_state import State
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import table_texture

Area = tuple[int, int, int, int]

_UNITS = {"seen": 0, "row_shares": 1, "behind": 2}


class RowsPass:
    """Adds up radiances, each with a weight for every row."""

    fills = State()
    adds = State(blend=(moderngl.ONE, moderngl.ONE))

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        seen, shares, behind = ({name: unit} for name, unit in _UNITS.items())
        self._copying = Screen(ctx, "rows/rows", 0.0, [], seen)
        self._shared = Screen(ctx, "rows/rows", 0.0, [], seen | shares, {"ROW_SHARES": 1})
        defines = {"ROW_SHARES": 1, "LESS": 1}
        self._beyond = Screen(ctx, "rows/rows", 0.0, [], seen | shares | behind, defines)

    def copy(self, seen: moderngl.Texture, target: moderngl.Framebuffer, area: Area) -> None:
        """Fill an area of a target with a radiance.

        area : x, y, width, height [pixels]
        """
        seen.use(_UNITS["seen"])
        self.fills.apply(self._ctx, target, area, area)
        self._copying.draw()

    def add(self, seen: moderngl.Texture, shares: Array, target: moderngl.Framebuffer) -> None:
        """Add shares, (height,), of a radiance to a target."""
        area = 0, 0, *target.size
        self._add(self._shared, [seen], shares, target, area)

    def add_beyond(
        self,
        seen: moderngl.Texture,
        behind: moderngl.Texture,
        shares: Array,
        target: moderngl.Framebuffer,
        area: Area,
    ) -> None:
        """Add shares of what a radiance is more than another in an area."""
        self._add(self._beyond, [seen, behind], shares, target, area)

    def _add(
        self,
        screen: Screen,
        textures: list[moderngl.Texture],
        shares: Array,
        target: moderngl.Framebuffer,
        area: Area,
    ) -> None:
        x, y, width, height = area
        rows = np.flatnonzero(shares[y : y + height])
        if not rows.size:
            return
        weights = table_texture(self._ctx, shares.astype(np.float32)[:, None])
        for unit, texture in zip((_UNITS["seen"], _UNITS["behind"]), textures, strict=False):
            texture.use(unit)
        weights.use(_UNITS["row_shares"])
        used = x, y + int(rows[0]), width, int(rows[-1] - rows[0] + 1)
        self.adds.apply(self._ctx, target, used, used)
        screen.draw()
        weights.release()

    def release(self) -> None:
        """Free everything."""
        for screen in (self._copying, self._shared, self._beyond):
            screen.release()
