"""Pointing laws of cameras: along a direction, at a point on a spacecraft, at the Earth's limb."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from simgl.arrays import Array
from simgl.physics.frames import rotation_between, unit

# Axes of given directions: the carrying spacecraft's body, its LVLH frame, or ICRF.
Axes = Literal["body", "lvlh", "icrf"]


class Ellipsoid(Protocol):
    """A planet, for its limb."""

    @property
    def position(self) -> Array:
        """(3,) of its centre in GCRF [m]."""

    @property
    def R_itrf_from_icrf(self) -> Array:
        """(3, 3) from ICRF to planet-fixed axes."""

    @property
    def radii(self) -> tuple[float, float, float]:
        """Semi-axes [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """A point of a spacecraft: (3,) in its body axes, as stored [m].

    group : index in ``body_from_stored`` of what carries it; 0 for no joint
    """

    spacecraft: str
    position_body: Array
    group: int = 0


@dataclass(frozen=True, kw_only=True)
class Limb:
    """A point on the Earth's limb.

    azimuth : about nadir, from ahead (LVLH x) to the right (minus the orbit normal) [rad]
    tangent_height : lowest height of the line of sight above the ellipsoid [m]
    """

    azimuth: float
    tangent_height: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Pointing:
    """The attitude law of a camera.

    towards : (3,) direction in ``axes``, or the point that the boresight tracks
    up : (3,) in ``axes``, towards the top of the image
    sun_exclusion : smallest angle between boresight and Sun [rad]; 0 for none
    """

    towards: Array | Place | Limb
    axes: Axes
    up: Array
    sun_exclusion: float = 0.0


def limb_direction(limb: Limb, position: Array, R_lvlh_from_icrf: Array, earth: Ellipsoid) -> Array:
    """(3,) unit, ICRF axes: the line of sight with the given azimuth and tangent height.

    position : (3,) of the camera in GCRF [m]

    The line of sight lies in the plane of nadir and azimuth and is tangent to the ellipsoid whose
    radii are larger by the height. With nadir n and horizontal a, and lengths scaled so that this
    ellipsoid is the unit sphere about the origin, p + s (n + t a) = p + s d is tangent where
    ``(p.d)^2 = d.d (p.p - 1)``: a quadratic in t, the tangent of the angle from nadir.

    Raises ValueError if the camera is below the tangent height.
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
    # One solution lies on either side of nadir: quadratic and constant differ in sign.
    tangent = (-linear - np.sqrt(linear**2 - 4.0 * quadratic * constant)) / (2.0 * quadratic)
    side = np.cos(limb.azimuth) * ahead + np.sin(limb.azimuth) * right
    return unit(nadir + tangent * side)


def away_from_sun(boresight: Array, sun_direction: Array, exclusion: float, up: Array) -> Array:
    """(3,) unit: the boresight, or the closest direction outside the Sun exclusion angle.

    boresight, sun_direction, up : (3,) in one frame; a boresight on the Sun moves towards ``up``
    exclusion : smallest angle from the Sun [rad]
    """
    b, s = unit(boresight), unit(sun_direction)
    separation = 2.0 * np.arctan2(np.linalg.norm(b - s), np.linalg.norm(b + s))
    if separation >= exclusion:
        return b
    away = b - (b @ s) * s
    if np.linalg.norm(away) < 1e-9:
        away = rotation_between([0.0, 0.0, 1.0], s) @ [1.0, 0.0, 0.0]
        across = up - (up @ s) * s
        if np.linalg.norm(across) > 1e-9:
            away = across
    return np.cos(exclusion) * s + np.sin(exclusion) * unit(away)
