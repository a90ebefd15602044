"""What a program gives wrongly is refused by name and value, and not drawn as something else."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, cast

import moderngl
import numpy as np
import pytest

import simgl
from simgl.camera.detector import FixedPattern, Mosaic, Particles
from simgl.mono12p import pack_mono12p
from simgl.scenario.scenario import Scenario
from simgl.simulator import Product, Simulator
from tests.camera.cameras import camera

NO_INTEGERS = (1.5, 2.0, math.nan, "1", True, np.float64(2.0))
BLACK = (0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return simgl.scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "sun": {"direction_icrf": [1.0, 0.0, 0.0]},
            "earth": {"shape": "none"},
            "camera": {
                "c": {"position_icrf_m": [0, 0, 0], "boresight": [1, 0, 0], "up": [0, 0, 1]}
                | {"width_px": 16, "height_px": 12}
            },
        }
    )


@pytest.fixture
def simulator(gl: moderngl.Context, scenario: Scenario) -> Iterator[Simulator]:
    with Simulator(scenario, ctx=gl) as opened:
        yield opened


def test_a_draw_or_seed_that_is_no_integer(simulator: Simulator) -> None:
    state = simulator.scenario.at(simulator.scenario.epoch_tai_ns)
    given: list[dict[str, Any]] = [{"draw": value} for value in (*NO_INTEGERS, None)]
    for one in [*given, *({"seed": value} for value in NO_INTEGERS)]:
        with pytest.raises(ValueError, match=rf"^{next(iter(one))} must be an integer, got "):
            simulator.capture(state, "c", **one)


def test_integers_of_numpy_are_integers(simulator: Simulator) -> None:
    state = simulator.scenario.at(simulator.scenario.epoch_tai_ns)
    of_numpy = simulator.capture(state, "c", draw=np.int64(3))  # type: ignore[arg-type]
    assert of_numpy.digital is not None
    of_python = simulator.capture(state, "c", draw=3).digital
    assert of_python is not None
    np.testing.assert_array_equal(of_numpy.digital.dn, of_python.dn)


def test_what_is_no_product(simulator: Simulator) -> None:
    state = simulator.scenario.at(simulator.scenario.epoch_tai_ns)
    wrong: list[Any] = ["dn", {"dnn"}, [1], {Product.DN, "dan"}]
    for products in wrong:
        with pytest.raises(ValueError, match=r"^products must be "):
            simulator.capture(state, "c", products)
        with pytest.raises(ValueError, match=r"^products must be "):
            simulator.bracket(state, "c", [state.cameras["c"].camera], products)


@pytest.mark.parametrize("tai_ns", [1.774e18, None, "now", -1, 2**63])
def test_a_time_that_is_no_integer_of_64_bits(scenario: Scenario, tai_ns: Any) -> None:
    with pytest.raises(ValueError, match=r"^tai_ns must "):
        scenario.at(tai_ns)


@pytest.mark.parametrize("sun", [np.zeros(3), np.array([np.nan, 0.0, 1.0])])
def test_a_sun_that_is_nowhere(scenario: Scenario, sun: Any) -> None:
    with pytest.raises(ValueError, match=r"^sun must be a position"):
        scenario.with_poses(scenario.epoch_tai_ns, {}, sun=sun)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("seed", 1.5),
        ("seed", -1),
        ("samples_per_pixel", 16.0),
        ("samples_per_pixel", 0),
        ("thermal_patches", 100.5),
        ("thermal_step", 0.0),
        ("gather", "sample"),
        ("joint_light", "exakt"),
    ],
)
def test_a_scenario(scenario: Scenario, name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"^{name} must "):
        replace(scenario, **{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("width", 32.0),
        ("bits", 12.5),
        ("serial", 1.5),
        ("serial", 2**32),
        ("pedestal", -5.0),
        ("row_time", -1e-6),
        ("blooming", 3.0),
        ("temperature", -5.0),
        ("fill_factor", 0.0),
        ("dark_current_300k", math.nan),
        ("quantum_efficiency", (0.5, 0.5)),
        ("quantum_efficiency", (0.5, 0.5, 0.5, 1.5)),
    ],
)
def test_a_detector(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"^detector: {name} must "):
        replace(camera().detector, **{name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [("camera_equation", "2N"), ("veiling_glare", 2.0), ("transmission", (0.9, 0.9, 0.9))],
)
def test_a_lens(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"^lens: {name} must "):
        replace(camera().lens, **{name: value})


@pytest.mark.parametrize("name", ["readout_time", "transport_latency"])
def test_a_camera_that_answers_before_it_looks(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} must be 0 or more, got -1"):
        replace(camera(), **cast("dict[str, Any]", {name: -1.0}))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Mosaic(order="RGBG", red=BLACK, green=BLACK, blue=BLACK),
        lambda: Mosaic(order="RGGB", red=BLACK, green=(0.5,), blue=BLACK),  # type: ignore[arg-type]
        lambda: FixedPattern(prnu=2.0),
        lambda: FixedPattern(dsnu=-1.0),
        lambda: Particles(flux=1.0, depth=0.0, charge=80.0),
        lambda: simgl.Material(name="m", reflectance=(0.5, 0.5)),  # type: ignore[arg-type]
        lambda: simgl.exposure_value(-4.0, 0.001),
        lambda: simgl.exposure_value(4.0, 0.0),
        lambda: simgl.exposure_time(math.nan, 4.0),
        lambda: simgl.utc_from_tai_ns(1.774e18),  # type: ignore[arg-type]
        lambda: pack_mono12p(np.full((2, 2), 50.5)),
        lambda: pack_mono12p(np.full((2, 2), -1)),
        lambda: simgl.quaternion_from_matrix(-np.eye(3)),
        lambda: simgl.quaternion_from_matrix(2.0 * np.eye(3)),
        lambda: simgl.quaternion_from_matrix(np.full((3, 3), np.nan)),
        lambda: simgl.quaternion_from_matrix(np.eye(2)),
    ],
)
def test_other_values(make: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match=r"got|holds"):
        make()


def test_events_of_what_there_is_not(scenario: Scenario) -> None:
    now, entry = scenario.epoch_tai_ns, simgl.Event.ECLIPSE_ENTRY
    ball = simgl.scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "spacecraft": {
                "ball": {
                    "model": {"sphere": {"radius_m": 1.0, "material": "white_paint"}},
                    "orbit": {"altitude_km": 400.0},
                }
            },
            "camera": {"c": {"about": {"target": "ball", "azimuth_deg": 0.0, "range_m": 9.0}}},
        }
    )

    def found(*, kind: Any = entry, camera: str = "c", target: str = "ball", **times: Any) -> Any:
        span = {"start_ns": now, "stop_ns": now + 10**12, "step_ns": 10**11} | times
        return simgl.event_epochs(ball, kind, camera, target, **span)

    assert found() == []
    for wrong in ({"kind": "dusk"}, {"step_ns": 0}, {"step_ns": 1e11}, {"stop_ns": now - 1}):
        with pytest.raises(ValueError, match=f"^{next(iter(wrong))} must "):
            found(**wrong)
    for unknown in ({"camera": "d"}, {"target": "bell"}):
        with pytest.raises(simgl.ConfigError, match="is unknown"):
            found(**unknown)
