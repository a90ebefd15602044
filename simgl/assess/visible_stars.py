"""The stars and planets that an image should show: truth for star trackers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simgl.arrays import Array, Mask
from simgl.physics.constants import MOON_RADIUS
from simgl.scene.state import SceneState
from simgl.view.celestial import star_places

Body = Literal["earth", "moon", "sun"]


@dataclass(frozen=True, kw_only=True, eq=False)
class StarSeen:
    """A catalogue star or planet in an image.

    hip : number in the Hipparcos catalogue; None for a planet
    planet : its name; None for a star
    magnitude : Johnson's V
    pixel : column and row, where the lens shows it; the centre of the first pixel is (0.5, 0.5)
    direction_icrf : (3,) unit, with proper motion, parallax and aberration
    irradiance : (4,) per band, facing the star [W m-2]
    hidden_by : the body that hides it, spacecraft not considered; None where it is seen
    """

    hip: int | None
    planet: str | None
    magnitude: float
    pixel: tuple[float, float]
    direction_icrf: Array
    irradiance: Array
    hidden_by: Body | None


def stars_in_view(state: SceneState, camera: str) -> list[StarSeen]:
    """The stars and planets within a camera's image, the brightest first.

    For spacecraft in front see the capture's part ids. Empty where the scene has no stars.
    """
    pinhole = state.cameras[camera]
    places = star_places(state, pinhole)
    if places is None:
        return []
    assert state.stars is not None
    catalogue = state.stars.catalogue
    # The nearest body first: it is the one that hides a star behind several.
    hidden: dict[Body, Mask] = {
        "earth": _behind_earth(state, pinhole.position, places.direction_icrf),
        "moon": _behind_moon(state, pinhole.position, places.direction_icrf),
        "sun": _behind_sun(state, pinhole.position, places.direction_icrf),
    }
    size = pinhole.camera.detector.width, pinhole.camera.detector.height
    seen = []
    for i, row in enumerate(places.rows.tolist()):
        x, y = (float(v) for v in places.pixels[i])
        if not (0.0 <= x < size[0] and 0.0 <= y < size[1]):
            continue
        number = row - len(catalogue.hip)
        planet = None if number < 0 else state.stars.planets[number]
        seen.append(
            StarSeen(
                hip=int(catalogue.hip[row]) if planet is None else None,
                planet=None if planet is None else planet.name,
                magnitude=float(catalogue.magnitude[row]) if planet is None else planet.magnitude,
                pixel=(x, y),
                direction_icrf=places.direction_icrf[i],
                irradiance=places.irradiance[i],
                hidden_by=next((body for body, behind in hidden.items() if behind[i]), None),
            )
        )
    return sorted(seen, key=lambda one: one.magnitude)


def _within(directions: Array, towards: Array, angular_radius: float) -> Mask:
    away = np.linalg.norm(directions - towards, axis=1)
    return away < 2.0 * np.sin(0.5 * angular_radius)


def _behind_sun(state: SceneState, place: Array, directions: Array) -> Mask:
    sun = state.sun.seen_from(place)
    drawn = sun.angular_radius if state.sun.visible else 0.0
    return _within(directions, sun.direction_icrf, drawn)


def _behind_moon(state: SceneState, place: Array, directions: Array) -> Mask:
    if state.moon is None:
        return np.zeros(len(directions), dtype=bool)
    offset = state.moon - place
    distance = float(np.linalg.norm(offset))
    return _within(directions, offset / distance, float(np.arcsin(MOON_RADIUS / distance)))


def _behind_earth(state: SceneState, place: Array, directions: Array) -> Mask:
    if state.earth is None:
        return np.zeros(len(directions), dtype=bool)
    # With lengths scaled so that the ellipsoid is the unit sphere, |o + t d| = 1 for some t > 0.
    radii = np.array(state.earth.earth.radii)
    o = (state.earth.R_itrf_from_icrf @ (place - state.earth.position)) / radii
    d = (directions @ state.earth.R_itrf_from_icrf.T) / radii
    along = d @ o
    discriminant = along**2 - np.sum(d * d, axis=1) * (np.dot(o, o) - 1.0)
    return (along < 0.0) & (discriminant > 0.0)
