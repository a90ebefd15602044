"""Run a GLSL function over a list of inputs, one texel a case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np

from simgl import assets
from simgl.gpu.glsl import assemble
from simgl.gpu.uniform_blocks import Block


def evaluate(
    gl: moderngl.Context,
    includes: list[str],
    expression: str,
    inputs: np.ndarray[Any, Any],
    *,
    result: str = "vec4",
    textures: Mapping[str, moderngl.Texture] | None = None,
    blocks: Sequence[Block] = (),
    declarations: str = "",
) -> np.ndarray[Any, Any]:
    """(n, 4) values of ``expression`` over (n, k) inputs, ``in_value[0]`` to ``in_value[k-1]``.

    inputs : float32 or uint32; result : "vec4" or "uvec4"
    textures : by the name of their sampler; blocks : that the includes declare, left unset
    declarations : GLSL functions that the expression calls
    """
    unsigned = inputs.dtype == np.uint32
    count, width = inputs.shape
    sampler = "usampler2D" if unsigned else "sampler2D"
    kind = "uint" if unsigned else "float"
    text = (
        "\n".join(f'#include "{name}"' for name in includes)
        + f"""
uniform {sampler} table;
out {result} value;
{declarations}
void main() {{
    {kind} in_value[{width}];
    for (int k = 0; k < {width}; ++k)
        in_value[k] = texelFetch(table, ivec2(int(gl_FragCoord.x), k), 0).r;
    value = {expression};
}}
"""
    )
    generated = {block.include: block.glsl for block in blocks}
    vertex = assemble(assets.shaders(), "common/fullscreen.vert")
    fragment = assemble(assets.shaders(), "test", blocks={"test": text, **generated})
    program = gl.program(vertex_shader=vertex.text, fragment_shader=fragment.text)
    dtype = "u4" if unsigned else "f4"
    table = gl.texture((count, width), 1, np.ascontiguousarray(inputs.T).tobytes(), dtype=dtype)
    table.filter = (moderngl.NEAREST, moderngl.NEAREST)
    out = gl.texture((count, 1), 4, dtype="u4" if result == "uvec4" else "f4")
    target = gl.framebuffer([out])
    target.use()
    gl.enable_only(moderngl.NOTHING)
    table.use(0)
    for unit, (name, texture) in enumerate((textures or {}).items(), start=1):
        texture.use(unit)
        program[name] = unit
    array = gl.vertex_array(program, [])
    array.render(moderngl.TRIANGLES, vertices=3)
    raw = out.read()
    gl.detect_framebuffer(0).use()
    for resource in (array, target, out, table, program):
        resource.release()
    return np.frombuffer(raw, dtype=f"<{'u4' if result == 'uvec4' else 'f4'}").reshape(count, 4)
