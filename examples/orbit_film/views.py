"""The images: an orbit in frames, and the Earth from the ground up, each by its own gain."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from simgl import (
    Product,
    Scenario,
    Simulator,
    display_from_radiance,
    display_gain,
    load_scenario,
    scenario_from_dict,
    tai_ns_from_utc,
)
from simgl.arrays import Array32, Image8
from simgl.errors import ConfigError
from simgl.physics.ephemeris import itrf_from_icrf, sun_position
from simgl.progress import ProgressCallback

ORBIT = Path(__file__).with_name("orbit.toml")
LIMB = Path(__file__).parents[1] / "limb.toml"
FRAMES = 24
# The Sun stands farthest from the plane of an orbit of 51.6 deg: 75 deg.
MIDSUMMER, BETA_FRAMES = "2026-06-21T08:00:00", 12
PERIOD_NS = 5_545 * 10**9
# Shows lamps of cities and bright stars; what is darker stays black.
DARKEST_GAIN = 2.0**18

_UTC = "2026-03-20T12:00:00"
_RADIUS_KM = 6378.137
_SIZE = 480, 360
# Latitude, longitude [deg], height [km], angle of the view from nadir and its azimuth from north
# through east, field of view along a row [deg]. At noon UTC the Sun stands over 2 deg east.
VIEWS = {
    "nadir_400_km": (5.0, -25.0, 400.0, 0.0, 0.0, 40.0),
    "slant_45_deg": (28.0, -18.0, 400.0, 45.0, 60.0, 45.0),
    "limb_400_km": (-5.0, -30.0, 400.0, 66.0, 120.0, 45.0),
    "limb_close": (-5.0, -30.0, 400.0, 70.3, 120.0, 3.0),
    "from_36000_km": (10.0, -10.0, 36_000.0, 0.0, 0.0, 23.0),
    "sunrise_at_2_m": (5.0, -85.5, 0.002, 88.0, 90.0, 60.0),
}


def orbit_frames(progress: ProgressCallback | None = None) -> Iterator[tuple[str, Image8]]:
    """Minute of the orbit with the gain, and the image, frame by frame.

    progress : told of the light between surfaces while it is traced
    """
    return _frames_of(load_scenario(ORBIT), FRAMES, progress)


def beta_frames(
    beta_deg: float, progress: ProgressCallback | None = None
) -> Iterator[tuple[str, Image8]]:
    """As ``orbit_frames``, on midsummer's day with the Sun so far from the orbit's plane, from the
    orbit's noon on."""
    table = tomllib.loads(ORBIT.read_text())
    table["epoch"]["utc"] = MIDSUMMER
    orbit = table["spacecraft"]["space_rider"]["orbit"]
    orbit |= orbit_under_sun(beta_deg, orbit["inclination_deg"])
    return _frames_of(scenario_from_dict(table), BETA_FRAMES, progress)


def orbit_under_sun(beta_deg: float, inclination_deg: float) -> dict[str, float]:
    """Node and anomaly at noon of a circular orbit whose plane the Sun stands ``beta_deg`` from."""
    sun = sun_position(tai_ns_from_utc(MIDSUMMER))
    x, y, z = sun / np.linalg.norm(sun)
    i, beta = np.radians([inclination_deg, beta_deg])
    # sin beta is the Sun's part along the plane's normal (sin i sin node, -sin i cos node, cos i).
    sine = (np.sin(beta) - z * np.cos(i)) / (np.sin(i) * np.hypot(x, y))
    if abs(sine) > 1.0:
        reason = f"is not reached by an orbit inclined by {inclination_deg} deg, got {beta_deg}"
        raise ConfigError("orbit_film", "--beta", reason)
    node = np.arctan2(y, x) + np.arcsin(sine)
    to_node = np.array([np.cos(node), np.sin(node), 0.0])
    ahead = np.array([-np.sin(node) * np.cos(i), np.cos(node) * np.cos(i), np.sin(i)])
    noon = np.arctan2(ahead @ [x, y, z], to_node @ [x, y, z])
    angles = np.degrees([node, noon]) % 360.0
    return {"raan_deg": float(angles[0]), "true_anomaly_deg": float(angles[1])}


def _frames_of(
    scenario: Scenario, count: int, progress: ProgressCallback | None
) -> Iterator[tuple[str, Image8]]:
    with Simulator(scenario, progress=progress) as simulator:
        for frame in range(count):
            after_ns = frame * PERIOD_NS // count
            radiance = radiance_of(simulator, scenario, "chaser", scenario.epoch_tai_ns + after_ns)
            yield shown(f"{after_ns / 60e9:.0f} min", radiance)


def views(progress: ProgressCallback | None = None) -> Iterator[tuple[str, Image8]]:
    """Name with the gain, and the image, of every view; the last has a craft in it."""
    earth = scenario_from_dict(
        {
            "epoch": {"utc": _UTC},
            "camera": {name: camera_over(_UTC, *place) for name, place in VIEWS.items()},
        }
    )
    for scenario in (earth, load_scenario(LIMB)):
        with Simulator(scenario, progress=progress) as simulator:
            for name in scenario.cameras:
                radiance = radiance_of(simulator, scenario, name, scenario.epoch_tai_ns)
                # The square image of the craft is cut to the others' shape.
                yield shown(name, radiance if scenario is earth else radiance[75:525])


def radiance_of(simulator: Simulator, scenario: Scenario, camera: str, tai_ns: int) -> Array32:
    frame = simulator.capture(scenario.at(tai_ns), camera, {Product.RADIANCE}).radiance
    assert frame is not None
    return frame.radiance


def shown(name: str, radiance: Array32) -> tuple[str, Image8]:
    gain = min(display_gain(radiance), DARKEST_GAIN)
    return f"{name}, x {gain:g}", display_from_radiance(radiance, gain)


def camera_over(
    utc: str,
    latitude: float,
    longitude: float,
    height_km: float,
    slant: float,
    azimuth: float,
    field: float,
) -> dict[str, Any]:
    """A camera over a place at a time, as a scenario's table; angles in degrees as in ``VIEWS``."""
    R_icrf_from_itrf = itrf_from_icrf(tai_ns_from_utc(utc)).T
    lat, lon, s, a = np.radians([latitude, longitude, slant, azimuth])
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    ahead = np.cos(a) * np.cross(up, east) + np.sin(a) * east
    view = np.sin(s) * ahead - np.cos(s) * up
    width, height = _SIZE
    pitch_mm = 0.01
    return {
        "position_icrf_m": (R_icrf_from_itrf @ up * (_RADIUS_KM + height_km) * 1e3).tolist(),
        "boresight": (R_icrf_from_itrf @ view).tolist(),
        "up": (R_icrf_from_itrf @ (np.cos(s) * ahead + np.sin(s) * up)).tolist(),
        "width_px": width,
        "height_px": height,
        "pixel_pitch_um": 1e3 * pitch_mm,
        "focal_length_mm": 0.5 * pitch_mm * width / float(np.tan(np.radians(0.5 * field))),
    }
