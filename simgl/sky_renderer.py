"""Draws what a spacecraft has around it in visible light: what lights it."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np

from simgl.environment_map import SkyRadiance, add_small_light, draw_faces_out
from simgl.gpu.context import begin_draws
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget, TargetStore
from simgl.lru_cache import LruCache
from simgl.passes.background.planet import PlanetPass
from simgl.view.background import SkyView

_BANDS = (Format("f4", 4),)
# Kept for what asks for the sky of one state after the other: cameras, and temperatures.
_SKIES = 4


class SkyRenderer:
    """Skies by the pass of the Earth, which its owner lends."""

    def __init__(self, ctx: moderngl.Context, planet: PlanetPass) -> None:
        self._ctx, self._planet = ctx, planet
        self._targets = TargetStore(ctx)
        self._skies = LruCache[tuple[object, ...], SkyRadiance](_SKIES)

    def sky(self, view: SkyView) -> SkyRadiance:
        """Drawn and read back, or found again."""
        return self.begin(view)()

    def begin(self, view: SkyView, place: int = 0) -> Callable[[], SkyRadiance]:
        """Begin to draw a sky, or find it again; what is returned waits for it.

        place : skies in different places may be under way at the same time
        """
        if (known := self._skies.find(view.key)) is not None:
            return lambda: self._skies.get(view.key, lambda: known)
        texels = view.texels
        target = self._targets.of(f"sky {place}", (texels, 6 * texels), _BANDS)
        self._planet.draw_sky(view, target.framebuffer)
        begin_draws(self._ctx)
        return lambda: self._skies.get(view.key, lambda: _read_back(view, target))

    def release(self) -> None:
        """Free what is its own."""
        release_all(self._ctx, self._targets)


def _read_back(view: SkyView, target: ImageTarget) -> SkyRadiance:
    # In place from here on: at the limb's fineness a copy takes milliseconds.
    radiance = np.empty((6, view.texels, view.texels, 4), dtype=np.float32)
    target.read_into(radiance)
    draw_faces_out(radiance, view.face_texels)
    if view.moon is not None:
        add_small_light(radiance, view.moon.direction, view.moon.irradiance)
    return SkyRadiance(radiance=radiance)
