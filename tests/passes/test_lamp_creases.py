"""Light of lamps along the creases of an open box, and none behind its walls, at their feet."""

from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.arrays import Array
from simgl.motion.trajectory import FixedAttitude, Motion, UniformMotion
from simgl.scenario.scenario import Scenario
from tests.passes.lamp_scenes import dark_scene
from tests.passes.thin_casters import Place, thin_scenes
from tests.reference.lamps import lamp_irradiance
from tests.scenes import radiance

_CAMERA = np.array((0.3, 0.35, 0.3))
_GOAL = 0.02


def _lit_box(name: str, lamp_at: Place, target: Place, radius: float) -> Scenario:
    """An open box of a metre, the camera in it: what it sees of the corner at the origin."""
    camera = {
        "position_icrf_m": _CAMERA.tolist(),
        "boresight": [-0.3, -0.3, -0.3],
        "up": [0.1, 0.2, 1.0],
        "focal_length_mm": 3.0,
        "pixel_pitch_um": 9.0,
    }
    lamp = {
        "position_body_m": [0.0, 0.0, -1.1],
        "boresight": np.subtract(target, lamp_at).tolist(),
        "half_angle_deg": 60.0,
        "radius_m": radius,
    }
    x, y, z = lamp_at
    # What carries the lamp is a metre above it, out of its light.
    empty = dark_scene(
        {}, camera, lamp, lamp_at=(x, y, z + 1.0), render={"inter_reflection": False}
    )
    where = UniformMotion(position=np.zeros(3), velocity=np.zeros(3), epoch_tai_ns=0)
    still = Motion(trajectory=where, attitude=FixedAttitude(R_icrf_from_body=np.eye(3)))
    ((model, _),) = thin_scenes()[name].bodies
    return replace(
        empty, models={**empty.models, "box": model}, motions={**empty.motions, "box": still}
    )


def _full_light(scenario: Scenario) -> Array:
    """(places, h, w) radiance of the corner where nothing shades it."""
    state = scenario.at(scenario.epoch_tai_ns)
    one, spot = state.cameras["cam"], state.lamps[0]
    width, height = one.camera.detector.width, one.camera.detector.height
    rows, columns = np.mgrid[:height, :width]
    light = []
    for across, down in ((0.2, 0.4), (0.8, 0.6), (0.6, 0.2), (0.4, 0.8)):
        at = np.stack([columns.ravel() + across, rows.ravel() + down, np.ones(width * height)])
        ways = np.linalg.solve(one.camera.intrinsics, at).T @ one.R_camera_from_icrf
        # The first of the planes x = 0, y = 0 and z = 0.
        distance = np.where(ways < 0.0, -_CAMERA / ways, np.inf)
        points = _CAMERA + distance.min(axis=1)[:, None] * ways
        normals = np.eye(3)[distance.argmin(axis=1)]
        light.append(0.5 / np.pi * lamp_irradiance(spot, points, normals)[:, 1])
    return np.reshape(light, (4, height, width))


def _around(image: Array, pick: np.ufunc) -> Array:
    """The least or largest of three by three pixels, of all but the outer ones."""
    height, width = image.shape
    return np.asarray(
        pick.reduce(
            [image[j : height - 2 + j, i : width - 2 + i] for j in range(3) for i in range(3)]
        )
    )


@pytest.mark.parametrize("name", ["open box", "box of walls of 1 mm"])
@pytest.mark.parametrize("radius", [0.001, 0.1])
def test_a_lamp_in_a_box_lights_its_creases(gl: moderngl.Context, name: str, radius: float) -> None:
    """All of a convex room sees a lamp in it."""
    scenario = _lit_box(name, (0.45, 0.4, 0.7), (0.1, 0.1, 0.0), radius)
    image = radiance(gl, scenario)[1:-1, 1:-1, 1].astype(np.float64)
    full = _full_light(scenario)
    low = _around(full.min(axis=0), np.minimum)
    high = _around(full.max(axis=0), np.maximum)
    assert high.min() > 0.0
    off = np.maximum(low - image, image - high)
    assert np.all(off < _GOAL * high)


@pytest.mark.parametrize("name", ["open box", "box of walls of 1 mm"])
@pytest.mark.parametrize("lamp_at", [(-0.4, 0.3, 1.5), (-11.0, 5.0, 15.0)])
def test_no_light_of_a_lamp_passes_below_a_wall(
    gl: moderngl.Context, name: str, lamp_at: Place
) -> None:
    """The lamp is behind a wall of a metre, which shades all that the camera sees."""
    scenario = _lit_box(name, lamp_at, (0.5, 0.5, 0.2), 0.001)
    image = radiance(gl, scenario)[..., 1].astype(np.float64)
    full = _full_light(scenario)
    assert full.max() > 0.0
    assert np.all(image <= _GOAL * full.max())
