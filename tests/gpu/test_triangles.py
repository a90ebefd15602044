"""The first draw with a program, for which it is compiled, leaves other threads free to run."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl
import numpy as np

from simgl.gpu.pipeline_state import State
from simgl.gpu.triangles import Triangles

_VERTEX = """#version 330
void main() { gl_Position = vec4(4.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0, 0.0, 1.0); }
"""
# Processor time of a draw that would hold others up [s]; and draws, for a busy machine may let the
# other thread run during none of some.
_LONG, _DRAWS = 0.02, 30


def _fragment(number: int) -> str:
    """Long enough that llvmpipe takes 0.1 s or more for it, which keeps one of each number on disk;
    a GPU's driver compiles it elsewhere."""
    steps = "".join(
        f"x = sin(x * {k}.{number}) + (x > {k}.0 ? exp2(x) : sqrt(abs(x)));\n" for k in range(1, 80)
    )
    return f"""#version 330
out vec4 colour;
void main() {{ float x = gl_FragCoord.x; {steps} colour = vec4(x * 0.0 + 1.0); }}
"""


@contextmanager
def _target(gl: moderngl.Context) -> Iterator[moderngl.Texture]:
    texture = gl.texture((2, 2), 4, bytes(64), dtype="f4")
    target = gl.framebuffer([texture])
    State().apply(gl, target, (0, 0, 2, 2))
    try:
        yield texture
    finally:
        gl.detect_framebuffer(0).use()
        for item in (target, texture):
            item.release()


def _first_draw(gl: moderngl.Context, fragment: str) -> tuple[float, float, float]:
    """When it began and ended, and what processor time this thread took for it [s]."""
    program = gl.program(vertex_shader=_VERTEX, fragment_shader=fragment)
    triangles = Triangles(gl, program)
    before, begin = time.thread_time(), time.perf_counter()
    triangles.draw(3)
    end, taken = time.perf_counter(), time.thread_time() - before
    gl.finish()
    for item in (triangles, program):
        item.release()
    return begin, end, taken


def test_other_threads_run_while_a_program_is_compiled(gl: moderngl.Context) -> None:
    seen: list[float] = []
    done = threading.Event()

    def look() -> None:
        while not done.is_set():
            seen.append(time.perf_counter())
            time.sleep(0.001)

    def runs_during(begin: float, end: float) -> bool:
        # In the middle half of the call nothing of this module runs but the driver.
        quarter = 0.25 * (end - begin)
        return any(begin + quarter < at < end - quarter for at in seen)

    thread = threading.Thread(target=look)
    thread.start()
    longest = 0.0
    try:
        with _target(gl):
            for _ in range(_DRAWS):
                begin, end, taken = _first_draw(gl, _fragment(time.time_ns()))
                if runs_during(begin, end):
                    return
                longest = max(longest, taken)
    finally:
        done.set()
        thread.join()
    assert longest < _LONG


def test_the_first_draw_and_later_ones_fill_the_same(gl: moderngl.Context) -> None:
    program = gl.program(
        vertex_shader=_VERTEX,
        fragment_shader="#version 330\nout vec4 colour;\nvoid main() { colour = vec4(1.0); }\n",
    )
    indices = gl.buffer(np.array([7, 7, 7, 0, 1, 2], dtype="<u4").tobytes())
    filled = []
    with _target(gl) as texture:
        for given, first in ((None, 0), (indices, 3)):
            triangles = Triangles(gl, program, given)
            for _ in range(2):
                texture.write(bytes(64))
                triangles.draw(3, first)
                filled.append(np.frombuffer(texture.read(), "<f4").tolist())
            triangles.release()
    for item in (program, indices):
        item.release()
    assert filled == [[1.0] * 16] * 4
