"""Small scenes with hand-made answers, as scenario tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

import moderngl

from simgl.arrays import Array32
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import Scenario
from simgl.simulator import Capture, Product, Simulator

Table = dict[str, Any]

# All that one pass over the scene gives.
USUAL_PRODUCTS = frozenset({Product.DN, Product.ELECTRONS, Product.RADIANCE, Product.TRUTH})

# The Sun of the source study: 1367 W m-2, 5777 K, 0.526 deg.
SUN: Table = {"irradiance_w_m2": 1367.0, "temperature_k": 5777.0, "angular_diameter_deg": 0.526}
TOTAL = 1367.0
# All of that irradiance that falls into the four bands; a grey surface scales with it.
IN_BANDS = 154.43947526 + 174.7738123 + 171.94738469 + 313.35751052


def lambert(reflectance: float) -> Table:
    """An inline Lambertian material."""
    return {"reflectance": reflectance}


def scene(
    spacecraft: Mapping[str, Table],
    camera: Table,
    *,
    sun_direction: tuple[float, float, float] = (0.0, 0.0, 1.0),
    earth: Table | None = None,
    render: Table | None = None,
    sun: Table | None = None,
    lamp: Table | None = None,
) -> Scenario:
    """A scene in deep space (or over an Earth), the Sun fixed by hand, with one camera, "cam"."""
    size = {"width_px": 128, "height_px": 128}
    data: Table = {
        "epoch": {"utc": "2026-03-20T12:00:00"},
        "sun": {**SUN, "direction_icrf": list(sun_direction), **(sun or {})},
        "earth": {"shape": "none"} if earth is None else earth,
        "spacecraft": dict(spacecraft),
        "camera": {"cam": {**size, **camera}},
        "lamp": lamp or {},
        "render": render or {},
    }
    return scenario_from_dict(data)


def capture(gl: moderngl.Context, scenario: Scenario) -> Capture:
    """The usual products of camera "cam" at the scenario's epoch."""
    with Simulator(scenario, gl) as simulator:
        return simulator.capture(scenario.at(scenario.epoch_tai_ns), "cam", USUAL_PRODUCTS)


def radiance(gl: moderngl.Context, scenario: Scenario) -> Array32:
    """(height, width, 4) radiance of camera "cam"."""
    with Simulator(scenario, gl) as simulator:
        return _radiance(simulator, scenario)


@contextmanager
def opened(gl: moderngl.Context, first: Scenario) -> Iterator[Callable[[Scenario], Array32]]:
    """Draws camera "cam" of scenarios with the models, Earth and settings of the first.

    One simulator, which the tests of a module may share: opening one takes longer than a small
    image.

    gl : ``module_gl`` where they do
    """
    with Simulator(first, gl) as simulator:
        yield partial(_radiance, simulator)


def _radiance(simulator: Simulator, scenario: Scenario) -> Array32:
    state = scenario.at(scenario.epoch_tai_ns)
    frame = simulator.capture(state, "cam", {Product.RADIANCE}).radiance
    assert frame is not None
    return frame.radiance
