"""What a pass says of its state holds, whatever was drawn on its target before."""

from __future__ import annotations

import moderngl
import numpy as np

from simgl.gpu.pipeline_state import State

VERTEX = """#version 330
void main() { gl_Position = vec4(4.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0, 0.0, 1.0); }
"""
FRAGMENT = """#version 330
out vec4 colour;
void main() { colour = vec4(1.0); }
"""


def test_a_target_takes_colours_again_after_a_draw_that_wrote_none(gl: moderngl.Context) -> None:
    texture = gl.texture((2, 2), 4, bytes(64), dtype="f4")
    target = gl.framebuffer([texture])
    program = gl.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
    array = gl.vertex_array(program, [])
    written = []
    for write_color in (False, True, False):
        texture.write(bytes(64))
        State(write_color=write_color).apply(gl, target, (0, 0, 2, 2))
        array.render(moderngl.TRIANGLES, vertices=3)
        written.append(np.frombuffer(texture.read(), "<f4").tolist())
    gl.detect_framebuffer(0).use()
    for item in (array, program, target, texture):
        item.release()
    assert written == [[0.0] * 16, [1.0] * 16, [0.0] * 16]
