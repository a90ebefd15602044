"""The Earth in one light, and where an image of it is drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import moderngl

from simgl.gpu.pipeline_state import State
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.view.background import Background, Moonlight, PlanetView
from simgl.view.image_box import Box

# Pixels larger than this [m] resolve nothing of the chart.
_FAR = 6e3


@dataclass(frozen=True, kw_only=True, eq=False)
class LitEarth:
    """The Earth in the light of the Sun or of the Moon, and where that light is drawn.

    planet : with the Moon in the Sun's place for moonlight
    area : x, y, width, height of the target's rectangle [pixels]
    block : of the uniforms of this light
    """

    planet: PlanetView
    background: Background
    target: moderngl.Framebuffer
    area: Box
    state: State
    block: UniformBuffer

    @property
    def mapped(self) -> bool:
        """Whether it has maps, and not one albedo."""
        return self.planet.earth.albedo is None

    @property
    def nadir_pixel(self) -> float:
        """Edge of a pixel straight below [m]."""
        return self.planet.height / float(self.background.intrinsics[0, 0])

    @property
    def far(self) -> bool:
        """Whether pixels resolve nothing of the chart."""
        return self.mapped and self.nadir_pixel > _FAR

    def by_moon(self, moon: Moonlight, state: State, block: UniformBuffer) -> LitEarth:
        """The same in moonlight."""
        planet = self.planet.in_moonlight(moon)
        return replace(self, planet=planet, state=state, block=block)
