"""A user's file in its own unit and axes becomes the same body."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.inspection.model_check import check_model
from simgl.model_files.model_library import AXES, UNITS, body_from_file, load_model
from simgl.scenario.loader import scenario_from_dict

# Corners of a box 3 x 2 x 1 m along body x, y, z, off the origin, and its outward triangles.
CORNERS = np.array(list(itertools.product((0.5, 3.5), (-1.0, 1.0), (0.0, 1.0))))
FACES = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip
# float32 of metres of this size.
FLOAT32 = 4e-7


def write_obj(path: Path, corners: Array) -> None:
    lines = ["v " + " ".join(repr(float(v)) for v in corner) for corner in corners]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in FACES]
    path.write_text("\n".join(lines) + "\n")


def write_stl(path: Path, corners: Array) -> None:
    records = [
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel().tolist(), 0) for face in FACES
    ]
    path.write_bytes(bytes(80) + struct.pack("<I", len(FACES)) + b"".join(records))


WRITERS = {"obj": write_obj, "stl": write_stl}


def by_hand(up: str, forward: str) -> Array:
    """(3, 3) the file's axes as rows of body axes: forward is x, up is -z, y is to the right."""
    file_from_body = np.zeros((3, 3))
    for column, (axis, sign) in enumerate(((forward, 1.0), (up, -1.0))):
        sign *= -1.0 if axis.startswith("-") else 1.0
        file_from_body["xyz".index(axis[-1]), 2 * column] = sign
    file_from_body[:, 1] = np.cross(file_from_body[:, 2], file_from_body[:, 0])
    return file_from_body


PAIRS = [(up, ahead) for up in AXES for ahead in AXES if up[-1] != ahead[-1]]


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize(("unit", "up", "forward"), [("mm", "y", "z"), ("in", "z", "-y")])
def test_a_box_in_its_own_unit_and_axes_has_its_place_in_body_axes(
    kind: str, unit: str, up: str, forward: str, tmp_path: Path
) -> None:
    path = tmp_path / f"box.{kind}"
    WRITERS[kind](path, CORNERS @ by_hand(up, forward).T / UNITS[unit])
    craft = {"model": str(path), "unit": unit, "up_axis": up, "forward_axis": forward}
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {"box": {**craft, "position_icrf_m": [7e6, 0, 0]}},
        }
    )
    mesh = scenario.models["box"].mesh
    corners = np.array([CORNERS[list(face)] for face in FACES]).reshape(-1, 3)
    np.testing.assert_allclose(mesh.positions, corners, rtol=0.0, atol=FLOAT32)
    # Normals lead out of the box, whose middle is at (2, 0, 0.5).
    outward = mesh.positions.reshape(-1, 3, 3).mean(axis=1) - np.array([2.0, 0.0, 0.5])
    assert np.all(np.einsum("ij,ij->i", mesh.normals[::3], outward) > 0.0)


@pytest.mark.parametrize(("up", "forward"), PAIRS)
def test_every_pair_of_axes_is_a_rotation_that_puts_up_and_ahead_where_they_belong(
    up: str, forward: str
) -> None:
    matrix = body_from_file(1.0, up, forward)
    np.testing.assert_array_equal(matrix, by_hand(up, forward).T)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


@pytest.mark.parametrize(("up", "ahead"), [("y", "z"), ("z", "x"), ("x", "z"), ("-y", "z")])
def test_ahead_is_as_usual_where_only_up_is_given(up: str, ahead: str) -> None:
    np.testing.assert_array_equal(body_from_file(2.0, up, None), body_from_file(2.0, up, ahead))


def test_a_gltf_takes_the_same_keys_as_its_maker_meant_them(tmp_path: Path) -> None:
    shipped = load_model("wedge")
    source = Path(__file__).parents[2] / "models" / "wedge" / "wedge.glb"
    copy = tmp_path / "wedge.glb"
    copy.write_bytes(source.read_bytes())
    turned = load_model(str(copy), up_axis="y", forward_axis="z")
    np.testing.assert_array_equal(turned.mesh.positions, shipped.mesh.positions)


def test_the_check_guesses_the_unit_and_takes_unit_and_axes(tmp_path: Path) -> None:
    path = tmp_path / "box.stl"
    write_stl(path, CORNERS @ by_hand("y", "z").T * 1e3)
    guess = check_model(str(path)).unit_guess
    assert guess == '3000 m is not a spacecraft\'s size; 3 m if in millimetres: unit = "mm"'
    assert load_model(str(path)).notes == (guess,)
    assert load_model(str(path), unit_m=1e-3).notes == ()
    report = check_model(str(path), 1e-3, "y", "z")
    assert report.unit_guess is None
    assert report.size == pytest.approx((3.0, 2.0, 1.0), abs=FLOAT32)
    assert report.watertight
