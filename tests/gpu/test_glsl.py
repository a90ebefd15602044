"""Shader assembly: includes, errors by file and line, blocks that match their numpy side."""

from __future__ import annotations

import re
from pathlib import Path

import moderngl
import numpy as np
import pytest

from simgl import assets
from simgl.errors import ShaderError
from simgl.gpu.context import temporary_context
from simgl.gpu.glsl import Stage, assemble
from simgl.gpu.program import load_program
from simgl.gpu.uniform_blocks import Block, UniformBuffer


def write(root: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_each_include_is_taken_once_and_lines_keep_their_numbers(tmp_path: Path) -> None:
    write(
        tmp_path,
        {
            "a.frag": '#include "x.glsl"\n#include "y.glsl"\nvoid main() {}\n',
            "x.glsl": '#include "y.glsl"\nfloat x;\n',
            "y.glsl": "float y;\n",
        },
    )
    stage = assemble(tmp_path, "a.frag", {"COUNT": 3})
    assert stage.files == ("a.frag", "x.glsl", "y.glsl")
    assert stage.text.count("float y;") == 1
    assert stage.text.startswith("#version 330 core\n#define COUNT 3\n")
    assert "#line 3 0\nvoid main() {}" in stage.text


def test_a_missing_include_is_named_with_file_and_line(tmp_path: Path) -> None:
    write(tmp_path, {"stars/stars.frag": 'float a;\n#include "common/psf.glsl"\n'})
    wanted = f'stars/stars.frag:2: no include "common/psf.glsl" under {tmp_path.name}/'
    with pytest.raises(ShaderError, match=f"^{re.escape(wanted)}$"):
        assemble(tmp_path, "stars/stars.frag")


def test_a_version_line_in_a_file_is_refused(tmp_path: Path) -> None:
    write(tmp_path, {"a.frag": "#version 450\n"})
    with pytest.raises(ShaderError, match=r"a\.frag:1: simgl writes #version itself"):
        assemble(tmp_path, "a.frag")


@pytest.mark.parametrize("log", ["1:12(3): error: oops", "1(12) : error C0000: oops"])
def test_driver_logs_name_the_file(log: str) -> None:
    stage = Stage("", ("a.frag", "common/b.glsl"))
    assert stage.explain(log).startswith("common/b.glsl:12")


def test_a_compile_error_names_file_and_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(
        tmp_path,
        {
            "p/p.vert": "void main() { gl_Position = vec4(0); }\n",
            "p/p.frag": '#include "p/f.glsl"\nvoid main() {}\n',
            "p/f.glsl": "float f() {\n    return vec3(1);\n}\n",
        },
    )
    monkeypatch.setattr(assets, "shaders", lambda: tmp_path)
    # In a context of its own: moderngl leaves the program of a failed compilation behind.
    with temporary_context() as ctx, pytest.raises(ShaderError, match=r"p/f\.glsl:2"):
        load_program(ctx, "p/p")


def test_every_shader_folder_belongs_to_a_pass() -> None:
    passes = {p.stem for p in (Path(assets.__file__).parent / "passes").rglob("*.py")}
    folders = {p.name for p in assets.shaders().iterdir() if p.is_dir()}
    assert folders - {"common"} <= passes


GOOD = Block(
    "Good", 0, np.dtype([("m", "f4", (4, 4)), ("v", "f4", 4), ("s", "f4", 2), ("p", "f4", 2)])
)


def block_program(root: Path, uses: str) -> None:
    write(
        root,
        {
            "p/p.vert": "void main() { gl_Position = vec4(0); }\n",
            "p/p.frag": f'#include "block/good"\nout vec4 c;\nvoid main() {{ c = {uses}; }}\n',
        },
    )


def test_a_matrix_goes_up_untransposed(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Column 1 of the C-order matrix, picked by multiplying with the second unit vector."""
    block_program(tmp_path, "m * vec4(0, 1, 0, 0) + v + vec4(s, p)")
    (tmp_path / "p/p.vert").write_text(
        "void main() {\n"
        "    gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0, 1);\n"
        "}\n"
    )
    monkeypatch.setattr(assets, "shaders", lambda: tmp_path)
    program = load_program(gl, "p/p", blocks=[GOOD])
    buffer = UniformBuffer(gl, GOOD)
    matrix = np.arange(16.0).reshape(4, 4)
    buffer.write({"m": matrix, "v": (100, 100, 100, 100), "s": (0.5, 0), "p": (0, 0.25)})
    out = gl.texture((1, 1), 4, dtype="f4")
    target = gl.framebuffer([out])
    target.use()
    gl.enable_only(moderngl.NOTHING)
    buffer.bind()
    array = gl.vertex_array(program, [])
    array.render(moderngl.TRIANGLES, vertices=3)
    value = np.frombuffer(out.read(), dtype="<f4")
    gl.detect_framebuffer(0).use()
    for resource in (array, target, out, buffer, program):
        resource.release()
    np.testing.assert_array_equal(value, matrix[:, 1] + 100 + np.array([0.5, 0, 0, 0.25]))


def test_a_block_that_the_pass_does_not_give_is_refused(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block_program(tmp_path, "v")
    text = (tmp_path / "p/p.frag").read_text().replace('#include "block/good"', GOOD.glsl)
    (tmp_path / "p/p.frag").write_text(text)
    monkeypatch.setattr(assets, "shaders", lambda: tmp_path)
    with pytest.raises(
        ShaderError, match="the shader has a block Good that the pass does not give"
    ):
        load_program(gl, "p/p")


def test_an_unused_sampler_is_refused(
    gl: moderngl.Context, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block_program(tmp_path, "v")
    monkeypatch.setattr(assets, "shaders", lambda: tmp_path)
    with pytest.raises(ShaderError, match=r"samplers \['sky'\] are declared but not used"):
        load_program(gl, "p/p", blocks=[GOOD], samplers=["sky"])


def test_a_dtype_that_std140_would_pad_is_refused() -> None:
    bad = Block("Bad", 0, np.dtype([("a", "f4"), ("b", "f4", 4), ("c", "f4", (3,))]))
    with pytest.raises(ShaderError, match='block Bad: field "b" lies at byte 4'):
        _ = bad.glsl
    with pytest.raises(ShaderError, match="has no std140 layout without padding"):
        _ = Block("Bad", 0, np.dtype([("c", "f4", (3,))])).glsl


def test_a_block_is_filled_completely(gl: moderngl.Context) -> None:
    buffer = UniformBuffer(gl, GOOD)
    with pytest.raises(ShaderError, match=r"fields \['p'\] do not match"):
        buffer.write({"m": np.eye(4), "v": 0.0, "s": 0.0})
    buffer.release()
