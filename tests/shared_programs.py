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
from typing import Any

import moderngl
import pytest

from simgl import assets
from simgl.gpu.program import load_program
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


def _key(option: Any) -> object:
    """What tells an option of ``load_program`` from others, to be looked up by."""
    if isinstance(option, Mapping):
        return tuple((name, _key(option[name])) for name in sorted(option))
    if isinstance(option, Sequence) and not isinstance(option, str):
        return tuple(map(_key, option))
    return option


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

        def shared(ctx: moderngl.Context, name: str, **options: Any) -> moderngl.Program:
            # A test that looks at what is compiled, or has shaders of its own, sees all of it.
            ours = ctx is self._watched.ctx and moderngl.Context.program is compiled
            if not ours or assets.shaders() != self._shipped:
                return load_program(ctx, name, **options)
            key = name, _key(options)
            if key not in self._programs:
                with self._watched.not_counted():
                    self._programs[key] = load_program(ctx, name, **options)
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
