"""Temperatures with closed forms, and what a thermal camera sees of known ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import moderngl
import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.truth.rows import Row, Table, difference
from simgl.physics.constants import STEFAN_BOLTZMANN
from simgl.scene.mesh import box
from simgl.scene.thermal_surface import ThermalPart
from simgl.thermal.body import thermal_body
from simgl.thermal.history import steady_state
from simgl.thermal.network import SPACE_TEMPERATURE
from tests.thermal.test_closed_forms import grey, painted
from tests.thermal.test_thermal_image import (
    LONG,
    MID,
    black_plate_brightness,
    closed_box_brightness,
)
from tests.thermal.thermal_scenes import FINISHES, SUNLIGHT, in_sunlight, surface

_GOAL = 0.1  # [K]
# A lumped sphere in an orbit of two levels of light: period, time in shadow, step [s].
_PERIOD, _SHADOW, _STEP = 5400.0, 2100.0, 5.0


def table(gl: moderngl.Context) -> Table:
    """Spheres and plates in sunlight, power, an orbit, black bodies in images."""
    rows = [*_in_sunlight(), _internal_power(), *_orbit()]
    for name, band_um in (("8 to 14", LONG), ("3 to 5", MID)):
        seen = black_plate_brightness(gl, band_um)
        rows.append(difference(f"black plate of 300 K in {name} um", 300.0, seen, _GOAL))
    for emissivity in (0.9, 0.5, 0.2):
        seen = closed_box_brightness(gl, emissivity)
        case = f"in a closed box of 300 K, emissivity {emissivity:g}"
        rows.append(difference(case, 300.0, seen, _GOAL))
    return Table(
        title="Temperatures",
        reference="Stefan-Boltzmann in closed form; the orbit by an 8th-order integration",
        quantity="temperature, and brightness temperature in images [K]",
        error="difference [K]",
        rows=rows,
    )


def _in_sunlight() -> Iterator[Row]:
    for name, (alpha, epsilon) in FINISHES.items():
        ratio = alpha * SUNLIGHT / (epsilon * STEFAN_BOLTZMANN)
        ball = {"sphere": {"radius_m": 1.0, "material": surface(alpha, epsilon, 1e5)}}
        seen = _warmest(ball, 600)
        yield difference(f"sphere in sunlight, {name}", (0.25 * ratio) ** 0.25, seen, _GOAL)
    for name, (alpha, epsilon) in FINISHES.items():
        ratio = alpha * SUNLIGHT / (epsilon * STEFAN_BOLTZMANN)
        sheet = {"plate": {"width_m": 1.0, "height_m": 1.0, "material": surface(alpha, epsilon)}}
        seen = _warmest(sheet, 200)
        yield difference(f"plate insulated behind, {name}", ratio**0.25, seen, _GOAL)


def _warmest(model: Mapping[str, object], count: int) -> float:
    scenario = in_sunlight(dict(model))
    body = thermal_body("body", scenario.models["body"], count)
    state = steady_state(body, scenario.at(scenario.epoch_tai_ns))
    return float(state.temperatures[: body.patch_count].max())


def _internal_power() -> Row:
    model = painted(box((1.0, 1.0, 1.0)), grey(0.85, 1e5), part_0=ThermalPart(power=100.0))
    body = thermal_body("body", model, 200)
    seen = float(body.network.steady(body.power).mean())
    truth = 100.0 / (0.85 * 6.0 * STEFAN_BOLTZMANN) + SPACE_TEMPERATURE**4
    return difference("box of 1 m with 100 W inside", truth**0.25, seen, _GOAL)


def _orbit() -> Iterator[Row]:
    """A sphere of one node, lit and dark in turn: its extremes after two orbits."""
    model = {"sphere": {"radius_m": 1.0, "material": surface(0.95, 0.9, 1e5)}}
    body = thermal_body("body", in_sunlight(model).models["body"], 60)
    network, area = body.network, float(body.network.to_space.sum()) / 0.9
    capacity = float(network.capacity.sum())
    lit = 0.95 * SUNLIGHT * 0.25 * area

    def rate(time: float, t: np.ndarray) -> np.ndarray:
        heat = lit if time % _PERIOD < _PERIOD - _SHADOW else 0.0
        loss = 0.9 * area * STEFAN_BOLTZMANN * (t**4 - SPACE_TEMPERATURE**4)
        return (heat - loss) / capacity

    t, first = np.full(len(network.capacity), 280.0), np.array([280.0])
    # In all nodes by capacity: the sphere conducts well.
    share = network.capacity / capacity
    for number in range(4):
        dark = number % 2 == 1
        length = _SHADOW if dark else _PERIOD - _SHADOW
        start = number // 2 * _PERIOD + (_PERIOD - _SHADOW if dark else 0.0)
        inside = (start + 1e-9, start + length - 1e-9)
        first = solve_ivp(rate, inside, first, method="DOP853", rtol=1e-11).y[:, -1]
        for _ in range(round(length / _STEP)):
            t = network.step(t, share * (0.0 if dark else lit), _STEP)
        name = f"sphere after {'the shadow' if dark else 'the sunlight'} of orbit {number // 2 + 1}"
        yield difference(name, float(first[0]), float(t @ share), _GOAL)
