"""Which context is current: ``current`` restores the one before, whatever happened inside."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import moderngl
import pytest

from simgl import Product, Simulator
from simgl.errors import ContextError
from simgl.gpu.context import current, open_context, preserve_current, temporary_context
from simgl.gpu.window_systems import current_binding
from tests.gpu.osmesa import needs_osmesa
from tests.patience import run_to_end
from tests.scenes import Table, lambert, scene

ROOT = Path(__file__).resolve().parents[2]


BALL: Table = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}
SCENARIO = scene(
    {"b": {"model": BALL, "position_icrf_m": [0, 0, 0]}},
    {"position_icrf_m": [0, -90, 9], "look_at": "b", "width_px": 16, "height_px": 16},
)


def opened(number: int, backend: str = "auto") -> moderngl.Context:
    """A context, not current, that holds a number where all others hold theirs."""
    with preserve_current():
        ctx = open_context(backend)
        ctx.extra = number, ctx.texture((1, 1), 1, bytes([number]))
    return ctx


def works(ctx: moderngl.Context) -> bool:
    """Whether calls reach the objects of this context; without one they read zeros."""
    number, texture = ctx.extra
    assert number
    return bool(texture.read() == bytes([number]))


@pytest.fixture
def two() -> Iterator[tuple[moderngl.Context, moderngl.Context]]:
    first, second = opened(1), opened(2)
    yield first, second
    first.release()
    second.release()


def test_nested_contexts_restore_the_outer_one(
    two: tuple[moderngl.Context, moderngl.Context],
) -> None:
    first, second = two
    before = current_binding()
    with current(first):
        assert works(first)
        with current(first), current(second):
            assert works(second)
            assert not works(first)
            with current(first):
                assert works(first)
            assert works(second)
        assert works(first)
    assert current_binding() == before


def test_contexts_take_turns(two: tuple[moderngl.Context, moderngl.Context]) -> None:
    for ctx in two * 3:
        with current(ctx):
            assert works(ctx)
            assert ctx.error == "GL_NO_ERROR"


def test_an_exception_restores_the_outer_one(
    two: tuple[moderngl.Context, moderngl.Context],
) -> None:
    first, second = two
    with current(first):
        with pytest.raises(ZeroDivisionError), current(second):
            _ = 1 / 0
        assert works(first)


def test_a_simulator_leaves_the_users_context_current(
    two: tuple[moderngl.Context, moderngl.Context],
) -> None:
    first, _ = two
    state = SCENARIO.at(SCENARIO.epoch_tai_ns)
    with current(first):
        with Simulator(SCENARIO, first) as simulator:
            assert works(first)
            simulator.capture(state, "cam")
            assert works(first)
        assert works(first)
        # One with a context of its own takes nothing away either.
        with Simulator(SCENARIO) as simulator:
            assert works(first)
            simulator.capture(state, "cam")
            assert works(first)
        assert works(first)


def test_a_context_made_by_the_user_stays_current() -> None:
    # As a user writes it: their own moderngl context, current all the time, entered nowhere.
    with preserve_current():
        options: dict[str, Any] = {"backend": "egl"}
        ctx = moderngl.create_context(standalone=True, **options)
        ctx.extra = 3, ctx.texture((1, 1), 1, b"\x03")
        with Simulator(SCENARIO, ctx) as simulator:
            simulator.capture(SCENARIO.at(SCENARIO.epoch_tai_ns), "cam")
            assert works(ctx)
        assert works(ctx)
        ctx.release()


class _SilentContext:
    """A user's functions of a context that is current anyway, whose entering does nothing."""

    def __init__(self, ctx: moderngl.Context) -> None:
        functions: Any = ctx.mglo
        self._load = functions._context.load_opengl_function

    def load_opengl_function(self, name: str) -> int:
        return int(self._load(name))

    def __enter__(self) -> _SilentContext:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def release(self) -> None:
        pass


def test_a_users_context_whose_entering_does_nothing_is_the_current_one(
    two: tuple[moderngl.Context, moderngl.Context],
) -> None:
    first, second = two
    with current(first):
        functions: Any = _SilentContext(first)
        same = moderngl.create_context(context=functions)
        with current(same):
            assert works(first)
            with current(second):
                assert works(second)
            assert works(first)
        with current(second), current(same):
            assert works(first)
        assert works(first)


