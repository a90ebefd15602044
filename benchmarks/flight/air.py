"""The air that bends and scatters light, against the U.S. Standard Atmosphere, 1976."""

from __future__ import annotations

import numpy as np

from benchmarks.truth.rows import Table, difference, relative
from simgl.physics.air_profile import UsStandard1976
from simgl.physics.atmosphere import STANDARD
from simgl.physics.refraction import rays_from_space
from tests.authorities.bent_rays import RADIUS, refractivity, traced_bending
from tests.authorities.us_standard_1976 import DENSITIES

_STATION = RADIUS + 400e3
# Lowest heights of rays that pass the Earth [km].
_LOWEST = (0.05, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 60.0)
# Band G.
_BAND = 1


def air_tables() -> list[Table]:
    """Density by height, and the bending of rays."""
    heights, printed = np.array(DENSITIES).T
    shown = UsStandard1976().density(1e3 * heights)
    density = [
        relative(f"{height:.0f} km", float(truth), float(value), 0.01)
        for height, truth, value in zip(heights, printed, shown, strict=True)
    ]
    return [
        Table(
            title="Density of the air",
            reference="U.S. Standard Atmosphere, 1976, as printed",
            quantity="density [kg m-3]",
            error="relative",
            rows=density,
        ),
        _bending_table(),
    ]


def _bending_table() -> Table:
    ground, rays = STANDARD.refractivity[_BAND], rays_from_space(STANDARD, RADIUS, _STATION)
    rows = []
    for km in _LOWEST:
        height = 1e3 * km
        impact = (RADIUS + height) * (1.0 + refractivity(height, ground)[0])
        apparent = np.arcsin(impact / _STATION)
        bending = np.interp(apparent, rays.apparent[:, _BAND], rays.bending[:, _BAND])
        truth = traced_bending(height, ground)
        case = f"down to {km:g} km, from space to space"
        shown = float(np.degrees(bending))
        rows.append(relative(case, float(np.degrees(truth)), shown, 0.01))
    true = np.arcsin((RADIUS + 5e3) / _STATION)
    (seen,) = rays.seen_at(np.array([true]), _BAND)
    lifted = float(np.degrees(seen - true))
    rows.append(difference("a limb at 5 km, lifted for a camera at 400 km", 0.24, lifted, 0.005))
    return Table(
        title="Bent rays",
        reference="a ray tracer in Cartesian steps through the standard's air",
        quantity="angle in band G [deg]",
        error="relative; of the limb, in degrees",
        rows=rows,
    )
