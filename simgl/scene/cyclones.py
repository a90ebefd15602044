"""Procedural weather from a seed: depressions and how they wind up the clouds, and storms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simgl.arrays import Array, Array32
from simgl.physics.constants import WGS84_EQUATORIAL_RADIUS

# Decks of stratocumulus, by latitude and longitude of their middle and their extent [deg]: off
# Peru, Namibia, California, the Canaries, Western Australia (Klein and Hartmann 1993), and the
# Azores.
DECKS = np.array(
    [
        [-19.0, -84.0, 9.0, 12.0],
        [-15.0, 2.0, 9.0, 9.0],
        [27.0, -126.0, 8.0, 10.0],
        [26.0, -21.0, 6.0, 7.0],
        [-29.0, 102.0, 7.0, 9.0],
        [36.0, -32.0, 5.0, 9.0],
    ],
    dtype=np.float32,
)

# Depressions: how many, and the range of their latitudes [deg], by hemisphere.
_NORTH, _SOUTH = (13, 36.0, 66.0), (17, -68.0, -40.0)
# Great-circle radius of one [rad], and the turn at its middle [rad].
_RADIUS, _TURN = (0.07, 0.16), (1.8, 4.2)
# Storms with anvils: how many there could be, and their latitudes [deg]. The climate chooses.
_STORM_COUNT, _STORMS = 3000, (-40.0, 48.0)


def seed_shift(seed: int) -> Array32:
    """(3,) offset into the noise volume for a seed, in Earth radii."""
    rng = np.random.default_rng([seed, 2])
    return rng.uniform(-4.0, 4.0, 3).astype(np.float32)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Depression:
    """centre : unit vector, ITRF; radius : great-circle [rad]; turn : at its middle [rad]"""

    centre: Array32
    radius: float
    turn: float


def _depressions(seed: int) -> Iterator[_Depression]:
    rng = np.random.default_rng([seed, 3])
    for count, low, high in (_NORTH, _SOUTH):
        # Evenly around the Earth but for a jitter: depressions keep their distance.
        around = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
        for east in rng.permutation(around):
            north = np.radians(rng.uniform(low, high))
            centre = [np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)]
            turn = rng.uniform(*_TURN) * np.sign(low)
            yield _Depression(
                centre=np.array(centre, dtype=np.float32),
                radius=rng.uniform(*_RADIUS),
                turn=turn,
            )


def _verticals(width: int) -> Array32:
    """(width / 2, width, 3) unit vectors of a map's texels, ITRF."""
    height = width // 2
    latitude = np.radians(90.0 - (np.arange(height) + 0.5) * 180.0 / height)[:, None]
    longitude = np.radians((np.arange(width) + 0.5) * 360.0 / width - 180.0)
    x, y = np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)
    z = np.broadcast_to(np.sin(latitude), x.shape)
    return np.stack([x, y, z], axis=-1).astype(np.float32)


def swirls(seed: int, width: int = 1024) -> Array32:
    """(width / 2, width, 3) unit vectors, ITRF: the place that the air of each texel came from.

    Each depression has turned what surrounds it, most in the middle: counterclockwise in the north.
    """
    air = _verticals(width)
    for low in _depressions(seed):
        _turn_about(air, low.centre, low.radius, low.turn)
    return air


def commas(seed: int, width: int = 1024) -> Array32:
    """(width / 2, width, 3) the clouds of depressions, each 0..1.

    Deep cloud: a cold front that trails towards the equator and the west, and winds about the
    depression's middle as the head of a comma. Cold air behind the front. Ice cloud ahead of it.
    The front is a spiral, sharp on its cold side (after the pattern of Carlson 1980).
    """
    verticals = _verticals(width)
    parts = np.zeros((*verticals.shape[:2], 3), dtype=np.float32)
    for low in _depressions(seed):
        near = verticals @ low.centre > np.cos(3.4 * low.radius)
        parts[near] = np.maximum(parts[near], _comma(verticals[near], low))
    return parts


