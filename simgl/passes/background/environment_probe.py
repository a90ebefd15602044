"""Environment probes: the Earth around each spacecraft, and the light that surfaces get of it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor, Future

import moderngl

from simgl.arrays import Array32
from simgl.environment_map import (
    COARSE,
    FINE,
    SkyRadiance,
    irradiance,
    prepare_irradiance,
    with_borders,
)
from simgl.glossy_sky import ROUGHNESS, prefiltered, prepare_lobes
from simgl.lru_cache import LruCache
from simgl.passes.drawn_spacecraft import EnvironmentProbe, SkyTextures
from simgl.view.background import LIMB_TEXELS, SKY_TEXELS, TERMINATOR_TEXELS, SkyView

# Probes are cached for so many views; an image of more spacecraft caches as many as it needs.
CAPACITY = 8

# Irradiance, and radiance prefiltered for glossy lobes.
_Integrals = tuple[Array32, Array32]


class EnvironmentProbeStore:
    """The probes of the last views. Whoever owns it draws the skies that are ``missing``.

    executor : integrates a sky while the caller goes on
    """

    def __init__(self, ctx: moderngl.Context, executor: Executor) -> None:
        self._ctx, self._executor = ctx, executor
        self._unused: list[EnvironmentProbe] = []
        self._probes = LruCache[tuple[object, ...], EnvironmentProbe](CAPACITY, self._unused.append)
        # Added, and being integrated.
        self._added: dict[tuple[object, ...], tuple[SkyRadiance, Future[_Integrals]]] = {}
        # Of probes that are yet to hold them.
        self._unwritten: dict[tuple[object, ...], Future[_Integrals]] = {}

    def prepare(self) -> None:
        """Make what skies of every size need, in the executor's thread: an orbit meets them all."""
        texels = SKY_TEXELS, TERMINATOR_TEXELS, LIMB_TEXELS
        self._executor.submit(prepare_irradiance, texels)
        self._executor.submit(prepare_lobes)

    def missing(self, views: Sequence[SkyView | None]) -> list[SkyView]:
        """The different views whose radiance has to be added before ``of`` knows their probes."""
        wanted = {view.key: view for view in views if view is not None}
        return [
            view
            for key, view in wanted.items()
            if key not in self._probes and key not in self._added
        ]

    def add(self, view: SkyView, sky: SkyRadiance) -> None:
        """Take the radiance of a view that is missing."""
        self._added[view.key] = sky, self._executor.submit(_integrals, sky)

    def of(self, views: Sequence[SkyView | None]) -> list[EnvironmentProbe | None]:
        """The probe of each view, None for none. They stay as they are until the next call.

        Their integrals are there after ``complete``.
        """
        wanted = [view for view in views if view is not None]
        self._probes.reserve(len(wanted))
        # Cached ones first, so that they do not make room for new ones.
        wanted.sort(key=lambda view: view.key not in self._probes)
        try:
            probes = {view.key: self._probe(view) for view in wanted}
        finally:
            # Also what a frame that failed has left.
            self._added.clear()
        return [None if view is None else probes[view.key] for view in views]

    def complete(self) -> None:
        """Write the integrals of the last probes, as soon as they are made."""
        while self._unwritten:
            key, integrals = self._unwritten.popitem()
            probe = self._probes.find(key)
            if probe is None:
                continue
            try:
                plane_irradiance, glossy = integrals.result()
            except BaseException:
                self._probes.pop(key)
                self._unused.append(probe)
                raise
            probe.lobes.write(glossy)
            probe.irradiance.write(plane_irradiance)

    def _probe(self, view: SkyView) -> EnvironmentProbe:
        return self._probes.get(view.key, lambda: self._uploaded(view))

    def _uploaded(self, view: SkyView) -> EnvironmentProbe:
        sky, self._unwritten[view.key] = self._added[view.key]
        cube, lobes, plane = self._textures(view.texels)
        cube.write(with_borders(sky.radiance))
        return EnvironmentProbe(sky=sky, cube=cube, lobes=lobes, irradiance=plane)

    def _textures(self, texels: int) -> SkyTextures:
        """Unused ones, or new ones."""
        if self._unused:
            cube, lobes, plane = self._unused.pop().textures
            if cube.size == _size(texels):
                return cube, lobes, plane
            cube.release()
            return self._cube(texels), lobes, plane
        lobes = self._ctx.texture3d((FINE, FINE, len(ROUGHNESS)), 4, dtype="f4")
        plane = self._ctx.texture((COARSE, COARSE), 4, dtype="f4")
        lobes.repeat_x = lobes.repeat_y = lobes.repeat_z = False
        plane.repeat_x = plane.repeat_y = False
        for texture in (lobes, plane):
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        return self._cube(texels), lobes, plane

    def _cube(self, texels: int) -> moderngl.Texture:
        """Of its faces, one below the other.

        llvmpipe rounds what it reads of a cube map near an edge otherwise, at all points that it
        works out together. Some of these are not drawn, and are left from the frame before.
        """
        cube = self._ctx.texture(_size(texels), 4, dtype="f4")
        cube.filter = (moderngl.LINEAR, moderngl.LINEAR)
        cube.repeat_x = cube.repeat_y = False
        return cube

    def release(self) -> None:
        """Free everything."""
        self._probes.clear()
        for probe in self._unused:
            for texture in probe.textures:
                texture.release()
        self._unused.clear()


def _size(texels: int) -> tuple[int, int]:
    """Of a cube's texture, columns and rows."""
    return texels + 2, 6 * (texels + 2)


def _integrals(sky: SkyRadiance) -> _Integrals:
    plane_irradiance = irradiance(sky)
    return plane_irradiance, prefiltered(sky, plane_irradiance)
