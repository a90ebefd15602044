"""The wheel holds what a user needs, and nothing else."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import pytest

from simgl.shipped_examples import shipped_examples
from tests.patience import run_to_end

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder)]
    run_to_end([*command, str(ROOT)])
    return zipfile.ZipFile(next(folder.glob("*.whl")))


def beneath(folder: Path, suffixes: set[str]) -> set[str]:
    return {
        p.relative_to(folder).as_posix()
        for p in folder.rglob("*")
        if p.suffix in suffixes and "__pycache__" not in p.parts
    }


def test_every_module_shader_model_and_map_is_in_the_wheel(wheel: zipfile.ZipFile) -> None:
    names = set(wheel.namelist())
    expected = {
        f"simgl/{p}" for p in beneath(ROOT / "simgl", {".py", ".toml", ".jpg", ".jinja", ".typed"})
    }
    expected |= {f"simgl_bridge/{p}" for p in beneath(ROOT / "bridge/simgl_bridge", {".py"})}
    cpp = beneath(ROOT / "bridge/cpp", {".c", ".cpp", ".h", ".hpp"})
    expected |= {f"simgl_bridge/cpp/{p}" for p in cpp}
    expected |= {
        f"simgl/shaders/{p}" for p in beneath(ROOT / "shaders", {".glsl", ".vert", ".frag"})
    }
    expected |= {f"simgl/models/{p}" for p in beneath(ROOT / "models", {".glb", ".toml"})}
    assert {"simgl/py.typed", "simgl/shaders/surface/surface.frag"} <= expected
    assert expected <= names


def test_the_examples_in_the_wheel_are_those_that_are_listed(wheel: zipfile.ZipFile) -> None:
    inside = {Path(n).relative_to("simgl/examples") for n in wheel.namelist() if "/examples/" in n}
    listed = {file for example in shipped_examples().values() for file in example.files}
    listed |= {p.relative_to(EXAMPLES) for p in (EXAMPLES / "start").glob("*.*")}
    # They make folders of scripts packages.
    marks = {Path(folder, "__init__.py") for folder in ("bridge", "short")}
    assert inside == listed | marks


def test_tests_and_pages_stay_out(wheel: zipfile.ZipFile) -> None:
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert {t for t in tops if not t.endswith(".dist-info")} == {"simgl", "simgl_bridge"}


def test_licence_notice_and_commands_come_along(wheel: zipfile.ZipFile) -> None:
    info = next(n for n in wheel.namelist() if n.endswith(".dist-info/METADATA")).split("/")[0]
    assert f"{info}/licenses/LICENSE" in wheel.namelist()
    assert f"{info}/licenses/NOTICE" in wheel.namelist()
    entry_points = wheel.read(f"{info}/entry_points.txt").decode()
    assert "simgl = simgl.cli:main" in entry_points
    for line in ("serve = simgl_bridge.commands:serve", "run = simgl_bridge.commands:run"):
        assert line in entry_points
    assert "License-Expression: Apache-2.0" in wheel.read(f"{info}/METADATA").decode()
