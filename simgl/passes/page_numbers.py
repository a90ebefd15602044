"""Numbers of the pages of a tile, by compute shaders: the CPU reads back no count of them.

The draws that follow are given room for more pages than there are, and end with the last one. Where
there are more than that, the image is drawn again with more room.
"""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.arrays import AnyArray
from simgl.gpu.compute_program import GROUP, ComputeProgram
from simgl.gpu.context import wait_for_draws
from simgl.gpu.release import all_or_nothing, release_all
from simgl.gpu.render_targets import GrowingTarget, textures_of
from simgl.passes.shading_points import ENTRIES

# Blocks of a chunk, as in shaders/gbuffer/page_numbers.comp.
_CHUNK = 8 * GROUP[0] * GROUP[1]
# Pages of 256 blocks for which there is room at first, and how many times more there is than a tile
# was seen to take. An image that spacecraft fill takes 1.1 pages a block.
_PER_BLOCKS, _SPARE = 320, 1.25
# End of the rows, number of pages, what is lacking: as struct Pages there.
_NONE = np.zeros(4, dtype=np.uint32)


class PageNumbers:
    """What ``page_table`` makes of blocks without wide pages, on the GPU."""

    @all_or_nothing
    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        steps = {
            "SUMS": (["counts"], ["size"]),
            "STARTS": ([], ["chunk_count", "block_count", "capacity"]),
            "ENTRIES": (["counts"], ["size", "capacity"]),
        }
        self._sums, self._starts, self._entries = (
            ComputeProgram(
                ctx,
                "gbuffer/page_numbers",
                samplers=samplers,
                parameters=parameters,
                defines={step: 1},
            )
            for step, (samplers, parameters) in steps.items()
        )
        self._chunks = ctx.buffer(reserve=4)
        # Whose first word tells how many rows of points there are.
        self.rows = ctx.buffer(_NONE.tobytes())
        self._per_blocks = _PER_BLOCKS
        self._unchecked = False

    def number(
        self,
        counts: moderngl.Texture,
        blocks: tuple[int, int],
        entries: GrowingTarget,
        first_pages: GrowingTarget,
    ) -> int:
        """Fill the tables; the rows of squares for which there is room.

        counts : R8UI, of the blocks (shaders/gbuffer/pages.frag)
        blocks : columns and rows
        entries, first_pages : R32UI, as ``page_table`` gives them
        """
        block_count = blocks[0] * blocks[1]
        rows = max(1, -(-self._per_blocks * block_count // (256 * ENTRIES)))
        chunks = -(-block_count // _CHUNK)
        if self._chunks.size < 4 * chunks:
            self._chunks.release()
            self._chunks = self._ctx.buffer(reserve=4 * chunks)
        tables = (entries, (ENTRIES, rows)), (first_pages, blocks)
        for unit, (target, size) in enumerate(tables):
            (texture,) = textures_of(target.covering(size)[0])
            texture.bind_to_image(unit, read=False, write=True)
        counts.use(0)
        grid, capacity = (GROUP[0] * chunks, GROUP[1], 1), rows * ENTRIES
        self._sums.run(grid, [self._chunks], size=blocks)
        self._starts.run(
            (*GROUP, 1),
            [self._chunks, self.rows],
            chunk_count=chunks,
            block_count=float(block_count),
            capacity=capacity,
        )
        self._entries.run(grid, [self._chunks], size=blocks, capacity=capacity)
        self._unchecked = True
        return rows

    def read(self, entries: moderngl.Texture) -> AnyArray:
        """(rows of squares, ENTRIES) entries of the last tile, as ``page_table`` gives them.

        Waits for what is drawn.
        """
        wait_for_draws(self._ctx)
        rows = int(np.frombuffer(self.rows.read(4), dtype=np.int32)[0]) // 4
        if rows == 0:
            return np.zeros((1, ENTRIES), dtype=np.uint32)
        data = np.frombuffer(entries.read(), dtype=np.uint32).reshape(-1, entries.width)
        return data[:rows, :ENTRIES]

    def lacked_room(self) -> bool:
        """Whether a tile since the last call had more pages than there was room for. There is now.

        Waits for what is drawn.
        """
        if not self._unchecked:
            return False
        self._unchecked = False
        wait_for_draws(self._ctx)
        needed = int(np.frombuffer(self.rows.read(), dtype=np.uint32)[2])
        if needed == 0:
            return False
        self._per_blocks = int(np.ceil(_SPARE * needed))
        self.rows.write(_NONE.tobytes())
        return True

    def release(self) -> None:
        """Free everything."""
        programs = self._sums, self._starts, self._entries
        release_all(self._ctx, *programs, self._chunks, self.rows)
