"""What lights spacecraft in the Earth's shadow: the Moon, the airglow, stars, the moonlit Earth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

from simgl.physics.atmosphere import STANDARD
from simgl.physics.frames import angle_between
from simgl.physics.lunar_model import moonlight
from simgl.scene.lamps import Lamp, LampState
from simgl.simulator import Simulator
from tests.passes.earth_light_scenes import IRRADIANCE
from tests.passes.night_light_scenes import (
    airglow_irradiance,
    facing,
    irradiance,
    moon_irradiance,
    night,
    scenario,
    starlight_irradiance,
)

# Of the quadratures here 1e-4 and less.
GOAL = 0.02


@pytest.fixture
def simulator(gl: moderngl.Context) -> Iterator[Simulator]:
    with Simulator(scenario(), gl) as made:
        yield made


def test_in_umbra_a_plate_has_the_moons_irradiance(simulator: Simulator) -> None:
    # Angles from the Sun's opposite are phase angles.
    for moon_deg, tilt_deg in ((4.0, 0.0), (50.0, 100.0), (85.0, 30.0)):
        state = night(simulator.scenario, facing(tilt_deg), moon_deg=moon_deg, moonlight=True)
        assert not state.sunlight(state.bodies["plate"].pose.position).any()
        lit = irradiance(simulator, state)
        np.testing.assert_allclose(lit, moon_irradiance(state), rtol=GOAL)


def test_a_moon_behind_the_earth_lights_nothing(simulator: Simulator) -> None:
    state = night(simulator.scenario, facing(90.0), moon_deg=115.0, moonlight=True)
    np.testing.assert_array_equal(irradiance(simulator, state), 0.0)


def test_in_sunlight_the_moon_lights_the_side_that_looks_away_from_the_sun(
    simulator: Simulator,
) -> None:
    state = night(simulator.scenario, facing(95.0), moon_deg=60.0, sun_deg=90.0, moonlight=True)
    assert state.sunlit_share(state.bodies["plate"].pose.position) == 1.0
    np.testing.assert_allclose(irradiance(simulator, state), moon_irradiance(state), rtol=GOAL)


def test_the_moons_shadow_is_dark(simulator: Simulator) -> None:
    state = night(simulator.scenario, facing(20.0), moon_deg=40.0, moonlight=True)
    plate = state.bodies["plate"]
    towards = state.direct_light(plate.pose.position).main.direction_icrf
    # Wide enough for its rim not to be seen, and beside the camera.
    screen = replace(plate, pose=replace(plate.pose, position=plate.pose.position + 60.0 * towards))
    shaded = replace(state, bodies={**state.bodies, "screen": screen})
    np.testing.assert_array_equal(irradiance(simulator, shaded), 0.0)


def test_the_airglow_lights_a_plate_from_the_ground_to_above_the_limb(
    simulator: Simulator,
) -> None:
    for tilt_deg in (180.0, 100.0, 60.0):
        normal = facing(tilt_deg, 30.0)
        state = night(simulator.scenario, normal, moon_deg=150.0, air=STANDARD, airglow=True)
        lit = irradiance(simulator, state)
        np.testing.assert_allclose(lit, airglow_irradiance(normal), rtol=GOAL)


def test_stars_light_a_plate_past_earth_and_air(simulator: Simulator) -> None:
    for tilt_deg in (180.0, 90.0, 0.0):
        normal = facing(tilt_deg, 30.0)
        state = night(simulator.scenario, normal, moon_deg=150.0, air=STANDARD, stars=True)
        lit = irradiance(simulator, state)
        np.testing.assert_allclose(lit, starlight_irradiance(normal), rtol=GOAL)


def test_the_moonlit_earth_lights_what_looks_at_it(simulator: Simulator) -> None:
    """As the sunlit one does, in the light that the Moon sends to the Earth's centre."""
    for moon_deg in (0.0, 60.0):
        state = night(
            simulator.scenario,
            facing(180.0),
            moon_deg=moon_deg,
            moonlight=True,
            albedo=(0.3,) * 4,
        )
        assert state.moon is not None
        sun = state.sun.seen_from(state.moon)
        distance = float(np.linalg.norm(state.moon))
        phase = angle_between(sun.direction_icrf, -state.moon)
        wanted = moonlight(sun.irradiance, distance, phase) * IRRADIANCE[moon_deg][0] / 1367.0
        np.testing.assert_allclose(irradiance(simulator, state), wanted, rtol=GOAL)


def test_before_a_bright_lamp_the_moon_is_part_of_the_sky(simulator: Simulator) -> None:
    """Its light stays; its shadows would be a hundredth of the lamp's light."""
    state = night(simulator.scenario, facing(0.0), moon_deg=4.0, moonlight=True)
    place = state.bodies["plate"].pose.position
    dark = state.direct_light(place)
    towards = dark.main.direction_icrf
    # 2 m before the plate: 1 W over a quarter of a steradian.
    lamp = Lamp(
        name="lamp",
        spacecraft="plate",
        position_body=np.zeros(3),
        boresight_body=np.array([0.0, 0.0, 1.0]),
        look_at=None,
        power=np.ones(4),
        half_angle=0.25,
        edge=0.05,
        radius=0.01,
    )
    lit = [
        replace(state, lamps=(LampState(lamp=lamp, position=place + 2.0 * towards, direction=d),))
        for d in (-towards, towards)
    ]
    before, behind = (one.direct_light(place) for one in lit)
    assert before.lesser is not None
    np.testing.assert_array_equal(before.lesser.irradiance, dark.main.irradiance)
    assert not before.main.irradiance.any()
    # A lamp that looks away drowns nothing.
    np.testing.assert_array_equal(behind.main.irradiance, dark.main.irradiance)
