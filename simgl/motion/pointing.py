"""Where a camera looks: along a direction, at a place on a spacecraft, at the Earth's limb."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from simgl.arrays import Array
from simgl.physics.frames import rotation_between, unit

# Axes that directions are given in: of the carrying spacecraft's body, its LVLH, or ICRF.
Axes = Literal["body", "lvlh", "icrf"]


class Ellipsoid(Protocol):
    """The body whose limb a camera looks at."""

    @property
    def position(self) -> Array:
        """(3,) of its centre, ICRF axes [m]."""

    @property
    def R_itrf_from_icrf(self) -> Array:
        """(3, 3) from ICRF axes to its own."""

    @property
    def radii(self) -> tuple[float, float, float]:
        """Of its axes [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A point fixed to a spacecraft: (3,) in its body axes [m]."""

    spacecraft: str
    position_body: Array


@dataclass(frozen=True, kw_only=True)
class Limb:
    """Where sight lines pass the Earth at a height.

    azimuth : about nadir, from ahead (LVLH x) towards the right, minus the orbit normal [rad]
    tangent_height : of the sight line's lowest point over the ellipsoid [m]
    """

    azimuth: float
    tangent_height: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Pointing:
    """The law of a camera's attitude.

    towards : (3,) direction in ``axes``, or what the boresight is kept on
    up : (3,) in ``axes``, towards the top of the picture
    sun_exclusion : the boresight keeps this far from the Sun [rad]; 0 does not care
    """

    towards: Array | Place | Limb
    axes: Axes
    up: Array
    sun_exclusion: float = 0.0


def limb_direction(limb: Limb, position: Array, R_lvlh_from_icrf: Array, earth: Ellipsoid) -> Array:
    """(3,) unit, ICRF axes: the sight line from a place that just passes at the tangent height.

    position : (3,) [m]

    The sight line lies in the plane of nadir and azimuth and touches the ellipsoid whose radii are
    larger by the height. With nadir n and horizontal a, and lengths scaled so that this ellipsoid
    is the unit sphere about the origin, p + s (n + t a) touches it where
    ``(p.d)^2 = d.d (p.p - 1)``: a quadratic in t, the tangent of the angle from nadir.

    Raises ValueError where the place lies below the height.
    """
    scale = earth.R_itrf_from_icrf / (np.array(earth.radii) + limb.tangent_height)[:, None]
    ahead, right, nadir = R_lvlh_from_icrf
    p = scale @ (position - earth.position)
    n = scale @ nadir
    a = scale @ (np.cos(limb.azimuth) * ahead + np.sin(limb.azimuth) * right)
    beyond = float(p @ p) - 1.0
    if beyond <= 0.0:
        raise ValueError("must lie below the camera")
    quadratic = float((p @ a) ** 2 - (a @ a) * beyond)
    linear = 2.0 * float((p @ n) * (p @ a) - (n @ a) * beyond)
    constant = float((p @ n) ** 2 - (n @ n) * beyond)
    # One limb lies on either side of nadir: quadratic and constant differ in sign.
    tangent = (-linear - np.sqrt(linear**2 - 4.0 * quadratic * constant)) / (2.0 * quadratic)
    side = np.cos(limb.azimuth) * ahead + np.sin(limb.azimuth) * right
    return unit(nadir + tangent * side)


def away_from_sun(boresight: Array, sun_direction: Array, least: float, up: Array) -> Array:
    """(3,) unit: the boresight, or the nearest direction that keeps an angle from the Sun.

    boresight, sun_direction, up : (3,) in one frame; a boresight on the Sun moves towards ``up``
    least : [rad]
    """
    b, s = unit(boresight), unit(sun_direction)
    apart = 2.0 * np.arctan2(np.linalg.norm(b - s), np.linalg.norm(b + s))
    if apart >= least:
        return b
    away = b - (b @ s) * s
    if np.linalg.norm(away) < 1e-9:
        away = rotation_between([0.0, 0.0, 1.0], s) @ [1.0, 0.0, 0.0]
        across = up - (up @ s) * s
        if np.linalg.norm(across) > 1e-9:
            away = across
    return np.cos(least) * s + np.sin(least) * unit(away)
