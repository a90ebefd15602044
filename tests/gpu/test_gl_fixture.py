"""The fixture ``gl`` sees what a test leaves behind, in a run of pytest of its own."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from tests.patience import run_to_end

ROOT = Path(__file__).resolve().parents[2]

TESTS = """
from simgl.passes.background import stars
from tests.conftest import _programs_pass_the_reference_compiler, _shared_programs
from tests.conftest import _watched_context, gl
from tests.scenes import lambert, radiance, scene

def test_orderly(gl):
    gl.texture((1, 1), 4).release()

def test_leaks_texture(gl):
    gl.texture((1, 1), 4)

def test_orderly_after_a_leak(gl):
    gl.texture((1, 1), 4).release()

def test_leaks_after_leaving_the_context(gl):
    gl.buffer(reserve=16)
    with gl:
        pass

def test_leaks_one_of_many(gl):
    many = [gl.texture((1, 1), 4) for _ in range(1500)]
    for texture in many[:-1]:
        texture.release()

def test_leaks_in_spite_of_a_simulator(gl):
    gl.texture((1, 1), 4)
    ball = {"sphere": {"radius_m": 1.0, "material": lambert(0.5)}}
    bodies = {"b": {"model": ball, "position_icrf_m": [0, 0, 0]}}
    radiance(gl, scene(bodies, {"position_icrf_m": [0, -90, 9], "look_at": "b"}))
    gl.texture((1, 1), 4)

def test_leaks_one_program_of_two(gl):
    of_stars = {"blocks": [stars._STARS]}
    stars.load_program(gl, "stars/stars", **of_stars).release()
    stars.load_program(gl, "stars/stars", **of_stars)

def test_releases_without_a_context(gl):
    texture = gl.texture((1, 1), 4)
    gl.__exit__(None, None, None)
    texture.release()

def test_leaves_an_error(gl):
    gl.enable_direct(0xDEAD)
"""


def test_what_a_test_leaves_behind_makes_it_fail(tmp_path: Path) -> None:
    (tmp_path / "test_fixture.py").write_text(TESTS)
    run = run_to_end(
        [sys.executable, "-m", "pytest", "-rA", "-p", "no:cacheprovider", "-p", "no:xdist", "."],
        cwd=tmp_path,
        env={
            **os.environ,
            "COLUMNS": "200",
            "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
        },
        check=False,
    )
    # The fixture speaks when a test is over, so that the test itself has passed.
    said = dict(re.findall(r"^ERROR test_fixture\.py::test_(\w+) - (.*)$", run.stdout, re.M))
    assert set(said) == {
        "leaks_texture",
        "leaks_after_leaving_the_context",
        "leaks_one_of_many",
        "leaks_in_spite_of_a_simulator",
        "leaks_one_program_of_two",
        "releases_without_a_context",
        "leaves_an_error",
    }, run.stdout
    left = "AssertionError: OpenGL objects left in the context: "
    assert said["leaks_texture"] == f"{left}{{'Texture': 1}}"
    assert said["leaks_after_leaving_the_context"] == f"{left}{{'Buffer': 1}}"
    assert said["leaks_one_of_many"] == f"{left}{{'Texture': 1}}"
    assert said["leaks_in_spite_of_a_simulator"] == f"{left}{{'Texture': 2}}"
    assert said["leaks_one_program_of_two"] == f"{left}{{'Program': 1}}"
    assert said["releases_without_a_context"] == f"{left}{{'Texture': 1}}"
    assert "GL_INVALID_ENUM" in said["leaves_an_error"]