def test_a_simulator_moves_to_another_thread() -> None:
    state = SCENARIO.at(SCENARIO.epoch_tai_ns)
    with Simulator(SCENARIO) as simulator:
        here = simulator.capture(state, "cam").digital
        elsewhere = []
        thread = threading.Thread(
            target=lambda: elsewhere.append(simulator.capture(state, "cam").digital)
        )
        thread.start()
        thread.join()
        again = simulator.capture(state, "cam").digital
    assert here is not None
    assert again is not None
    assert elsewhere[0] is not None
    assert here.dn.tobytes() == elsewhere[0].dn.tobytes() == again.dn.tobytes()


def test_a_context_that_another_thread_holds_is_named(
    two: tuple[moderngl.Context, moderngl.Context],
) -> None:
    first, _ = two
    errors: list[str] = []

    def use() -> None:
        try:
            with current(first):
                errors.append("entered")
        except ContextError as error:
            errors.append(str(error))

    with current(first):
        thread = threading.Thread(target=use)
        thread.start()
        thread.join()
        assert works(first)
    assert len(errors) == 1
    assert errors[0].startswith("the OpenGL context is current on another thread; ")


def test_a_temporary_context_is_released_and_the_outer_one_restored(
    two: tuple[moderngl.Context, moderngl.Context],
) -> None:
    first, _ = two
    with current(first):
        with temporary_context() as ctx:
            assert ctx.texture((1, 1), 1, b"\x07").read() == b"\x07"
        assert works(first)
        with pytest.raises(ContextError, match="no backend"), temporary_context("glx"):
            pass
        assert works(first)
        with pytest.raises(ContextError, match="EGL device 99"):
            open_context("egl", 99)
        assert works(first)


# The same laws in a process of their own: a window's context (GLX), OSMesa, and one of each system
# beside EGL.
OSMESA = """
from simgl.gpu.context import current
from tests.gpu.test_current_context import opened, works
egl, first, second = opened(1, "egl"), opened(2, "osmesa"), opened(3, "osmesa")
with first:
    with first:
        assert works(first)
for outer, inner in ((first, second), (second, first), (egl, first), (first, egl)):
    with current(outer):
        assert works(outer)
        with current(outer), current(inner):
            assert works(inner)
            assert not works(outer)
        assert works(outer)
for ctx in (second, egl, first):
    with current(ctx):
        assert works(ctx)
    ctx.release()
print("held")
"""

GLX = """
import glfw, moderngl
from simgl import Product, Simulator
from simgl.gpu.context import current
from tests.gpu.test_current_context import SCENARIO, opened, works
glfw.init()
glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
windows, contexts = [], []
for number in (1, 2):
    windows.append(glfw.create_window(16, 16, "", None, None))
    glfw.make_context_current(windows[-1])
    contexts.append(moderngl.create_context())
    contexts[-1].extra = number, contexts[-1].texture((1, 1), 1, bytes([number]))
    with current(contexts[-1]):
        pass
first, second = contexts
egl = opened(3, "egl")
assert works(second)
for outer, inner in ((first, second), (second, first), (egl, first), (first, egl)):
    with current(outer):
        assert works(outer)
        with current(outer), current(inner):
            assert works(inner)
            assert not works(outer)
        assert works(outer)
assert works(second)
with Simulator(SCENARIO, second) as simulator, Simulator(SCENARIO) as other:
    for one in (simulator, other):
        one.capture(SCENARIO.at(SCENARIO.epoch_tai_ns), "cam")
        assert works(second)
assert works(second)
assert glfw.get_current_context()
print("held")
"""


def holds(script: str, *wrapper: str) -> bool:
    """Whether a script of laws runs to its end in a process of its own."""
    return run_to_end([*wrapper, sys.executable, "-c", script], cwd=ROOT).stdout == "held\n"


@needs_osmesa
def test_contexts_of_osmesa_keep_their_own_memory() -> None:
    assert holds(OSMESA)


@pytest.mark.display
def test_contexts_of_windows_are_restored(display: str) -> None:
    assert holds(GLX, "env", f"DISPLAY={display}")


def test_a_simulator_that_is_closed_says_so() -> None:
    with Simulator(SCENARIO) as simulator:
        state = SCENARIO.at(SCENARIO.epoch_tai_ns)
    with pytest.raises(ContextError, match="the OpenGL context is closed; open another one"):
        simulator.capture(state, "cam", {Product.RADIANCE})


@pytest.mark.parametrize("owned", [True, False])
def test_a_simulator_may_be_closed_twice(owned: bool) -> None:
    with temporary_context() as ctx:
        simulator = Simulator(SCENARIO) if owned else Simulator(SCENARIO, ctx=ctx)
        simulator.close()
        simulator.close()
