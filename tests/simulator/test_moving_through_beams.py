"""Light of a lamp on what moves through its beam while the shutter is open."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.scenario.scenario import Scenario
from simgl.simulator import Simulator
from simgl.view.lamp_steps import steps_of_lamps
from tests.scenes import lambert, scene
from tests.simulator.moving_scenes import electrons

EXPOSURE = 1.0


def wall(velocity: tuple[float, float, float], **lamp: Any) -> Scenario:
    """A wall of 2 m that is 10 m before a camera and a lamp when the shutter is half open."""
    box = {"box": {"size_m": [2.0, 2.0, 0.5], "material": lambert(0.6)}}
    chaser = {"box": {"size_m": [0.2, 0.2, 0.2], "material": lambert(0.0)}}
    on = {"on": "chaser", "position_body_m": [0, 0, 0.12], "boresight": [0, 0, 1]}
    beam = {"half_angle_deg": 3.0, "edge_deg": 0.5, "power_w": [1.0, 1.0, 1.0, 1.0]}
    place = np.array([0.0, 0.0, 10.25]) - 0.5 * EXPOSURE * np.array(velocity)
    camera = {**on, "up": [0, 1, 0], "focal_length_mm": 6.0, "pixel_pitch_um": 20.0}
    return scene(
        {
            "chaser": {"model": chaser, "position_icrf_m": [0, 0, 0]},
            "wall": {
                "model": box,
                "position_icrf_m": place.tolist(),
                "velocity_icrf_m_s": list(velocity),
            },
        },
        {
            **camera,
            "width_px": 96,
            "height_px": 96,
            "exposure_time_s": EXPOSURE,
            "shutter": "global",
        },
        sun={"irradiance_w_m2": 0.0},
        lamp={"spot": {**on, **beam, **lamp}},
        render={"inter_reflection": False},
    )


@pytest.mark.parametrize(
    ("velocity", "rms"),
    [
        # 9 px across a beam that stays where it is in the image.
        ((0.3, 0.0, 0.0), 0.004),
        # The beam shrinks on what comes nearer.
        ((0.0, 0.0, -2.0), 0.001),
    ],
)
def test_a_beam_stays_where_it_is_while_a_wall_goes_through_it(
    gl: moderngl.Context, velocity: tuple[float, float, float], rms: float
) -> None:
    """Against the mean of still images. Ways of 0.3 of the edge leave 0.02 of the full light at
    most, on the 6 % of the image that the edge takes: 0.003 rms."""
    one, count = wall(velocity), 24
    middle = one.epoch_tai_ns + round(0.5e9 * EXPOSURE)
    times = middle + np.round(1e9 * EXPOSURE * ((np.arange(count) + 0.5) / count - 0.5))
    with Simulator(one, gl) as simulator:
        image = electrons(simulator, one.at(middle), one.around(middle))
        still = [electrons(simulator, one.at(int(t)), None) for t in times]
    wanted = np.mean(still, axis=0)
    assert np.sqrt(np.mean((image - wanted) ** 2)) < rms * wanted.max()
    assert image.sum() == pytest.approx(wanted.sum(), rel=1e-3)


@pytest.mark.parametrize(
    ("lamp", "velocity"),
    [
        ({"half_angle_deg": 20.0}, (0.3, 0.0, 0.0)),  # all of it in the beam
        ({"boresight": [0, 1, 1]}, (0.3, 0.0, 0.0)),  # none of it
        ({"power_w": [0.0, 0.0, 0.0, 0.0]}, (0.3, 0.0, -2.0)),
        ({}, (1e-3, 0.0, -1e-3)),
    ],
)
def test_where_the_light_stays_there_is_one_snapshot(
    lamp: dict[str, Any], velocity: tuple[float, float, float]
) -> None:
    one = wall(velocity, **lamp)
    times = [one.epoch_tai_ns + round(share * 1e9 * EXPOSURE) for share in (0.0, 0.5, 1.0)]
    assert steps_of_lamps([one.at(time) for time in times], ["chaser", "wall"]) < 1.0
