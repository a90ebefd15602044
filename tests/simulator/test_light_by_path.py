"""Light in layers: each is the picture of its light alone, and together they are the picture."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest

from simgl.arrays import AnyArray, Array, Array32
from simgl.passes.surface import LIGHTS
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.scenes import Table, lambert, scene

EARTH = {"shape": "sphere", "radius_km": 6371.0, "albedo": 0.3, "atmosphere": "none"}
NO_SUN = {"irradiance_w_m2": 0.0}
PLACE = 6.771e6
LAMP = {
    "spot": {
        "on": "chaser",
        "position_body_m": [0.0, 0.0, -0.26],
        "boresight": [0, 0, -1],
        "half_angle_deg": 30.0,
        "power_w": [3000.0] * 4,
    }
}
GLOW = {"reflectance": 0.5, "emission_w_m2_sr": [4.0, 3.0, 2.0, 1.0]}


def at(x: float, y: float, z: float) -> list[float]:
    return [x, y, PLACE + z]


def bay(
    *,
    light: bool = True,
    earth: bool = True,
    lamp: bool = True,
    emission: bool = True,
    **render: Any,
) -> Scenario:
    """Space Rider over the lit Earth with a lamp above its bay; a box that glows beside it."""
    glowing: Table = GLOW if emission else lambert(0.5)
    craft: dict[str, Table] = {
        # The bay, at minus z of the body, looks at the zenith.
        "rider": {"model": "space_rider", "position_icrf_m": at(0, 0, 0)},
        "chaser": {
            "model": {"box": {"size_m": [0.5, 0.5, 0.5], "material": lambert(0.4)}},
            "position_icrf_m": at(0.5, 0.6, 5.0),
        },
        "glow": {
            "model": {"box": {"size_m": [1.0, 1.0, 0.2], "material": glowing}},
            "position_icrf_m": at(2.5, 3.0, 0.0),
        },
    }
    craft["rider"]["quaternion_icrf_from_body_xyzw"] = [1.0, 0.0, 0.0, 0.0]
    return scene(
        craft,
        {"position_icrf_m": at(-8.0, 9.0, 11.0), "look_at": "rider", "focal_length_mm": 0.6},
        sun_direction=(0.0, 0.6, 0.8),
        sun={} if light else NO_SUN,
        earth=EARTH if earth else {"shape": "none"},
        lamp=LAMP if lamp else {},
        render={"samples_per_pixel": 16, **render},
    )


def layers(gl: moderngl.Context, scenario: Scenario) -> tuple[dict[str, Array32], Array32]:
    """The layers of a scenario's only camera, and the ordinary picture."""
    with Simulator(scenario, gl) as simulator:
        state = scenario.at(scenario.epoch_tai_ns)
        exposure = simulator.capture(state, "cam", {Product.LAYERS, Product.RADIANCE})
    assert exposure.layers is not None
    assert exposure.radiance is not None
    np.testing.assert_array_equal(
        exposure.layers.total, np.sum(list(exposure.layers.layers.values()), axis=0)
    )
    return dict(exposure.layers.layers), exposure.radiance.radiance


def sum_of(parts: dict[str, Array32]) -> Array:
    return np.sum([part.astype(np.float64) for part in parts.values()], axis=0)


def assert_same(got: AnyArray, expected: AnyArray) -> None:
    """Equal to float32's rounding: sums of 16 samples and six parts, 6e-8 each."""
    np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-6 * float(np.max(expected)))


def test_the_layers_sum_to_the_picture(gl: moderngl.Context) -> None:
    parts, whole = layers(gl, bay())
    assert tuple(parts) == (*LIGHTS, "background")
    assert_same(sum_of(parts), whole)
    # Each of them is a visible part of this picture.
    for name, part in parts.items():
        assert part.shape == (128, 128, 4)
        assert part.dtype == np.float32
        assert part.min() >= 0.0
        assert part.max() > 1e-2 * np.median(whole[whole > 0.0]), name


ABSENT = {
    "sun": {"light": False},
    "earth": {"earth": False},
    "inter_reflected": {"inter_reflection": False},
    "lamp": {"lamp": False},
    "emitted": {"emission": False},
    "background": {"earth": False},
}


@pytest.mark.parametrize("name", ABSENT)
def test_a_layer_is_black_without_its_light_and_only_then(gl: moderngl.Context, name: str) -> None:
    parts, whole = layers(gl, bay(**ABSENT[name]))
    # Without the Sun the Earth is dark as well, and without the Earth so is the background.
    gone = {n for n, part in parts.items() if not part.any()}
    together = {"sun": {"sun", "earth", "background"}, "earth": {"earth", "background"}}
    together["background"] = together["earth"]
    assert gone == together.get(name, {name})
    assert_same(sum_of(parts), whole)


ALONE = {
    "sun": {"earth": False, "lamp": False, "emission": False},
    "lamp": {"light": False, "emission": False},
    "emitted": {"light": False, "lamp": False},
}


@pytest.mark.parametrize("name", ALONE)
def test_a_layer_is_the_picture_with_the_other_lights_off(gl: moderngl.Context, name: str) -> None:
    parts, _ = layers(gl, bay(inter_reflection=False))
    _, alone = layers(gl, bay(**ALONE[name], inter_reflection=False))
    assert alone.any()
    assert_same(parts[name], alone)


def test_the_earths_layer_and_the_background_are_what_it_adds(gl: moderngl.Context) -> None:
    """Without inter-reflection nothing else depends on the Earth, but it hides nothing then."""
    parts, with_earth = layers(gl, bay(inter_reflection=False))
    _, without = layers(gl, bay(earth=False, inter_reflection=False))
    added = with_earth.astype(np.float64) - without
    got = parts["earth"].astype(np.float64) + parts["background"]
    # The difference of two pictures carries their rounding.
    np.testing.assert_allclose(got, added, rtol=0.0, atol=2e-6 * float(with_earth.max()))


def test_a_spacecraft_hides_the_background(gl: moderngl.Context) -> None:
    parts, whole = layers(gl, bay())
    surfaces = sum_of({name: parts[name] for name in LIGHTS})
    background = parts["background"]
    # The Earth fills a corner; the middle of the picture is Space Rider.
    np.testing.assert_array_equal(background[:4, :4], whole[:4, :4])
    assert background[:4, :4].min() > 0.0
    assert not surfaces[:4, :4].any()
    assert not background[60:68, 60:68].any()
    assert surfaces[60:68, 60:68].min() > 0.0
