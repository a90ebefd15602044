"""Light of the Earth on plates at 400 km."""

from __future__ import annotations

import moderngl

from benchmarks.truth.rows import Row, Table
from tests.passes.earth_light_scenes import (
    IRRADIANCE,
    LOW_PLATES,
    LOW_SUN,
    TILT_AZIMUTH,
    as_irradiance,
    attitude,
    earthshine,
    facing,
    plate,
)
from tests.scenes import lambert

# Whichever is larger.
_RELATIVE, _ABSOLUTE = 0.02, 0.002


def table(gl: moderngl.Context) -> Table:
    """All plates and places of the Sun."""
    rows = []
    for places, truths in ((TILT_AZIMUTH, IRRADIANCE), (LOW_PLATES, LOW_SUN)):
        for zenith, irradiance in truths.items():
            for (tilt, azimuth), truth in zip(places, irradiance, strict=True):
                normal = facing(tilt, azimuth)
                white = plate(lambert(1.0))
                image = earthshine(gl, white, attitude(normal, 0.4), normal, zenith)
                shown = as_irradiance(image)
                rows.append(
                    Row(
                        case=f"Sun's zenith angle {zenith:g} deg, plate {tilt:g} deg from nadir, "
                        f"{azimuth:g} deg from the Sun's azimuth",
                        truth=truth,
                        simgl=shown,
                        error=shown - truth,
                        goal=max(_RELATIVE * truth, _ABSOLUTE),
                    )
                )
    return Table(
        title="Light of the Earth at 400 km",
        reference="direct quadrature over a Lambertian Earth of albedo 0.3",
        quantity="irradiance [W m-2]",
        error="W m-2; goal 2 % or 0.002 W m-2",
        rows=rows,
    )
