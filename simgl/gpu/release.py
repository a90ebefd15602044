"""The safe order in which OpenGL objects are released."""

from __future__ import annotations

from typing import Protocol

import moderngl


class Releasable(Protocol):
    """Anything that owns OpenGL objects."""

    def release(self) -> object:
        """Free them."""


def release_all(ctx: moderngl.Context, *owners: Releasable) -> None:
    """Release framebuffers and whatever else, with none of them bound.

    Whenever moderngl makes a framebuffer it binds the former one again afterwards, which must not
    be a released one.
    """
    ctx.detect_framebuffer(0).use()
    for owner in owners:
        owner.release()
