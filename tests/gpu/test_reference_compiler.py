"""Programs pass the Khronos reference compiler: ``tests/conftest.py`` checks each as it is made."""

from __future__ import annotations

from pathlib import Path

import moderngl
import pytest

from simgl.passes.background.stars import StarPass
from tests import reference_compiler as checks

COMPILER = checks.reference_compiler()
pytestmark = pytest.mark.skipif(
    COMPILER is None, reason="no glslangValidator (apt-get install glslang-tools)"
)

VERTEX = "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n"
FRAGMENT = "#version 330 core\nout vec4 colour;\nvoid main() { colour = vec4(1.0); }\n"


def test_correct_stages_pass() -> None:
    assert COMPILER is not None
    checks.check_stages(COMPILER, {"vert": VERTEX, "frag": FRAGMENT})


def test_what_only_a_lenient_driver_takes_is_refused(gl: moderngl.Context) -> None:
    """A semicolon between functions: Mesa takes it, GLSL 3.30 has no such thing."""
    lenient = FRAGMENT.replace("void main()", "float one() { return 1.0; };\nvoid main()")
    with pytest.raises(AssertionError, match="extraneous semicolon"):
        gl.program(vertex_shader=VERTEX, fragment_shader=lenient)


def test_the_length_of_an_array_is_no_constant() -> None:
    """NVIDIA's compiler: "non constant expression in initialization"; Khronos' one takes it."""
    assert COMPILER is not None
    block = "layout(std140) uniform Table { vec4 rows[3]; };\n"
    bad = FRAGMENT.replace("out vec4", f"{block}const int ROWS = rows.length();\nout vec4")
    bad = bad.replace("vec4(1.0)", "rows[ROWS - 1]")
    with pytest.raises(AssertionError, match="makes no constant"):
        checks.check_stages(COMPILER, {"vert": VERTEX, "frag": bad})


def test_outputs_of_a_vertex_stage_are_counted_by_members() -> None:
    text = """
struct Pair { vec2 place; float weight, height; };
struct Many { Pair pairs[2]; mat3 turn; };
noperspective out Many many;
flat out uint part;
out float gl_ClipDistance[4];
in vec2 corner;
"""
    assert checks.outputs_of(text) == 2 * 3 + 3 + 1


def test_programs_of_a_pass_reach_the_compiler(
    gl: moderngl.Context, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    seen: list[dict[str, str]] = []
    monkeypatch.setattr(checks, "check_stages", lambda _, stages: seen.append(dict(stages)))
    checks.check_programs(monkeypatch, "", tmp_path, "one version")
    StarPass(gl).release()
    # Also by the session beneath, if no earlier test had this pass.
    assert seen
    assert all(set(stages) == {"vert", "frag"} for stages in seen)


def test_a_program_that_passed_is_not_compiled_again_by_the_same_version(
    gl: moderngl.Context, tmp_path: Path
) -> None:
    seen: list[str] = []

    def make(text: str, version: str) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(checks, "check_stages", lambda *_: seen.append(version))
            checks.check_programs(patch, "", tmp_path, version)
            gl.program(vertex_shader=VERTEX, fragment_shader=text).release()

    make(FRAGMENT, "1")
    made_once = len(seen)
    make(FRAGMENT, "1")
    assert len(seen) == made_once > 0
    make(FRAGMENT, "2")
    assert seen[-1] == "2"
    make(FRAGMENT + "// another text\n", "2")
    assert len(seen) > made_once + 1


def test_a_refused_program_is_refused_again(gl: moderngl.Context) -> None:
    lenient = FRAGMENT.replace("void main()", "float two() { return 2.0; };\nvoid main()")
    for _ in range(2):
        with pytest.raises(AssertionError, match="extraneous semicolon"):
            gl.program(vertex_shader=VERTEX, fragment_shader=lenient)
