"""Keypoints and the bay: what lies where in body axes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from tests.tools.shipped import ATV_WINGS, NAMES, all_corners, pieces, ray_hits, record_of
from tools.spacecraft_models.materials import GREY_STEPS


def winding_number(point: Array, corners: Array) -> float:
    """How many closed surfaces hold the point: solid angles of all triangles over 4 pi.

    Solid angle of a triangle after Van Oosterom and Strackee (1983).
    """
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2.0 * np.arctan2(triple, below).sum() / (4.0 * np.pi))


def test_a_ray_from_above_passes_the_open_bay_and_meets_its_floor_first() -> None:
    floor = np.array(record_of("space_rider")["keypoints"]["bay_floor"])
    down = np.array([0.0, 0.0, 1.0])
    # Off the exact centre, where the floor's triangles meet in one vertex.
    start = floor + np.array([0.013, 0.007, -5.0])
    np.testing.assert_allclose(ray_hits(start, down, all_corners("space_rider"))[0], 5.0, 1e-5)
    np.testing.assert_allclose(
        ray_hits(start, down, all_corners("space_rider", "cargo_bay"))[0], 5.0, 1e-5
    )


def test_no_skin_lies_over_the_bay() -> None:
    mouth = np.array(record_of("space_rider")["keypoints"]["bay_mouth"])
    skin = all_corners("space_rider", "body")
    for x in (-0.58, 0.0, 0.58):
        for y in (-0.48, 0.0, 0.48):
            start = mouth + np.array([x + 0.001, y + 0.002, -1.0])
            first = ray_hits(start, np.array([0.0, 0.0, 1.0]), skin)[0]
            assert first > 1.8, (x, y)  # the cavity's floor, below the bay's own


def test_the_doors_close_over_the_bay() -> None:
    record = record_of("space_rider")
    for joint in record["joint"]:
        if not joint["name"].startswith("bay_door"):
            continue
        angle = np.radians(joint["range_deg"][0])
        swing = Rotation.from_rotvec(angle * np.array(joint["axis_body"]))
        origin = np.array(joint["origin_body_m"])
        corners = pieces("space_rider")[joint["part"]].corners.reshape(-1, 3)
        closed = swing.apply(corners - origin) + origin
        side = np.sign(origin[1])
        assert 0.003 < (side * closed[:, 1]).min() < 0.005, joint["name"]
        # The outer face meets the top of the skin at the centre line.
        assert closed[:, 2].min() == pytest.approx(-1.0, abs=1e-3)


def test_left_is_port_and_right_is_starboard() -> None:
    for name in NAMES:
        for part, piece in pieces(name).items():
            if part.endswith("_left"):
                assert piece.corners[..., 1].max() < 0.0, part
            if part.endswith("_right"):
                assert piece.corners[..., 1].min() > 0.0, part


@pytest.mark.parametrize(
    ("name", "point"),
    [
        ("cubesat_12u", "camera_aperture"),
        ("cubesat_12u", "docking_port"),
        ("space_rider", "bay_centre"),
        ("space_rider", "bay_mouth"),
        ("atv_like", "engine_upper_left"),
        ("iss_like", "docking_port_forward"),
        ("debris_rocket_body", "adapter_centre"),
        ("debris_rocket_body", "nozzle_exit"),
        ("servicer", "capture_ring"),
        ("servicer", "grip"),
    ],
)
def test_open_keypoints_lie_outside_every_solid(name: str, point: str) -> None:
    position = np.array(record_of(name)["keypoints"][point])
    # A closed surface around the point counts 1, none counts 0.
    assert winding_number(position, all_corners(name)) == pytest.approx(0.0, abs=1e-3)


def test_camera_aperture_is_5_mm_ahead_of_all_of_the_camera() -> None:
    aperture = record_of("cubesat_12u")["keypoints"]["camera_aperture"]
    foremost = all_corners("cubesat_12u")[..., 0].max()
    assert aperture[0] - foremost == pytest.approx(0.005, abs=1e-6)


ON_THE_SURFACE = {
    "space_rider": ["nose", "belly", "bay_floor", "flap_tip_left", "flap_tip_right"],
    "atv_like": [
        "docking_probe",
        *(f"docking_rim_{side}" for side in ("top", "bottom", "left", "right")),
        *(f"wing_tip_{where}" for where in ATV_WINGS),
    ],
    "iss_like": [
        "aft_end",
        *(
            f"wing_tip_{number}_{end}_{side}"
            for number in (1, 2)
            for end in ("forward", "aft")
            for side in ("left", "right")
        ),
    ],
    "debris_rocket_body": [
        f"{place}_{side}"
        for place in ("adapter", "skirt")
        for side in ("top", "bottom", "left", "right")
    ],
    "servicer": ["wing_tip_left", "wing_tip_right", "dish_feed"],
    "calibration_board": [f"step_{percent:02d}" for percent in GREY_STEPS],
    "marker_board": [f"circle_{row}_{column}" for row in range(5) for column in range(7)],
    "mirror": ["centre"],
    "wedge": [
        "face_30",
        "face_60",
        "base",
        *(f"{edge}_{side}" for edge in ("toe", "ridge", "heel") for side in ("left", "right")),
    ],
}


@pytest.mark.parametrize(
    ("name", "point"),
    [(name, point) for name, points in ON_THE_SURFACE.items() for point in points],
)
def test_surface_keypoints_lie_on_the_surface(name: str, point: str) -> None:
    position = np.array(record_of(name)["keypoints"][point])
    corners = all_corners(name)
    # 2 mm to all sides: at a surface point some lie inside a solid and some outside.
    steps = 0.002 * np.concatenate([np.eye(3), -np.eye(3)])
    held = [round(winding_number(position + step, corners)) for step in steps]
    assert min(held) == 0, held
    assert max(held) >= 1, held
