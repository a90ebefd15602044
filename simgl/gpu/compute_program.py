"""Compute shaders in files of their own, which work on storage buffers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import moderngl

from simgl.gpu.program import load_compute_program

# Of a workgroup, columns and rows: neighbouring columns lie side by side in memory.
GROUP = (32, 4)


class ComputeProgram:
    """The shader ``NAME.comp``, one invocation for each place of a grid.

    samplers : texture units are their places in this sequence
    parameters : its other uniforms
    defines : of the variant
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        name: str,
        *,
        samplers: Sequence[str] = (),
        parameters: Sequence[str] = (),
        defines: Mapping[str, int] | None = None,
    ) -> None:
        self._ctx = ctx
        group = dict(zip(("GROUP_COLUMNS", "GROUP_ROWS"), GROUP, strict=True))
        self._program = load_compute_program(
            ctx,
            name,
            samplers=samplers,
            parameters=parameters,
            defines={**group, **(defines or {})},
        )
        self._given: dict[str, object] = {}

    def run(
        self,
        grid: tuple[int, int, int],
        buffers: Sequence[moderngl.Buffer],
        **parameters: object,
    ) -> None:
        """Over columns, rows and layers; textures and images are bound by the caller.

        buffers : by binding
        """
        for name, value in parameters.items():
            if self._given.get(name) != value:
                self._program[name] = self._given[name] = value
        for binding, buffer in enumerate(buffers):
            buffer.bind_to_storage_buffer(binding)
        columns, rows, layers = grid
        self._program.run(-(-columns // GROUP[0]), -(-rows // GROUP[1]), layers)
        # Whatever comes next may read it in any way.
        self._ctx.memory_barrier()

    def release(self) -> None:
        """Free everything."""
        self._program.release()
