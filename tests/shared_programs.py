"""Programs of the tests' context: compiled once in a session, by whichever test needs them first.

Most tests open a simulator of their own, which takes most of its time to assemble and compile the
same programs. A program has no state but the bindings that it is loaded with, so that many may draw
with one. Each is lent it, and a test that does not give it back is seen to leak.
"""

from __future__ import annotations

import copy
import sys
from collections import Counter
from collections.abc import Mapping, Sequence

import moderngl
import pytest

from simgl import assets
from simgl.gpu.program import load_program
from simgl.gpu.uniform_blocks import Block
from tests.watched_context import WatchedContext


class _Lent(moderngl.Program):
    """A program that is given back, where another is deleted."""

    def release(self) -> None:
        """Give it back, once."""
        give_back, self.extra = self.extra, _nothing
        give_back()

    def __del__(self) -> None:
        # As moderngl does it: what is forgotten is left behind unless the context collects it.
        if self.ctx.gc_mode is not None:
            self.release()


def _nothing() -> None:
    """It is back already."""


class SharedPrograms:
    """Lends the programs of a context."""

    def __init__(self, watched: WatchedContext) -> None:
        self._watched = watched
        self._shipped = assets.shaders()
        self._programs: dict[object, moderngl.Program] = {}
        self._lent = 0

    def share(self, patch: pytest.MonkeyPatch) -> None:
        """From here on whoever loads a program of the context is lent it."""
        compiled = moderngl.Context.program

        def shared(
            ctx: moderngl.Context,
            name: str,
            *,
            vertex: str | None = None,
            blocks: Sequence[Block] = (),
            spare: Sequence[Block] = (),
            samplers: Sequence[str] | Mapping[str, int] = (),
            defines: Mapping[str, int | float] | None = None,
        ) -> moderngl.Program:
            def load() -> moderngl.Program:
                return load_program(
                    ctx,
                    name,
                    vertex=vertex,
                    blocks=blocks,
                    spare=spare,
                    samplers=samplers,
                    defines=defines,
                )

            # A test that looks at what is compiled, or has shaders of its own, sees all of it.
            ours = ctx is self._watched.ctx and moderngl.Context.program is compiled
            if not ours or assets.shaders() != self._shipped:
                return load()
            units = samplers.items() if isinstance(samplers, Mapping) else samplers
            of_blocks = tuple((b.name, b.binding, b.include, str(b.dtype)) for b in blocks)
            of_spare = tuple((b.include, str(b.dtype)) for b in spare)
            variant = tuple(sorted((defines or {}).items()))
            key = name, vertex, of_blocks, of_spare, tuple(units), variant
            if key not in self._programs:
                with self._watched.not_counted():
                    self._programs[key] = load()
            return self._lend(self._programs[key])

        for module in list(sys.modules.values()):
            loads = vars(module).get("load_program") is load_program
            if loads and module is not sys.modules[__name__]:
                patch.setattr(module, "load_program", shared)

    @property
    def living(self) -> Counter[str]:
        """How many objects of each kind were made or lent, and not deleted nor given back."""
        return self._watched.living + Counter(Program=self._lent)

    def _lend(self, program: moderngl.Program) -> moderngl.Program:
        lent = copy.copy(program)
        lent.__class__ = _Lent
        lent.extra = self._take_back
        self._lent += 1
        return lent

    def _take_back(self) -> None:
        self._lent -= 1

    def release(self) -> None:
        """Free them all."""
        for program in self._programs.values():
            program.release()
