"""Values of blocks reach fragments by the corners of a full-screen triangle, with the same bits."""

from __future__ import annotations

from pathlib import Path

import moderngl
import numpy as np
import pytest

from simgl import assets
from simgl.gpu.glsl import Stage
from simgl.gpu.handed_values import MAX_VECTORS, hand_values, placeholder
from simgl.gpu.program import FULLSCREEN, load_program
from simgl.gpu.uniform_blocks import Block, UniformBuffer

DTYPE = np.dtype(
    [
        ("turn", "f4", (4, 4)),
        ("rows", "f4", (3, 4)),
        ("places", "i4", 4),
        ("ends", "f4", 2),
        ("count", "u4"),
        ("share", "f4"),
    ]
)
BLOCK = Block("Values", 0, DTYPE)
TEXT = """#include "block/values"
out vec4 value;
void main() {
    int row = int(gl_FragCoord.x);
    value = turn * rows[row] + vec4(places) + vec4(ends, float(count), share);
}
"""
TURN = np.linspace(0.1, 1.7, 16).reshape(4, 4)
ROWS = np.geomspace(1e-3, 7.0, 12).reshape(3, 4)
PLACES = np.array([-3, 5, 1 << 23, -(1 << 23)])
ENDS, COUNT, SHARE = (1e-30, -1e30), 3, 1.0 / 3.0
GIVEN = {
    "turn": TURN,
    "rows": ROWS,
    "places": PLACES,
    "ends": ENDS,
    "count": COUNT,
    "share": SHARE,
}


@pytest.fixture
def shader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "p").mkdir()
    (tmp_path / "p/p.frag").write_text(TEXT)
    common = tmp_path / "common"
    common.symlink_to(assets.shaders() / "common")
    monkeypatch.setattr(assets, "shaders", lambda: tmp_path)
    return "p/p"


def drawn(gl: moderngl.Context, name: str) -> bytes:
    program = load_program(gl, name, vertex=FULLSCREEN, blocks=[BLOCK])
    buffer = UniformBuffer(gl, BLOCK)
    buffer.write(GIVEN)
    buffer.bind()
    out = gl.texture((3, 1), 4, dtype="f4")
    target = gl.framebuffer([out])
    target.use()
    gl.enable_only(moderngl.NOTHING)
    array = gl.vertex_array(program, [])
    array.render(moderngl.TRIANGLES, vertices=3)
    raw: bytes = out.read()
    gl.detect_framebuffer(0).use()
    for resource in (array, target, out, buffer, program):
        resource.release()
    return raw


def test_both_ways_give_the_same_bits(
    gl: moderngl.Context, shader: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = []
    for handed in (False, True):
        monkeypatch.setattr("simgl.gpu.program.is_software", lambda _, handed=handed: handed)
        results.append(drawn(gl, shader))
    assert results[0] == results[1]
    values = np.frombuffer(results[0], dtype="<f4").reshape(3, 4).astype(np.float64)
    exact = ROWS @ TURN.T + PLACES + [*ENDS, COUNT, SHARE]
    np.testing.assert_allclose(values, exact, rtol=1e-6)


def fragment_of(text: str) -> Stage:
    return Stage(f"{placeholder(BLOCK)}\n{text}\n", ("p.frag",))


def test_arrays_and_what_is_not_named_stay_in_the_block() -> None:
    handed = hand_values(fragment_of("float f() { return share * rows[1].x; }"), [BLOCK])
    assert "flat in float share;" in handed.fragment.text
    assert "uniform Values" in handed.fragment.text
    assert "flat in" not in handed.fragment.text.replace("flat in float share;", "")
    assert handed.vertex.count("flat out") == 1


def test_a_stage_without_arrays_reads_no_block() -> None:
    handed = hand_values(fragment_of("vec4 f() { return turn[0] + share; }"), [BLOCK])
    assert "uniform Values" not in handed.fragment.text
    assert "uniform Values" in handed.vertex


def test_no_more_is_handed_on_than_fits() -> None:
    names = [f"m{k}" for k in range(10)]
    block = Block("Values", 0, np.dtype([(name, "f4", (4, 4)) for name in names]))
    handed = hand_values(fragment_of(" ".join(names)), [block])
    count = handed.vertex.count("flat out mat4")
    assert count == MAX_VECTORS // 4
    assert handed.fragment.text.count("#define") == len(names) - count
