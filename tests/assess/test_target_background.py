"""What lies behind a target, by the geometry of the limb."""

from __future__ import annotations

import numpy as np
import pytest

from simgl.arrays import Array
from simgl.assess.target_background import (
    LIMB_TOP,
    TargetBackground,
    backdrop,
    ring_around,
    tangent_heights,
)
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS
from simgl.physics.frames import camera_from_directions
from simgl.scene.state import EarthState, SceneState
from tests.scenes import scene

ALTITUDE = 400e3
PLACE = np.array([WGS84_EQUATORIAL_RADIUS + ALTITUDE, 0.0, 0.0])
# The horizon of the equator's circle stands so far below the level.
DIP = np.arccos(WGS84_EQUATORIAL_RADIUS / np.linalg.norm(PLACE))


def state() -> SceneState:
    """Over the real Earth; the camera does not matter."""
    one = scene(
        {"ball": {"model": {"sphere": {"radius_m": 1.0, "material": "white_paint"}},
                  "position_icrf_m": PLACE.tolist()}},
        {"position_icrf_m": PLACE.tolist(), "boresight": [0.0, 1.0, 0.0], "up": [1.0, 0.0, 0.0]},
        earth={"shape": "wgs84"},
    )  # fmt: skip
    return one.at(one.epoch_tai_ns)


def upright_earth() -> EarthState:
    """With its equator in the plane of x and y."""
    earth = state().earth
    assert earth is not None
    return EarthState(earth=earth.earth, position=np.zeros(3), R_itrf_from_icrf=np.eye(3))


def looking_down_by(angle: float) -> Array:
    """Along the equator, below the level by an angle."""
    return np.array([-np.sin(angle), np.cos(angle), 0.0])


def test_a_ray_along_the_horizon_touches_the_ground() -> None:
    """In the equator's plane the Earth is a circle: heights are exact there."""
    rays = np.stack([looking_down_by(DIP), looking_down_by(0.0), looking_down_by(-0.5)])
    heights = tangent_heights(upright_earth(), PLACE, rays)
    np.testing.assert_allclose(heights, [0.0, ALTITUDE, ALTITUDE], atol=1e-3)


def test_a_lower_ray_passes_as_much_lower_as_its_angle_says() -> None:
    """Tangent height: r cos(angle) - R."""
    angles = DIP + np.radians([-0.5, 0.5, 3.0])
    rays = np.stack([looking_down_by(angle) for angle in angles])
    expected = np.linalg.norm(PLACE) * np.cos(angles) - WGS84_EQUATORIAL_RADIUS
    np.testing.assert_allclose(tangent_heights(upright_earth(), PLACE, rays), expected, atol=1e-3)


@pytest.mark.parametrize(
    ("below_level", "expected"),
    [
        (0.0, TargetBackground.SPACE),
        (DIP + np.radians(5.0), TargetBackground.EARTH),
        (DIP - 0.5 * LIMB_TOP / 2.29e6, TargetBackground.LIMB),
        (DIP, TargetBackground.MIXED),
    ],
)
def test_the_kind_of_backdrop(below_level: float, expected: TargetBackground) -> None:
    """A ring of 0.5 deg about the boresight; the limb's 60 km are 1.5 deg at its 2,290 km."""
    intrinsics = np.array([[1000.0, 0.0, 32.0], [0.0, 1000.0, 32.0], [0.0, 0.0, 1.0]])
    target = np.zeros((64, 64), dtype=bool)
    target[30:34, 30:34] = True
    ring = ring_around(target, target)
    assert 50 < ring.sum() < 120
    turn = camera_from_directions(looking_down_by(below_level), [1.0, 0.0, 0.0])
    over = state()
    replaced = SceneState(
        tai_ns=over.tai_ns,
        sun=over.sun,
        earth=upright_earth(),
        moon=None,
        bodies=over.bodies,
        cameras=over.cameras,
    )
    assert backdrop(ring, replaced, PLACE, turn, intrinsics) is expected


def test_a_target_that_fills_the_picture_has_no_backdrop() -> None:
    target = np.ones((8, 8), dtype=bool)
    ring = ring_around(target, target)
    assert backdrop(ring, state(), PLACE, np.eye(3), np.eye(3)) is TargetBackground.NONE


def test_other_spacecraft_are_no_background() -> None:
    target, craft = (np.zeros((16, 16), dtype=bool) for _ in range(2))
    target[5:9, 5:9] = True
    craft[:, :9] = True
    ring = ring_around(target, craft)
    assert ring.any()
    assert not (ring & craft).any()
