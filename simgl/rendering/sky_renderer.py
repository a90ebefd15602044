"""Draws what a spacecraft has around it in visible light: what lights it."""

from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.environment_map import SkyRadiance, add_small_light, fill_between
from simgl.gpu.context import begin_draws
from simgl.gpu.release import release_all
from simgl.gpu.render_targets import Format, ImageTarget, TargetStore
from simgl.lru_cache import LruCache
from simgl.passes.background.planet import PlanetPass
from simgl.view.background import LIMB_TEXELS, SKY_TEXELS, SkyView

_BANDS = (Format("f4", 4),)
# Kept for what asks for the sky of one state after the other: cameras, and temperatures.
_SKIES = 4


class SkyRenderer:
    """Skies by the pass of the Earth, which its owner lends."""

    def __init__(self, ctx: moderngl.Context, planet: PlanetPass) -> None:
        self._ctx, self._planet = ctx, planet
        self._targets = TargetStore(ctx)
        self._skies = LruCache[tuple[object, ...], SkyRadiance](_SKIES)

    def prepare(self, view: SkyView) -> None:
        """Compile what draws skies wherever the spacecraft goes, so that no image waits for it."""
        for texels in (SKY_TEXELS, LIMB_TEXELS):
            self._planet.prepare_sky(view, texels, self._target(texels, 0).framebuffer)

    def sky(self, view: SkyView) -> SkyRadiance:
        """Drawn and read back, or found again."""
        return self.begin(view)()

    def begin(self, view: SkyView, place: int = 0) -> Callable[[], SkyRadiance]:
        """Begin to draw a sky, or find it again; what is returned waits for it.

        place : skies in different places may be under way at the same time
        """
        if (known := self._skies.find(view.key)) is not None:
            return lambda: self._skies.get(view.key, lambda: known)
        drawn = self._in_parts if view.texels == LIMB_TEXELS else self._complete
        made = drawn(view, place)
        begin_draws(self._ctx)
        return lambda: self._skies.get(view.key, lambda: _with_moon(view, made()))

    def _complete(self, view: SkyView, place: int) -> Callable[[], Array32]:
        target = self._target(view.texels, place)
        self._planet.draw_sky(view, view.texels, target.framebuffer)
        return lambda: _read_back(target)

    def _in_parts(self, view: SkyView, place: int) -> Callable[[], Array32]:
        """Finely only where nearly all light comes from: texels elsewhere, on the night side and in
        the dark, cost as much."""
        coarse, fine = (self._target(texels, place) for texels in (SKY_TEXELS, view.texels))
        self._planet.draw_sky(view, SKY_TEXELS, coarse.framebuffer)
        tiles = self._planet.draw_sky(view, view.texels, fine.framebuffer, brightest=True)

        def put_together() -> Array32:
            radiance = _read_back(fine)
            fill_between(radiance, tiles, _read_back(coarse))
            return radiance

        return put_together

    def _target(self, texels: int, place: int) -> ImageTarget:
        return self._targets.of(f"sky {place}", (texels, 6 * texels), _BANDS)

    def release(self) -> None:
        """Free what is its own."""
        release_all(self._ctx, self._targets)


def _read_back(target: ImageTarget) -> Array32:
    """(6, n, n, 4) radiance of a target's squares."""
    n = target.size[0]
    # Once: of the limb's fineness a copy takes milliseconds.
    radiance = np.empty((6, n, n, 4), dtype=np.float32)
    target.read_into(radiance)
    return radiance


def _with_moon(view: SkyView, radiance: Array32) -> SkyRadiance:
    if view.moon is not None:
        add_small_light(radiance, view.moon.direction, view.moon.irradiance)
    return SkyRadiance(radiance=radiance)
