"""Thermal radiance of a spacecraft's shading points, from temperatures at its vertices."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import Array32
from simgl.gpu.mesh_tables import table
from simgl.gpu.release import all_or_nothing
from simgl.gpu.render_targets import GrowingTarget, textures_of
from simgl.passes.drawn_spacecraft import DrawnSpacecraft
from simgl.passes.mesh_store import VertexLighting
from simgl.passes.shading_points import (
    OTHERS,
    PointScreen,
    ShadingPoints,
    draw_marked,
    gbuffer_units,
    point_shader,
)
from simgl.passes.shared_blocks import SPACECRAFT
from simgl.passes.view_blocks import ViewBlocks
from simgl.thermal.thermal_view import ThermalLight

_PLANCK_UNIT = 8


class ThermalPass:
    """Band radiance and temperature of what a thermal camera sees of spacecraft.

    Holds the tables of the last frame: temperatures at vertices ride where the visible image has
    the light of other surfaces.
    """

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context, blocks: ViewBlocks) -> None:
        self._ctx, self._blocks = ctx, blocks
        channels = gbuffer_units("position", "normal_roughness", "indirect")
        samplers = channels | {"planck": _PLANCK_UNIT}
        self._screen: PointScreen = point_shader(
            ctx, "thermal/thermal", OTHERS, [SPACECRAFT], samplers
        )
        self._target = GrowingTarget(ctx, [[0]])
        self._tables: list[moderngl.Texture] = []

    def begin(self, planck: Array32) -> moderngl.Texture:
        """Drop the last frame's tables; the table of Planck's law of this one."""
        self._forget()
        return self._keep(planck)

    def lighting(self, light: ThermalLight) -> VertexLighting:
        """The vertices of a spacecraft; valid until the next frame begins."""
        count, sides, _ = light.values.shape
        # The second texel of each is not read.
        texels = np.zeros((count * sides, 2, 4), dtype=np.float32)
        texels[:, 0] = light.values.reshape(-1, 4)
        return VertexLighting(
            mesh=light.mesh,
            light=self._keep(texels.reshape(-1, 4)),
            defines=("INTERREFLECTION", "TWO_SIDED") if sides == 2 else ("INTERREFLECTION",),
        )

    def draw(
        self, points: ShadingPoints, drawn: DrawnSpacecraft, planck: moderngl.Texture
    ) -> moderngl.Texture:
        """RGBA32F of the points: radiance in W m-2 sr-1, as the detector counts, temperature, 1.

        points : those of this spacecraft have been looked up last
        """
        (target,) = self._target.covering(points.size, points.depth)
        self._blocks.bind_spacecraft(drawn)
        for unit, texture in enumerate(points.textures):
            texture.use(unit)
        planck.use(_PLANCK_UNIT)
        draw_marked(target, points, self._screen)
        return textures_of(target)[0]

    def _keep(self, texels: Array32) -> moderngl.Texture:
        self._tables.append(table(self._ctx, texels))
        return self._tables[-1]

    def _forget(self) -> None:
        for texture in self._tables:
            texture.release()
        self._tables.clear()

    def release(self) -> None:
        """Free everything."""
        self._forget()
        self._screen.release()
        self._target.release()
