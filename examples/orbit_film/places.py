"""Fifteen places as an astronaut's camera sees them, and the whole Earth in four seasons."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from examples.orbit_film.views import camera_over, radiance_of, shown
from simgl import Simulator, scenario_from_dict, tai_ns_from_utc
from simgl.arrays import Image8
from simgl.progress import ProgressCallback

View = tuple[float, float, float, float, float, float]

# UTC; latitude, longitude [deg], height [km], angle of the view from nadir and its azimuth from
# north through east, field of view along a row [deg].
PLACES = {
    "trade_cumulus_barbados": ("2026-02-10T15:00:00", (14.0, -55.0, 400.0, 0.0, 0.0, 40.0)),
    "stratocumulus_peru": ("2026-09-10T17:00:00", (-19.0, -83.0, 400.0, 0.0, 0.0, 45.0)),
    "open_cells_southern_ocean": ("2026-11-20T06:00:00", (-48.0, 85.0, 400.0, 20.0, 0.0, 60.0)),
    "towers_gulf_of_guinea": ("2026-04-05T15:30:00", (2.0, -9.0, 400.0, 45.0, 60.0, 45.0)),
    "front_north_atlantic": ("2026-01-25T13:00:00", (46.0, -22.0, 1500.0, 25.0, 30.0, 65.0)),
    "cirrus_sahara": ("2026-01-15T11:00:00", (24.0, 5.0, 400.0, 30.0, 90.0, 45.0)),
    "glint_pacific": ("2026-06-10T21:30:00", (10.0, -140.0, 400.0, 40.0, 290.0, 50.0)),
    "sunset_coral_sea": ("2026-03-20T07:50:00", (-10.0, 155.0, 400.0, 55.0, 260.0, 45.0)),
    "nile_delta": ("2026-05-10T09:30:00", (29.5, 31.5, 400.0, 20.0, 0.0, 40.0)),
    "himalaya": ("2026-11-15T05:30:00", (26.5, 86.5, 400.0, 45.0, 10.0, 40.0)),
    "amazon": ("2026-08-10T15:30:00", (-4.0, -62.0, 400.0, 0.0, 0.0, 45.0)),
    "antarctica": ("2026-12-15T06:00:00", (-66.0, 60.0, 600.0, 45.0, 180.0, 50.0)),
    "limb_day": ("2026-03-20T12:00:00", (-5.0, -30.0, 400.0, 68.0, 120.0, 20.0)),
    "night_italy": ("2026-01-05T22:00:00", (41.0, 10.0, 400.0, 35.0, 60.0, 50.0)),
    "aurora_south": ("2026-06-20T16:00:00", (-48.0, 120.0, 400.0, 62.0, 180.0, 60.0)),
}
# Over noon at these longitudes.
SEASONS = {
    f"earth_{utc[:7]}": (utc, (0.0, east, 36_000.0, 0.0, 0.0, 24.0))
    for utc, east in (
        ("2026-01-15T11:00:00", 15.0),
        ("2026-04-15T18:00:00", -90.0),
        ("2026-07-15T04:00:00", 120.0),
        ("2026-10-15T13:00:00", -15.0),
    )
}


def places(
    views: Mapping[str, tuple[str, View]], progress: ProgressCallback | None = None
) -> Iterator[tuple[str, Image8]]:
    """Name with the gain, and the image, of every view, each at its time."""
    scenario = scenario_from_dict(
        {
            "epoch": {"utc": "2026-03-20T12:00:00"},
            "earth": {"aurora_kp": 4.0, "airglow_waves": 0.15},
            "camera": {name: camera_over(utc, *view) for name, (utc, view) in views.items()},
        }
    )
    with Simulator(scenario, progress=progress) as simulator:
        for name, (utc, _) in views.items():
            yield shown(name, radiance_of(simulator, scenario, name, tai_ns_from_utc(utc)))
