"""The programs that draw the Earth, each made when it is first drawn with."""

from __future__ import annotations

import moderngl

from simgl.gpu.tile_quads import TileFaces, TileQuads
from simgl.passes.background.air import AIR_SAMPLERS
from simgl.passes.background.air_march import AIR_VIEW
from simgl.passes.background.air_tables import AIR
from simgl.passes.background.earth_textures import SAMPLERS
from simgl.passes.background.planet_blocks import AURORA, GROUND_BANDS, PLANET, REGOLITH
from simgl.passes.background.planet_variants import (
    band_samplers,
    knows_ground_bands,
    unread_samplers,
)


class PlanetPrograms:
    """Owns them; software renderers pay for what a shader could do: an Earth of one albedo has its
    own, and so has one without air.

    faces : that they draw
    """

    def __init__(self, ctx: moderngl.Context, faces: TileFaces) -> None:
        self._ctx, self._faces = ctx, faces
        self._programs: dict[tuple[str, ...], TileQuads] = {}

    def of(self, name: str, variant: tuple[str, ...]) -> TileQuads:
        """That of a shader with these defines."""
        key = name, *variant
        if key not in self._programs:
            ground = SAMPLERS if "EARTH_MAPS" in variant else []
            air = AIR_SAMPLERS if "AIR" in variant else ()
            samplers = {sampler: unit for unit, sampler in enumerate((*ground, *air))}
            for sampler in unread_samplers(name, variant):
                samplers.pop(sampler, None)
            samplers |= band_samplers(name, variant)
            if name in ("planet/air", "planet/glow", "planet/aurora"):
                read = AIR_SAMPLERS[2:] if "AIR" in variant else ()
                samplers = {sampler: unit for sampler, unit in samplers.items() if sampler in read}
            # Those that each kind of program reads; the others are spare.
            read_by = (
                ("AIR" in variant, (AIR, AIR_VIEW)),
                ("REGOLITH" in variant, (REGOLITH,)),
                (knows_ground_bands(name, variant), (GROUND_BANDS,)),
                (name == "planet/aurora", (AURORA,)),
            )
            shared = [PLANET, *(block for read, some in read_by if read for block in some)]
            spare = tuple(block for read, some in read_by if not read for block in some)
            vertex = "planet/tiles.vert" if name == "planet/tiles" else "planet/pixels.vert"
            self._programs[key] = TileQuads(
                self._ctx, name, self._faces, vertex, samplers, variant, shared=shared, spare=spare
            )
        return self._programs[key]

    def release(self) -> None:
        """Free them."""
        for program in self._programs.values():
            program.release()
