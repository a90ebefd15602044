"""The Earth in one light, and where an image of it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import moderngl

from simgl.arrays import Array32, Mask
from simgl.gpu.fullscreen import Texture
from simgl.gpu.pipeline_state import State
from simgl.gpu.uniform_blocks import UniformBuffer
from simgl.passes.background.tile_kinds import TileDraws
from simgl.view.background import Background, Moonlight, PlanetView
from simgl.view.background_tiles import BackgroundTiles, GroundTiles
from simgl.view.image_box import Box

# Pixels larger than this [m] resolve nothing of the chart.
_FAR = 6e3


@dataclass(frozen=True, kw_only=True, eq=False)
class LitEarth:
    """The Earth in the light of the Sun or of the Moon, and where images of it are drawn.

    planet : before the first image; with the Moon in the Sun's place for moonlight
    turns : its ``sphere_from_camera`` before each image, from one place
    background : of the first image; of the others it has the size and the Sun
    areas : x, y, width, height of the target's rectangle of each [pixels]
    block : of the uniforms of this light, with a slot for each image
    of_sky : whether the images are what a spacecraft has around it
    """

    planet: PlanetView
    turns: tuple[Array32, ...]
    background: Background
    target: moderngl.Framebuffer
    areas: tuple[Box, ...]
    state: State
    block: UniformBuffer
    of_sky: bool

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
        return replace(self, planet=self.planet.in_moonlight(moon), state=state, block=block)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedLight:
    """What is drawn of the Earth in one light.

    tiles : that it covers
    lamps : whether cities shine
    textures : that it reads, besides the air's
    covered : (images, rows, columns) tiles of which each pixel is drawn
    magnified : the maps' texels are larger than pixels, and they are read without mipmaps
    """

    lit: LitEarth
    tiles: BackgroundTiles
    lamps: bool
    textures: Sequence[Texture]
    covered: Mask
    magnified: bool
    draws: TileDraws


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedEarth:
    """Images of the Earth, before they are drawn.

    ground : in any light
    """

    ground: GroundTiles
    sunlit: PlannedLight


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedImage:
    """A background, before it is drawn.

    area : x, y, width, height of the target's rectangle [pixels]
    earth : None where none is seen
    """

    background: Background
    target: moderngl.Framebuffer
    area: Box
    earth: PlannedEarth | None
