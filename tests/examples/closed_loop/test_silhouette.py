"""Wing tips in an image, and the position that they give."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from examples.closed_loop.camera import Pinhole
from examples.closed_loop.pose import locate
from examples.closed_loop.silhouette import (
    SPACE_RIDER_WING,
    TipPattern,
    find_target,
    fit_tip,
)
from simgl.arrays import Array, Image16

CAMERA = Pinhole(width=600, height=600, focal_length=1000.0, cx=300.0, cy=300.0, pedestal_dn=64.0)


def covered(begin: float, end: float, count: int) -> Array:
    """(count,) share of each pixel that an interval covers."""
    pixels = np.arange(count, dtype=np.float64)
    overlap = np.minimum(end, pixels + 1.0) - np.maximum(begin, pixels)
    return np.clip(overlap, 0.0, 1.0)


def rectangle(
    left: float, top: float, width: float, height: float, signal: float = 900.0
) -> Image16:
    """A bright rectangle on a dark sky with a noise of 1 DN, exact to a part of a pixel."""
    rng = np.random.default_rng(5)
    light = np.outer(covered(top, top + height, 600), covered(left, left + width, 600))
    return np.round(64.0 + signal * light + rng.standard_normal((600, 600))).astype(np.uint16)


PLAIN = TipPattern(span=10.0, bars=(), cells=((0.0, 5.0),), length=1.6)


@pytest.mark.parametrize("shift", [0.0, 0.1, 0.25, 0.4, 0.5, 0.65, 0.8, 0.95])
def test_both_tips_follow_the_target_by_parts_of_a_pixel(shift: float) -> None:
    found = find_target(rectangle(200.0 + shift, 310.0 - shift, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    assert found.left_tip is not None
    assert found.right_tip is not None
    # Noise of 1 DN over 11 rows and 900 DN signal is 4e-4 px; the fit's grid is 0.01 px and the
    # threshold costs nothing: 0.05 px leaves room for rounding to whole DN.
    assert found.left_tip == pytest.approx((200.0 + shift, 315.5 - shift), abs=0.05)
    assert found.right_tip == pytest.approx((260.0 + shift, 315.5 - shift), abs=0.05)


@pytest.mark.parametrize("scale", [5.3, 11.0, 53.0])
@pytest.mark.parametrize("tip", [3.2, 3.5, 3.9])
def test_a_bright_frame_does_not_move_the_fitted_tip(scale: float, tip: float) -> None:
    def strips(pieces: tuple[tuple[float, float], ...]) -> Array:
        count = int(3 + 1.6 * scale)
        total = np.zeros(count)
        for begin, end in pieces:
            total += covered(tip + begin * scale, tip + end * scale, count)
        return total

    profile = 800.0 * strips(SPACE_RIDER_WING.bars) + 120.0 * strips(SPACE_RIDER_WING.cells)
    # No noise: the fit's grid of 0.01 px.
    assert fit_tip(profile, 3.0, scale, SPACE_RIDER_WING) == pytest.approx(tip, abs=0.0101)


def test_an_empty_image_has_no_target() -> None:
    assert find_target(rectangle(0.0, 0.0, 0.0, 0.0), CAMERA, PLAIN) is None


def test_the_largest_region_is_the_target() -> None:
    sky = rectangle(300.0, 300.0, 50.0, 10.0).astype(np.int64)
    sky += rectangle(100.0, 100.0, 5.0, 5.0, signal=3000.0) - 64
    found = find_target(sky.clip(0).astype(np.uint16), CAMERA, PLAIN)
    assert found is not None
    assert found.box == (300, 300, 350, 310)


def test_a_target_that_shadow_cuts_in_pieces_is_one_target() -> None:
    sky = rectangle(200.0, 300.0, 40.0, 20.0).astype(np.int64)
    sky += rectangle(245.0, 300.0, 30.0, 20.0) - 64
    sky += rectangle(210.0, 285.0, 10.0, 10.0) - 64
    sky += rectangle(280.0, 305.0, 2.0, 2.0, signal=3000.0) - 64  # a star
    found = find_target(sky.clip(0).astype(np.uint16), CAMERA, PLAIN)
    assert found is not None
    assert found.box == (200, 285, 275, 320)


def test_a_target_cut_by_the_border_has_no_tips_and_no_place() -> None:
    found = find_target(rectangle(-5.0, 300.0, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    assert found.left_tip is None
    assert found.right_tip is None
    assert locate(found, CAMERA, np.eye(3), (np.zeros(3), np.ones(3))) is None


def test_two_rays_give_the_position_that_they_come_from() -> None:
    camera_lvlh = np.array([-40.0, 0.7, -1.1])
    tips = np.array([0.0, -5.0, 2.6]), np.array([0.0, 5.0, 2.6])
    R_lvlh_from_camera = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    left, right = (CAMERA.project(R_lvlh_from_camera.T @ (tip - camera_lvlh)) for tip in tips)
    found = find_target(rectangle(200.0, 300.0, 60.0, 11.0), CAMERA, PLAIN)
    assert found is not None
    seen = replace(found, left_tip=left, right_tip=right)
    position = locate(seen, CAMERA, R_lvlh_from_camera, tips)
    assert position is not None
    np.testing.assert_allclose(position, camera_lvlh, atol=1e-9)
    # A tip 20 px too high fits no position.
    wrong = replace(seen, left_tip=(left[0], left[1] - 20.0))
    assert locate(wrong, CAMERA, R_lvlh_from_camera, tips) is None
