"""The sky of each spacecraft: the background around it, and the light that surfaces get of it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import Future

import moderngl

from simgl.arrays import Array32
from simgl.environment_map import COARSE, FINE, ROUGHNESS, SkyRadiance, irradiance, prefiltered
from simgl.gpu.render_targets import Format, ImageTarget
from simgl.passes.drawn_spacecraft import EnvironmentProbe, SkyTextures
from simgl.radiosity.solver import beside
from simgl.view.background import Background, SkyView

# Skies kept for views that come back; a picture of more spacecraft keeps as many as it needs.
KEPT = 8

# Irradiance, and what glossy lobes see.
_Sums = tuple[Array32, Array32]
DrawBackground = Callable[[Background, moderngl.Framebuffer, tuple[int, int, int, int]], None]


def _sums(sky: SkyRadiance) -> _Sums:
    plane_irradiance = irradiance(sky)
    return plane_irradiance, prefiltered(sky, plane_irradiance)


class EnvironmentProbePass:
    """Draws a spacecraft's sky with the pass that draws backgrounds, or finds it already drawn."""

    def __init__(self, ctx: moderngl.Context, draw_background: DrawBackground) -> None:
        self._ctx, self._draw_background = ctx, draw_background
        # By their number of texels along an edge of a face.
        self._targets: dict[int, ImageTarget] = {}
        self._probes: OrderedDict[tuple[object, ...], EnvironmentProbe] = OrderedDict()
        # Read back, and being summed.
        self._looked: dict[tuple[object, ...], tuple[SkyRadiance, Future[_Sums]]] = {}

    def look(self, views: Sequence[SkyView | None]) -> None:
        """Draw and read back what ``draw`` will be asked for; it is summed beside other work."""
        for view in views:
            if view is None or view.key in self._probes or view.key in self._looked:
                continue
            sky = self._look(view)
            self._looked[view.key] = sky, beside().submit(_sums, sky)

    def draw(self, views: Sequence[SkyView | None]) -> list[EnvironmentProbe | None]:
        """The probe of each view, None for none. They stay as they are until the next call."""
        self.look(views)
        wanted = [view for view in views if view is not None]
        for view in wanted:
            if view.key in self._probes:
                self._probes.move_to_end(view.key)
        kept = max(KEPT, len(wanted))
        for view in wanted:
            if view.key not in self._probes:
                self._probes[view.key] = self._drawn(view, kept)
        # A picture that failed may have left some.
        self._looked.clear()
        return [None if view is None else self._probes[view.key] for view in views]

    def _drawn(self, view: SkyView, kept: int) -> EnvironmentProbe:
        sky, sums = self._looked[view.key]
        cube, lobes, plane = self._free_textures(kept, view.texels)
        for face, radiance in enumerate(sky.radiance):
            cube.write(face, radiance.tobytes())
        plane_irradiance, glossy = sums.result()
        lobes.write(glossy.tobytes())
        plane.write(plane_irradiance.tobytes())
        return EnvironmentProbe(sky=sky, cube=cube, lobes=lobes, irradiance=plane)

    def _look(self, view: SkyView) -> SkyRadiance:
        n = view.texels
        if n not in self._targets:
            self._targets[n] = ImageTarget(self._ctx, (n, 6 * n), (Format("f4", 4),))
        target = self._targets[n]
        for row, face in enumerate(view.faces):
            self._draw_background(face, target.framebuffer, (0, row * n, n, n))
        return SkyRadiance(radiance=target.read().reshape(6, n, n, 4))

    def _free_textures(self, kept: int, texels: int) -> SkyTextures:
        if len(self._probes) >= kept:
            cube, lobes, plane = self._probes.popitem(last=False)[1].textures
            if cube.size == (texels, texels):
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

    def _cube(self, texels: int) -> moderngl.TextureCube:
        cube = self._ctx.texture_cube((texels, texels), 4, dtype="f4")
        cube.filter = (moderngl.LINEAR, moderngl.LINEAR)
        return cube

    def release(self) -> None:
        """Free everything."""
        for probe in self._probes.values():
            for texture in probe.textures:
                texture.release()
        self._probes.clear()
        self._ctx.detect_framebuffer(0).use()
        for target in self._targets.values():
            target.release()
        self._targets.clear()
