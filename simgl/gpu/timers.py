"""Time that each pass takes.

Measured by timer queries on a GPU. A software renderer runs a draw only when somebody waits for
it, so that its timer queries measure the recording; there a clock is read after ``glFinish``.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

import moderngl

from simgl.gpu.context import is_software

_NOTHING = nullcontext()


class PassTimer:
    """Collects seconds by pass name. A disabled timer costs nothing and changes nothing."""

    def __init__(self, ctx: moderngl.Context, *, enabled: bool = False) -> None:
        self._ctx = ctx
        self._software = is_software(ctx)
        self.enabled = enabled
        self.seconds: dict[str, float] = {}
        # moderngl cannot free a query, so each name keeps its own.
        self._queries: dict[str, moderngl.Query] = {}

    def measure(self, name: str) -> AbstractContextManager[None]:
        """Time a section; sections of the same name add up until ``seconds`` is cleared."""
        return self._measured(name) if self.enabled else _NOTHING

    @contextmanager
    def _measured(self, name: str) -> Iterator[None]:
        if self._software:
            self._ctx.finish()
            start = time.perf_counter()
            yield
            self._ctx.finish()
            elapsed = time.perf_counter() - start
        else:
            if name not in self._queries:
                self._queries[name] = self._ctx.query(time=True)
            query = self._queries[name]
            with query:
                yield
            elapsed = query.elapsed * 1e-9
        self.seconds[name] = self.seconds.get(name, 0.0) + elapsed
