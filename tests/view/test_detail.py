"""What may stand for a far spacecraft: nothing moves by more than the bound, in any picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.model_files.model_library import load_model
from simgl.scene.detail_steps import RUNGS
from simgl.view.detail import WHOLE, detail
from tests.scenes import scene

MODEL = load_model("cubesat_12u")


def camera(**keys: Any) -> Camera:
    """A small one."""
    craft = {"a": {"model": {"sphere": {"radius_m": 1.0, "material": {"reflectance": 0.5}}},
                   "position_icrf_m": [0, 0, 0]}}  # fmt: skip
    place = {"position_icrf_m": [0, 0, 9], "boresight": [0, 0, -1], "up": [0, 1, 0]}
    return scene(craft, {**place, **keys}).cameras["cam"]


def at(x: float, y: float, depth: float) -> Array:
    """camera_from_body of a body turned with the camera."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, depth
    return matrix


@pytest.mark.parametrize("focal_length_mm", [2.0, 13.0, 100.0])
@pytest.mark.parametrize("bound", [0.1, 0.25, 1.0])
def test_no_place_in_the_picture_moves_by_more_than_the_bound(
    focal_length_mm: float, bound: float
) -> None:
    """Places of a part in view, moved by its allowed error in any direction."""
    eye = camera(focal_length_mm=focal_length_mm, width_px=800, height_px=600)
    f, rng = eye.focal_length_px, np.random.default_rng(3)
    half = 0.5 * np.array([800, 600]) / f
    for depth in (8.0, 60.0, 700.0):
        x, y = (0.9 * half * depth).tolist()
        found = detail(MODEL, at(x, y, depth), eye, bound)
        if found is WHOLE:
            assert bound * depth / f < 2.2 * RUNGS[0]
            continue
        offset = np.array([x, y, depth])
        chosen = rng.choice(len(MODEL.mesh.positions), 400)
        points = MODEL.mesh.positions[chosen].astype(np.float64) + offset
        seen = np.all(np.abs(points[:, :2] / points[:, 2:]) <= half, axis=1)
        ways = rng.normal(size=points.shape)
        ways *= np.array(found.errors)[MODEL.mesh.part[chosen], None] / np.linalg.norm(
            ways, axis=1, keepdims=True
        )
        moved = points + ways
        step = f * (moved[:, :2] / moved[:, 2:] - points[:, :2] / points[:, 2:])
        # The depth, too, moves by the error: some parts in a thousand of 8 m.
        assert np.linalg.norm(step[seen], axis=1).max() <= bound * (1.0 + RUNGS[0] / 8.0 * 10)


def test_near_and_behind_the_camera_all_is_drawn() -> None:
    eye = camera()
    assert detail(MODEL, at(0.0, 0.0, 0.5), eye, 0.25) is WHOLE
    assert detail(MODEL, at(0.0, 0.0, -500.0), eye, 0.25) is WHOLE


def test_a_bound_of_zero_draws_all() -> None:
    assert detail(MODEL, at(0.0, 0.0, 500.0), camera(), 0.0) is WHOLE


def test_primitives_of_calibration_scenes_are_drawn_whole() -> None:
    exact = replace(MODEL, exact=True)
    assert detail(exact, at(0.0, 0.0, 500.0), camera(), 0.25) is WHOLE


def test_the_nearer_part_of_a_craft_is_the_finer() -> None:
    station = load_model("iss_like")
    turned = np.eye(4)
    turned[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]  # the truss runs along the boresight
    turned[2, 3] = 120.0
    errors = np.array(detail(station, turned, camera(), 0.25).errors)
    near = station.parts.index("outer_truss_left")
    far = station.parts.index("outer_truss_right")
    assert errors[near] < errors[far]


def test_a_longer_lens_asks_for_more() -> None:
    place = at(0.0, 0.0, 300.0)
    wide, long = (camera(focal_length_mm=f) for f in (13.0, 52.0))
    coarse, fine = (detail(MODEL, place, eye, 0.25).errors for eye in (wide, long))
    np.testing.assert_allclose(np.array(coarse) / np.array(fine), 4.0)
