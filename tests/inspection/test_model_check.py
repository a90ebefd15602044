"""What `simgl model check` says of sound, broken and oddly scaled models."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from simgl.commands.application import app
from simgl.errors import AssetError, SimglError
from simgl.inspection.model_check import check_model, report_text
from tests.model_files.gltf import UNSIGNED_SHORT, Document

# Corner numbers of a cube's twelve triangles, counter-clockwise seen from outside.
CUBE = [
    (0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
    (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5),
]  # fmt: skip


@pytest.fixture
def cube(tmp_path: Path) -> Callable[..., str]:
    """Writes an OBJ cube and returns its path; side in units of the file."""

    def write(side: float = 2.0, triangles: list[tuple[int, int, int]] = CUBE) -> str:
        corners = np.indices((2, 2, 2)).reshape(3, -1).T[:, ::-1] * side
        lines = [f"v {x} {y} {z}" for x, y, z in corners]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
        path = tmp_path / "cube.obj"
        path.write_text("\n".join(lines) + "\n")
        return str(path)

    return write


def test_a_cube_is_watertight_and_has_its_size_and_volume(cube: Callable[..., str]) -> None:
    report = check_model(cube())
    (part,) = report.parts
    assert (report.size, report.middle) == ((2.0, 2.0, 2.0), (1.0, 1.0, 1.0))
    assert (report.triangles, part.open_edges, part.flat_triangles) == (12, 0, 0)
    assert part.volume == pytest.approx(8.0, rel=1e-6)  # float32 corners
    assert report.watertight
    assert report.unit_guess is None


def test_a_missing_triangle_leaves_three_open_edges(cube: Callable[..., str]) -> None:
    (part,) = check_model(cube(triangles=CUBE[1:])).parts
    assert part.verdict == "open, 3 edges without a neighbour"


def test_a_turned_triangle_leaves_its_edges_open_twice(cube: Callable[..., str]) -> None:
    turned = [CUBE[0][::-1], *CUBE[1:]]
    (part,) = check_model(cube(triangles=turned)).parts
    assert part.open_edges == 6


def test_triangles_that_all_face_inward_are_told(cube: Callable[..., str]) -> None:
    (part,) = check_model(cube(triangles=[t[::-1] for t in CUBE])).parts
    assert part.verdict == "inside out"
    assert part.volume < 0.0


def test_a_triangle_without_area_is_counted(cube: Callable[..., str]) -> None:
    (part,) = check_model(cube(triangles=[*CUBE, (0, 0, 1)])).parts
    assert (part.flat_triangles, part.open_edges) == (1, 0)


@pytest.mark.parametrize(
    ("side", "unit_m", "guess"),
    [
        (10.0, None, None),
        (4500.0, None, "4500 m is not a spacecraft's size; 4.5 m if in millimetres: unit = \"mm\""),
        (4500.0, 0.001, None),
        (0.012, None, "0.012 m is not a spacecraft's size; 12 m if in kilometres: unit = \"km\""),
        (1e-9, None, "1e-09 m is not a spacecraft's size, and no usual unit makes it one"),
    ],
)  # fmt: skip
def test_the_unit_is_guessed_where_metres_do_not_fit(
    cube: Callable[..., str], side: float, unit_m: float | None, guess: str | None
) -> None:
    assert check_model(cube(side), unit_m).unit_guess == guess


def test_obj_and_stl_are_said_to_be_shape_only(cube: Callable[..., str]) -> None:
    (note,) = check_model(cube()).notes
    assert note == "OBJ is read as shape only: grey, flat facets, one part, no images"


def test_all_missing_files_are_named_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "craft.gltf"
    content = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "craft.bin", "byteLength": 36}],
        "images": [{"uri": "hull.png"}, {"uri": "wing.png"}],
    }
    path.write_text(json.dumps(content))
    (tmp_path / "wing.png").write_bytes(b"")
    with pytest.raises(AssetError) as caught:
        check_model(str(path))
    message = f'{path}: needs files that are missing beside it: "craft.bin", "hull.png"'
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("{", "is not a glTF file (Input data was truncated)"),
        ("[]", "must be a table"),
        ('{"asset": {"version": "2.0"}, "buffers": 3}', "buffers"),
        ('{"asset": {"version": "2.0"}}', "holds no scene"),
        ('{"asset": {"version": "2.0"}, "scenes": [{}]}', "holds no mesh"),
    ],
)
def test_a_broken_file_gives_one_line_that_names_it(
    tmp_path: Path, content: str, problem: str
) -> None:
    path = tmp_path / "craft.gltf"
    path.write_text(content)
    with pytest.raises(SimglError) as caught:
        check_model(str(path))
    assert str(caught.value).startswith(f"{path}: ")
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_shipped_model_reports_joints_keypoints_finishes_and_no_notes() -> None:
    report = check_model("mirror")
    assert report.watertight
    assert report.notes == ()
    assert "centre" in report.keypoints
    assert {material.name for material in report.materials} == {
        "mirror", "target_black", "aluminium_machined",
    }  # fmt: skip


def test_the_text_has_a_line_for_each_part_and_material(cube: Callable[..., str]) -> None:
    text = report_text(check_model(cube()))
    assert "size       2 x 2 x 2 m along x, y, z; middle at (1, 1, 1) m" in text
    assert "  cube  12 triangles  2 x 2 x 2 m  watertight" in text
    assert "  plain  50 50 50 50  glossy, roughness 0.6" in text
    assert "not drawn as the file asks\n  OBJ is read as shape only" in text


def test_the_command_prints_the_report(cube: Callable[..., str]) -> None:
    path = cube(4500.0)
    result = CliRunner().invoke(app, ["model", "check", path, "--unit-m", "0.001"])
    assert result.exit_code == 0
    assert result.output == report_text(check_model(path, 0.001)) + "\n"


def test_the_command_refuses_a_unit_that_is_not_positive(cube: Callable[..., str]) -> None:
    result = CliRunner().invoke(app, ["model", "check", cube(), "--unit-m", "0"])
    assert str(result.exception) == "command line: --unit-m must be positive, got 0"


def _gltf_cube(tmp_path: Path, normal_sign: float, **node: Any) -> str:
    document = Document()
    corners = np.indices((2, 2, 2)).reshape(3, -1).T[:, ::-1] * 2.0 - 1.0
    document.json["nodes"].append(
        {
            "name": "cube",
            "mesh": document.mesh(
                attributes={
                    "POSITION": document.accessor(corners),
                    "NORMAL": document.accessor(normal_sign * corners),
                },
                indices=document.accessor(np.ravel(CUBE), UNSIGNED_SHORT),
            ),
            **node,
        }
    )
    return str(document.write_gltf(tmp_path / "cube.gltf"))


def test_normals_that_contradict_the_winding_are_counted(tmp_path: Path) -> None:
    report = check_model(_gltf_cube(tmp_path, -1.0))
    (part,) = report.parts
    # Closed and wound outwards, but lit as if seen from inside.
    assert (part.verdict, part.contrary_normals) == ("watertight", 12)
    assert "12 triangles with normals to the wrong side" in report_text(report)


@pytest.mark.parametrize("scale", [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [-1, -1, -1]])
def test_the_normals_of_a_mirrored_part_go_with_its_winding(
    scale: list[float], tmp_path: Path
) -> None:
    (part,) = check_model(_gltf_cube(tmp_path, 1.0, scale=scale)).parts
    assert (part.verdict, part.contrary_normals) == ("watertight", 0)
