"""The benchmark of the cost of illumination: what it draws as plain light."""

from __future__ import annotations

import moderngl
import numpy as np

from benchmarks.illumination import light
from simgl import Simulator
from simgl.arrays import Array32
from simgl.simulator import Product
from tests.web.small_scene import box_scenario


def test_plain_light_is_that_of_the_sun_alone_and_ends_with_its_block(
    gl: moderngl.Context,
) -> None:
    """The Earth lights a box's sides, which plain light leaves out, and what lies behind is the
    same: the names that the benchmark replaces are those that frames call."""
    scenario = box_scenario(earth={"shape": "sphere", "radius_km": 6371.0, "albedo": 0.5})
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario, gl) as simulator:

        def radiance() -> Array32:
            frame = simulator.capture(state, "nav", [Product.RADIANCE]).radiance
            assert frame is not None
            return frame.radiance

        before = radiance()
        with light(is_plain=True):
            plain = radiance()
        after = radiance()
    np.testing.assert_array_equal(after, before)
    earth_light = before - plain
    assert earth_light.max() > 0.05 * before.max()
    # float32 sums: of what lies behind nothing is lost.
    assert earth_light.min() > -1e-5 * before.max()
