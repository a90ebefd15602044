"""How OpenGL objects are released: in a safe order, and after an error all that it left behind."""

from __future__ import annotations

import functools
import gc
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Concatenate, ParamSpec, Protocol, TypeVar

import moderngl

P = ParamSpec("P")
Owner = TypeVar("Owner")


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


@contextmanager
def freed_on_error(ctx: moderngl.Context) -> Iterator[None]:
    """After an error inside, OpenGL objects that nothing refers to any more are freed.

    The frames of the error are cleared: they refer to whatever was being made.
    """
    mode = ctx.gc_mode
    # Objects that Python forgets are collected, to be freed while the context is current.
    ctx.gc_mode = "context_gc"
    try:
        yield
    except BaseException as error:
        cause: BaseException | None = error
        while cause is not None:
            traceback.clear_frames(cause.__traceback__)
            cause = cause.__context__
        # moderngl refers to the framebuffer that is bound, which may be one of those.
        ctx.detect_framebuffer(0).use()
        gc.collect()
        raise
    finally:
        ctx.gc_mode = mode
        _free_forgotten(ctx)


def _free_forgotten(ctx: moderngl.Context) -> None:
    """Free the objects that moderngl has collected; its own ``gc`` stops at released ones."""
    forgotten = [ctx.objects.popleft() for _ in range(len(ctx.objects))]
    living = [item for item in forgotten if hasattr(item, "release")]
    if living:
        release_all(ctx, *living)


def all_or_nothing(
    init: Callable[Concatenate[Owner, moderngl.Context, P], None],
) -> Callable[Concatenate[Owner, moderngl.Context, P], None]:
    """Decorates a constructor: where it fails, the OpenGL objects that it made are freed."""

    @functools.wraps(init)
    def guarded(self: Owner, ctx: moderngl.Context, /, *args: P.args, **kwargs: P.kwargs) -> None:
        with freed_on_error(ctx):
            try:
                init(self, ctx, *args, **kwargs)
            except BaseException:
                # Whoever called the constructor still refers to the object.
                vars(self).clear()
                raise

    return guarded
