"""The first draw with a program, for which it is compiled, leaves other threads free to run."""

from __future__ import annotations

import threading
import time

import moderngl
import numpy as np

from simgl.gpu.triangles import Triangles

_VERTEX = """#version 330
void main() { gl_Position = vec4(4.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0, 0.0, 1.0); }
"""
# Long enough that llvmpipe takes 0.1 s or more for it; a GPU's driver compiles it elsewhere.
_STEPS = "".join(
    f"x = sin(x * {k}.1) + (x > {k}.0 ? exp2(x) : sqrt(abs(x)));\n" for k in range(1, 80)
)
_FRAGMENT = f"""#version 330
out vec4 colour;
void main() {{ float x = gl_FragCoord.x; {_STEPS} colour = vec4(x * 0.0 + 1.0); }}
"""


def _target(gl: moderngl.Context) -> tuple[moderngl.Texture, moderngl.Framebuffer]:
    texture = gl.texture((2, 2), 4, bytes(64), dtype="f4")
    target = gl.framebuffer([texture])
    target.use()
    return texture, target


def test_other_threads_run_while_a_program_is_compiled(gl: moderngl.Context) -> None:
    texture, target = _target(gl)
    program = gl.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
    triangles = Triangles(gl, program)
    seen: list[float] = []
    done = threading.Event()

    def look() -> None:
        while not done.is_set():
            seen.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=look)
    thread.start()
    begin = time.perf_counter()
    triangles.draw(3)
    end = time.perf_counter()
    done.set()
    thread.join()
    gl.finish()
    for item in (triangles, program, target, texture):
        item.release()
    gl.detect_framebuffer(0).use()
    # In the middle half of the call nothing of this module runs but the driver.
    quarter = 0.25 * (end - begin)
    assert quarter < 0.005 or any(begin + quarter < at < end - quarter for at in seen)


def test_the_first_draw_and_later_ones_fill_the_same(gl: moderngl.Context) -> None:
    texture, target = _target(gl)
    program = gl.program(
        vertex_shader=_VERTEX,
        fragment_shader="#version 330\nout vec4 colour;\nvoid main() { colour = vec4(1.0); }\n",
    )
    indices = gl.buffer(np.array([7, 7, 7, 0, 1, 2], dtype="<u4").tobytes())
    for given, first in ((None, 0), (indices, 3)):
        triangles = Triangles(gl, program, given)
        for _ in range(2):
            texture.write(bytes(64))
            triangles.draw(3, first)
            assert np.frombuffer(texture.read(), "<f4").tolist() == [1.0] * 16
        triangles.release()
    gl.detect_framebuffer(0).use()
    for item in (program, indices, target, texture):
        item.release()