def _comma(verticals: Array32, low: _Depression) -> Array32:
    """(n, 3) what ``commas`` says of one depression."""
    east = np.array([-low.centre[1], low.centre[0], 0.0], dtype=np.float32)
    east /= np.linalg.norm(east)
    north = np.cross(low.centre, east) * np.sign(low.centre[2])
    x, y = verticals @ east, verticals @ north
    r = np.arcsin(np.minimum(np.hypot(x, y), 1.0)) / low.radius
    # Counterclockwise past the front, in the north; a mirror's image in the south.
    front = np.radians(110.0 - 200.0 * (1.0 - np.exp(-r / 1.1)))
    past = np.mod(np.arctan2(y, x) - front + 0.6, 2.0 * np.pi) - 0.6
    # Way across, in radii: the head winds far about the middle, the tail is narrow.
    across = past * np.maximum(r, 0.15)
    wide = np.where(
        r < 1.0, 0.25 + 1.5 * np.maximum(1.0 - r, 0.0) ** 0.7 * r, 0.25 - 0.06 * (r - 1.0)
    )
    fade = np.clip(3.2 - r, 0.0, 1.0)
    deep = _ramp(across / 0.06) * _ramp((1.5 * wide - across) / wide) * fade
    cold = _ramp(-across / 0.1) * _ramp((across + 1.6) / 0.5) * fade * _ramp((r - 0.3) / 0.4)
    ice = _ramp((across + 0.05) / 0.3) * _ramp((3.0 * wide + 0.2 - across) / (2.0 * wide)) * fade
    return np.stack([deep, cold, ice], axis=-1).astype(np.float32)


def _ramp(x: Array) -> Array:
    """0 below 0, 1 above 1, smooth between."""
    t = np.clip(x, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def anvils(seed: int, width: int = 2048) -> Array32:
    """(width / 2, width, 2) ice blown out of towers in the tropics and the summer of continents,
    and the towers' cores, each 0..1.

    Their sizes are spread like a log-normal variable: 20 to 300 km (Machado and Rossow 1993).
    Anvils are blown off the towers to the west near the equator, to the east beyond.
    """
    rng = np.random.default_rng([seed, 4])
    height = width // 2
    parts = np.zeros((height, width, 2), dtype=np.float32)
    texel = np.pi / height
    south, north = (np.sin(np.radians(edge)) for edge in _STORMS)
    latitudes = np.arcsin(rng.uniform(south, north, _STORM_COUNT))
    longitudes = rng.uniform(-np.pi, np.pi, _STORM_COUNT)
    sizes = np.clip(np.exp(rng.normal(np.log(55.0), 0.75, _STORM_COUNT)), 18.0, 260.0)
    sizes *= 1e3 / WGS84_EQUATORIAL_RADIUS
    for latitude, longitude, size in zip(latitudes, longitudes, sizes, strict=True):
        wind = np.pi if abs(latitude) < np.radians(15.0) else 0.0
        wind += rng.normal(0.0, 0.5)
        reach = 2.2 * size
        rows = np.arange(
            int((np.pi / 2 - latitude - reach) / texel),
            int((np.pi / 2 - latitude + reach) / texel) + 1,
        )
        wide = int(reach / (texel * np.cos(latitude))) + 1
        columns = np.arange(-wide, wide + 1) + int((longitude + np.pi) / texel)
        rows = rows[(rows >= 0) & (rows < height)]
        up = (np.pi / 2 - (rows[:, None] + 0.5) * texel - latitude) / size
        east = ((columns + 0.5) * texel - np.pi - longitude) * np.cos(latitude) / size
        along = np.cos(wind) * east + np.sin(wind) * up
        beside = np.cos(wind) * up - np.sin(wind) * east
        # Sharp towards the wind, drawn out with it.
        r = np.hypot(np.where(along > 0.0, along / 1.8, along / 0.7), beside / 0.8)
        anvil = _ramp((1.0 - r) / np.where(along > 0.0, 0.7, 0.3))
        core = _ramp(1.0 - np.hypot(along + 0.1, beside) / 0.55)
        at = np.ix_(rows, np.mod(columns, width))
        parts[at] = np.maximum(parts[at], np.stack([anvil, core], axis=-1))
    return parts


def _turn_about(air: Array32, centre: Array32, radius: float, turn: float) -> None:
    """Turn what lies within a few radii of a centre back to where it was, in place."""
    cosine = air @ centre
    near = cosine > np.cos(min(3.0 * radius, 1.5))
    v, c = air[near], cosine[near]
    distance = np.sqrt(np.maximum(2.0 - 2.0 * c, 0.0)) / radius
    # Steeper than a bell in the middle: arms reach far out.
    angle = -turn * np.exp(-1.2 * distance) * np.clip(3.0 - distance, 0.0, 1.0)
    sine, cosine_turn = np.sin(angle)[:, None], np.cos(angle)[:, None]
    along = (c[:, None] * centre) * (1.0 - cosine_turn)
    air[near] = v * cosine_turn + np.cross(centre, v) * sine + along
