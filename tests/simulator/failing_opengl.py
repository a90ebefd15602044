"""OpenGL that fails once, at any of its calls, as a driver does that runs out of memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import moderngl
import pytest

# What makes, fills or draws.
_CALLS = (
    (moderngl.VertexArray, "render"),
    (moderngl.Buffer, "write"),
    (moderngl.Buffer, "orphan"),
    (moderngl.Texture, "write"),
    (moderngl.Texture, "read"),
    (moderngl.Framebuffer, "clear"),
    (moderngl.Context, "buffer"),
    (moderngl.Context, "texture"),
    (moderngl.Context, "texture3d"),
    (moderngl.Context, "texture_array"),
    (moderngl.Context, "depth_texture"),
    (moderngl.Context, "depth_renderbuffer"),
    (moderngl.Context, "framebuffer"),
    (moderngl.Context, "vertex_array"),
    (moderngl.Context, "program"),
)


class Calls:
    """Counts calls; the one of number ``failing`` raises moderngl.Error."""

    def __init__(self) -> None:
        self.count = 0
        self.failing = -1

    def of(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, counted."""

        def counted(*args: Any, **kwargs: Any) -> Any:
            self.count += 1
            if self.count == self.failing:
                raise moderngl.Error("cannot, this once")
            return function(*args, **kwargs)

        return counted


@contextmanager
def counted_calls() -> Iterator[Calls]:
    """All calls of OpenGL inside are counted, and one may fail."""
    calls = Calls()
    with pytest.MonkeyPatch.context() as patch:
        for owner, name in _CALLS:
            patch.setattr(owner, name, calls.of(getattr(owner, name)))
        yield calls
