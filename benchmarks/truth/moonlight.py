"""Light of the night on plates at 400 km: the Moon, the airglow, stars."""

from __future__ import annotations

import moderngl

from benchmarks.truth.rows import Row, Table, relative
from simgl.arrays import Array
from simgl.physics.atmosphere import STANDARD
from simgl.scene.state import SceneState
from simgl.simulator import Simulator
from tests.passes.night_light_scenes import (
    airglow_irradiance,
    facing,
    irradiance,
    moon_irradiance,
    night,
    scenario,
    starlight_irradiance,
)

_GOAL = 0.02
# Angles of the Moon from the Sun's opposite, which are its phases, and of plates from the zenith.
_PHASES, _TILTS = (4.0, 50.0, 85.0), (0.0, 60.0, 80.0)
_TO_THE_EARTH, _AZIMUTHS = (180.0, 150.0, 120.0, 100.0, 90.0, 60.0), (0.0, 30.0)


def table(gl: moderngl.Context) -> Table:
    """All plates, the sum of the bands."""
    rows = []
    with Simulator(scenario(), gl) as simulator:
        base = simulator.scenario

        def row(case: str, truth: Array, state: SceneState) -> Row:
            shown = irradiance(simulator, state)
            return relative(case, float(truth.sum()), float(shown.sum()), _GOAL)

        for moon in _PHASES:
            for tilt in _TILTS:
                state = night(base, facing(tilt), moon_deg=moon, moonlight=True)
                case = f"Moon at phase angle {moon:g} deg, plate {tilt:g} deg from the zenith"
                rows.append(row(case, moon_irradiance(state), state))
        state = night(base, facing(95.0), moon_deg=60.0, sun_deg=90.0, moonlight=True)
        rows.append(row("Moon on the dark side of a sunlit plate", moon_irradiance(state), state))
        for tilt in _TO_THE_EARTH:
            for azimuth in _AZIMUTHS:
                normal = facing(tilt, azimuth)
                place = f"plate {tilt:g} deg from the zenith, azimuth {azimuth:g} deg"
                state = night(base, normal, moon_deg=150.0, air=STANDARD, airglow=True)
                rows.append(row(f"airglow, {place}", airglow_irradiance(normal), state))
                state = night(base, normal, moon_deg=150.0, air=STANDARD, stars=True)
                rows.append(row(f"stars, {place}", starlight_irradiance(normal), state))
    return Table(
        title="Light of the night at 400 km",
        reference="quadrature over the Moon's disc, the layers of the airglow, the sky",
        quantity="irradiance, sum of the bands [W m-2]",
        error="relative",
        rows=rows,
    )
