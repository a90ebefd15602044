"""Every program that a test compiles passes the Khronos reference compiler too.

Which variants of a shader there are is known only where they are compiled: at
``moderngl.Context``, by whatever drew in the tests of this process. The driver accepts some GLSL
that the language does not have; another driver need not. What passed once is not compiled again,
in whichever process or run of the tests: the compiler takes longer than most tests.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import moderngl
import pytest

from simgl.content_digest import content_digest
from tests.patience import run_to_end

_SUFFIXES = {
    "vertex_shader": "vert",
    "fragment_shader": "frag",
    "geometry_shader": "geom",
    "tess_control_shader": "tesc",
    "tess_evaluation_shader": "tese",
}
# Of a vertex stage, in vectors of four: NVIDIA's driver has them, Mesa one more.
_OUTPUTS = 31
# What this module checks besides the compiler: with a change here all programs are checked again.
_OWN_CHECKS = "1"
_STRUCT = re.compile(r"\bstruct\s+(\w+)\s*\{(.*?)\}\s*;", re.DOTALL)
_MEMBER = re.compile(r"(\w+)\s+([^;{}]+);")
_OUTPUT = re.compile(
    r"^\s*(?:(?:flat|smooth|noperspective|centroid)\s+)*out\s+(\w+)\s+([^;{}]+);", re.M
)
_COLUMNS = {"mat2": 2, "mat3": 3, "mat4": 4}


def reference_compiler() -> str | None:
    """Its path; None where it is not installed (apt-get install glslang-tools)."""
    return shutil.which("glslangValidator")


def check_stages(compiler: str, stages: Mapping[str, str]) -> None:
    """Compile stages (file suffix to text) and link them; fails with the compiler's log."""
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for suffix, text in stages.items():
            path = Path(folder, f"shader.{suffix}")
            path.write_text(text, encoding="utf-8")
            paths.append(str(path))
        command = [compiler, "-DONLY_GLSL_330", "-l", *paths]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)
    if done.returncode:
        errors = [line for line in done.stdout.splitlines() if line.startswith("ERROR")]
        listing = "\n".join(errors)
        raise AssertionError(f"the reference compiler refuses what the driver took:\n{listing}")
    _check_for_other_drivers(compiler, stages)


def outputs_of(vertex: str) -> int:
    """Vectors of four that the outputs of a vertex stage take, preprocessed: each member one."""
    size = dict(_COLUMNS)

    def taken(kind: str, names: str) -> int:
        return size.get(kind, 1) * sum(
            int((re.findall(r"\[(\d+)\]", name) or ["1"])[0]) for name in names.split(",")
        )

    for name, members in _STRUCT.findall(vertex):
        size[name] = sum(taken(*member) for member in _MEMBER.findall(members))
    outputs = [(kind, names) for kind, names in _OUTPUT.findall(vertex) if "gl_" not in names]
    return sum(taken(*output) for output in outputs)


def _check_for_other_drivers(compiler: str, stages: Mapping[str, str]) -> None:
    """What the reference compiler takes and NVIDIA's driver does not.

    It refuses constants made of the length of an array in a block, and more outputs of a vertex
    stage than it has.
    """
    for suffix, text in stages.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"shader.{suffix}")
            path.write_text(text, encoding="utf-8")
            plain = run_to_end([compiler, "-E", str(path)]).stdout
        lengths = re.findall(r"\bconst\b[^;]*\.\s*length\(\)[^;]*;", plain)
        assert not lengths, f"the length of an array makes no constant everywhere: {lengths}"
        if suffix == "vert":
            taken = outputs_of(plain)
            assert taken <= _OUTPUTS, f"{taken} outputs of a vertex stage, {_OUTPUTS} are possible"


def version(compiler: str) -> str:
    """What the compiler says of itself."""
    return run_to_end([compiler, "--version"]).stdout


def check_programs(
    patch: pytest.MonkeyPatch, compiler: str, passed: Path, compiler_version: str
) -> None:
    """From here on each new program is checked, after the driver has accepted it.

    passed : folder with an empty file for each program that this version of the compiler took
    """
    program, compute = moderngl.Context.program, moderngl.Context.compute_shader
    passed.mkdir(parents=True, exist_ok=True)

    def check(stages: Mapping[str, str], made: Any) -> Any:
        mark = passed / content_digest((_OWN_CHECKS, compiler_version, *sorted(stages.items())))
        if not mark.exists():
            try:
                check_stages(compiler, stages)
            except AssertionError:
                made.release()
                raise
            mark.touch()
        return made

    def checked_program(ctx: moderngl.Context, *texts: Any, **named: Any) -> Any:
        made = program(ctx, *texts, **named)
        given = dict(zip(_SUFFIXES, texts, strict=False)) | named
        return check({_SUFFIXES[name]: given[name] for name in _SUFFIXES if given.get(name)}, made)

    def checked_compute(ctx: moderngl.Context, source: str) -> Any:
        made = compute(ctx, source)
        return check({"comp": source}, made)

    patch.setattr(moderngl.Context, "program", checked_program)
    patch.setattr(moderngl.Context, "compute_shader", checked_compute)
