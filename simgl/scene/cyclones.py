"""Procedural weather from a seed: places of depressions and how they wind up the clouds."""

from __future__ import annotations

import numpy as np

from simgl.arrays import Array32

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


def seed_shift(seed: int) -> Array32:
    """(3,) offset into the noise volume for a seed, in Earth radii."""
    rng = np.random.default_rng([seed, 2])
    return rng.uniform(-4.0, 4.0, 3).astype(np.float32)


def swirls(seed: int, width: int = 1024) -> Array32:
    """(width / 2, width, 3) unit vectors, ITRF: the place that the air of each texel came from.

    Each depression has turned what surrounds it, most in the middle: counterclockwise in the north.
    """
    rng = np.random.default_rng([seed, 3])
    height = width // 2
    latitude = np.radians(90.0 - (np.arange(height) + 0.5) * 180.0 / height)[:, None]
    longitude = np.radians((np.arange(width) + 0.5) * 360.0 / width - 180.0)
    x, y = np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)
    air = np.stack([x, y, np.broadcast_to(np.sin(latitude), x.shape)], axis=-1).astype(np.float32)
    for count, low, high in (_NORTH, _SOUTH):
        # Evenly around the Earth but for a jitter: depressions keep their distance.
        around = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
        for east in rng.permutation(around):
            north = np.radians(rng.uniform(low, high))
            centre = [np.cos(north) * np.cos(east), np.cos(north) * np.sin(east), np.sin(north)]
            turn = rng.uniform(*_TURN) * np.sign(low)
            _turn_about(air, np.array(centre, dtype=np.float32), rng.uniform(*_RADIUS), turn)
    return air


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
