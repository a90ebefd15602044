"""Temperatures with closed forms, and what a thermal camera sees of known ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import moderngl
import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.truth.rows import Row, Table, difference, relative
from simgl import assets
from simgl.camera.infrared_detector import NETD_TEMPERATURE, infrared_detectors, measured_netd
from simgl.physics.constants import BOLTZMANN, LIGHT_SPEED, PLANCK, STEFAN_BOLTZMANN
from simgl.physics.thermal_radiation import band_radiance
from simgl.scenario.loader import load_scenario
from simgl.scene.mesh import box
from simgl.scene.thermal_surface import ThermalPart
from simgl.simulator import Simulator
from simgl.thermal.body import thermal_body
from simgl.thermal.heat_loads import heat_loads
from simgl.thermal.history import steady_state
from simgl.thermal.network import SPACE_TEMPERATURE
from tests.thermal.test_closed_forms import exchange_of_two_plates, grey, painted
from tests.thermal.test_published_box import PUBLISHED, TOLERANCE, box_in_orbit
from tests.thermal.test_thermal_image import (
    LONG,
    MID,
    black_plate_brightness,
    closed_box_brightness,
    frame,
    scene,
    sheet,
    within_a_closed_box,
)
from tests.thermal.thermal_scenes import (
    FINISHES,
    SUNLIGHT,
    heat_in_space,
    in_sunlight,
    surface,
)

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
    rows += _published_box(gl)
    return Table(
        title="Temperatures",
        reference="Stefan-Boltzmann in closed form; the orbit by an 8th-order integration; the box "
        "of six nodes by ESATAN-TMS (Meijering 2024, MSc thesis, TU Delft)",
        quantity="temperature, and brightness temperature in images [K]",
        error="difference [K]",
        rows=rows,
    )


def _published_box(gl: moderngl.Context) -> Iterator[Row]:
    for name, seen in box_in_orbit(gl).items():
        for word, truth, value in zip(
            ("lowest", "highest"), PUBLISHED[name][1:], seen, strict=True
        ):
            case = f"box of six nodes in orbit, face {name}, {word}"
            yield difference(case, truth, value, TOLERANCE)


def radiation(gl: moderngl.Context) -> Table:
    """Planck's law, exchange, balance, radiance in images, and a detector's noise."""
    rows = [*_planck(), _two_plates(), _balance()]
    for name, band_um in (("8 to 14", LONG), ("3 to 5", MID)):
        band = 1e-6 * band_um[0], 1e-6 * band_um[1]
        truth = float(band_radiance(band, 300.0))
        seen = float(frame(gl, scene(sheet(1.0), band_um), 300.0).radiance[30, 30])
        rows.append(relative(f"image of a black plate of 300 K, {name} um", truth, seen, 0.01))
    for emissivity in (0.9, 0.2):
        truth = float(band_radiance((8e-6, 14e-6), 300.0))
        seen = float(within_a_closed_box(gl, emissivity).radiance.mean())
        case = f"image within a closed box of 300 K, emissivity {emissivity:g}, 8 to 14 um"
        rows.append(relative(case, truth, seen, 0.01))
    for detector in infrared_detectors().values():
        signal = detector.signal(detector.emission(np.array(NETD_TEMPERATURE)))
        truth = 1e3 * float(detector.noise(signal)) / float(detector.response(NETD_TEMPERATURE))
        seen = 1e3 * float(measured_netd(detector))
        rows.append(relative(f"NETD of {detector.name} from frames [mK]", truth, seen, 0.02))
    return Table(
        title="Thermal radiation",
        reference="quadrature of Planck's law; formula of parallel plates; a step's own balance",
        quantity="band radiance [W m-2 sr-1] unless the case says otherwise",
        error="relative; of the balance the share that is not accounted for",
        rows=rows,
    )


def _planck() -> Iterator[Row]:
    """Band integrals against Gauss' rule over Planck's law in float64."""
    x, weight = np.polynomial.legendre.leggauss(200)
    for low, high in ((7.5, 13.5), (8.0, 14.0), (3.0, 5.0)):
        for kelvin in (200.0, 300.0, 400.0):
            um = low + 0.5 * (high - low) * (x + 1.0)
            first = 2.0 * PLANCK * LIGHT_SPEED**2 / (1e-6 * um) ** 5
            exponent = PLANCK * LIGHT_SPEED / (1e-6 * um * BOLTZMANN * kelvin)
            truth = 0.5e-6 * (high - low) * float(weight @ (first / np.expm1(exponent)))
            seen = float(band_radiance((1e-6 * low, 1e-6 * high), kelvin))
            yield relative(f"Planck's law, {low:g} to {high:g} um, {kelvin:g} K", truth, seen, 1e-6)


def _two_plates() -> Row:
    # 8 times the gap over the width for what leaves at the edges.
    seen, truth = exchange_of_two_plates(0.0005)
    return relative("two plates face to face, 350 and 250 K [W m-2]", truth, seen, 0.004)


def _balance() -> Row:
    """The worst of implicit steps of 1 to 600 s of a servicer in sunlight that goes out."""
    scenario = load_scenario(assets.examples() / "servicer.toml")
    name = next(iter(scenario.models))
    body = thermal_body(name, scenario.models[name], 300)
    network, worst = body.network, 0.0
    state = scenario.at(scenario.epoch_tai_ns)
    with Simulator(scenario) as simulator:
        loads = heat_loads(body, state, simulator.skies.heat(state, name))
    t = network.steady(loads.heat)
    for seconds in (1.0, 10.0, 60.0, 600.0):
        after = network.implicit_step(t, body.power, seconds)
        stored = float(network.capacity @ (after - t)) / seconds
        fourth = STEFAN_BOLTZMANN * (after**4 - SPACE_TEMPERATURE**4)
        lost = float(network.to_space @ fourth)
        # What comes in is stored or leaves to space; exchange within cancels.
        power = float(body.power.sum())
        worst, t = max(worst, abs(power - stored - lost) / (power + lost)), after
    return Row(case="heat balance of steps of 1 to 600 s", truth=0.0, simgl=worst, error=worst,
               goal=1e-6)  # fmt: skip


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
    scene = scenario.at(scenario.epoch_tai_ns)
    state = steady_state(body, scene, heat_in_space(scene))
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
            heat = share * (0.0 if dark else lit)
            t = network.step(t, heat, heat, _STEP)
        name = f"sphere after {'the shadow' if dark else 'the sunlight'} of orbit {number // 2 + 1}"
        yield difference(name, float(first[0]), float(t @ share), _GOAL)
