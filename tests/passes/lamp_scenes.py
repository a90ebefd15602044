"""Scenes lit by a lamp alone, and what its aperture shows past boxes."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from simgl.scenario.scenario import Scenario
from simgl.scene.lamps import LampState
from tests.reference.lamps import lamp_irradiance
from tests.scenes import lambert, radiance, scene

Array = np.ndarray[Any, np.dtype[np.float64]]
Table = dict[str, Any]

POWER = [1.0, 2.0, 3.0, 4.0]


def plate(size: float) -> Table:
    return {"plate": {"width_m": size, "height_m": size, "material": lambert(0.5)}}


def box(size: tuple[float, float, float]) -> Table:
    return {"box": {"size_m": list(size), "material": lambert(0.5)}}


def dark_scene(
    craft: Table,
    camera: Table,
    lamp: Table,
    *,
    lamp_at: tuple[float, float, float] = (0.0, 0.0, 10.0),
    **other: Any,
) -> Scenario:
    """A scene without sunlight whose lamp hangs in space, on the underside of a small box."""
    x, y, z = lamp_at
    carrier = {"model": box((0.2, 0.2, 0.2)), "position_icrf_m": [x, y, z + 0.1]}
    spot = {
        "on": "carrier",
        "position_body_m": [0, 0, -0.1],
        "power_w": POWER,
        "half_angle_deg": 20.0,
        **lamp,
    }
    if "look_at" not in spot:
        spot.setdefault("boresight", [0, 0, -1])
    dark = {"sun": {"irradiance_w_m2": 0.0}}
    return scene({"carrier": carrier, **craft}, camera, lamp={"spot": spot}, **(dark | other))


def ground(scenario: Scenario, distance: float) -> Array:
    """Place across the picture [m], on a plane so far below a camera that looks down."""
    camera = scenario.cameras["cam"]
    width = camera.detector.width
    middles: Array = np.arange(width, dtype=np.float64) + 0.5 - 0.5 * width
    return middles / camera.focal_length_px * distance


DOWN = {"boresight": [0, 0, -1], "up": [0, 1, 0]}


# Size and place of a sheet, a box or a boom, and radius of the aperture [m].
BLINDS = (
    ((0.5, 0.5, 0.001), (0.9, 0.0, 4.0), 0.3),
    ((0.5, 0.5, 0.001), (0.9, 0.0, 1.0), 0.3),
    ((0.5, 0.5, 0.001), (0.9, 0.0, 4.0), 0.05),
    ((0.5, 0.5, 1.5), (1.2, 0.0, 3.0), 0.2),
    ((0.1, 3.0, 0.1), (1.0, 0.0, 2.0), 0.3),
    ((0.6, 0.6, 1.0), (1.2, 0.0, 0.5), 0.3),
    # Smaller than the blur; a post along the light; walls below an aperture as wide as a tenth of
    # its distance.
    ((0.06, 0.06, 0.001), (0.06, 0.0, 9.0), 0.1),
    ((0.3, 0.3, 7.0), (0.5, 0.0, 3.5), 0.3),
    ((0.02, 6.0, 1.5), (0.8, 0.0, 0.75), 1.0),
    ((0.02, 6.0, 3.0), (0.6, 0.0, 1.5), 1.0),
)


def aperture_share(spot: LampState, points: Array, boxes: list[tuple[Array, Array]]) -> Array:
    """(n,) share of the aperture that points see past boxes (low, high corners) [m]; by rays."""
    count = 2000
    radius = spot.lamp.radius * np.sqrt((np.arange(count) + 0.5) / count)
    turn = np.arange(count) * 2.39996323
    x = np.cross(spot.direction, [0.3, 0.9, 0.1])
    x /= np.linalg.norm(x)
    y = np.cross(spot.direction, x)
    disc = spot.position + radius[:, None] * (np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y)
    share = []
    for point in points:
        ray = disc - point
        open_ = np.ones(count, dtype=bool)
        for low, high in boxes:
            with np.errstate(divide="ignore", invalid="ignore"):
                a, b = (low - point) / ray, (high - point) / ray
            enter, leave = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
            open_ &= ~((leave > np.maximum(enter, 1e-6)) & (enter < 1.0))
        share.append(open_.mean())
    return np.array(share)


def soft_shadow(
    gl: moderngl.Context,
    size: tuple[float, float, float],
    at: tuple[float, float, float],
    radius: float,
) -> tuple[Array, Array]:
    """A box or sheet of a size in a place between a lamp and the ground [m].

    radius : of the aperture [m]
    returns : (n,) of full light across the whole penumbra as the image shows it, and by rays
    """
    scenario = dark_scene(
        {
            "plate": {"model": plate(12.0), "position_icrf_m": [0, 0, 0]},
            "blind": {"model": box(size), "position_icrf_m": list(at)},
        },
        {"position_icrf_m": [0, 0, 300.0], **DOWN, "focal_length_mm": 30.0, "width_px": 512},
        {"half_angle_deg": 40.0, "radius_m": radius},
    )
    image = radiance(gl, scenario)
    x = ground(scenario, 300.0)
    spot = scenario.at(scenario.epoch_tai_ns).lamps[0]
    middle, half = np.array(at), 0.5 * np.array(size)
    # What the camera sees of the ground beside the blind.
    top = at[2] + half[2]
    hidden = np.abs(x - at[0] * 300.0 / (300.0 - top)) < half[0] + 0.05
    seen = (x > 0.3) & (x < 4.5) & ~hidden
    x = x[seen]
    points = np.stack([x, np.full_like(x, 0.5 * (x[1] - x[0])), np.zeros_like(x)], axis=1)
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    full = 0.5 / np.pi * lamp_irradiance(spot, points, up)[:, 1]
    lit = image[62:66].astype(np.float64)[:, seen, 1].mean(axis=0) / full
    return lit, aperture_share(spot, points, [(middle - half, middle + half)])
