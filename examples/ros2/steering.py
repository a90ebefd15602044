"""A flight that steers by brightness, whichever way its images come."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np

from simgl.arrays import Array, Image16

# The epoch of examples/bridge/box.toml, as ROS counts time.
START_NS = int(datetime(2026, 3, 20, 12, tzinfo=UTC).timestamp()) * 1_000_000_000
STEPS = 8
START_M, VELOCITY_M_S = (1.0, 0.0, 60.0), (0.0, 0.0, -0.5)
# Of the speed to the side over the direction; it halves the distance in 4 s at 60 m.
GAIN_M_S = 10.0

# From time [ns] and position of the chaser [m] to DN (height, width), cx and fx [px].
Look = Callable[[int, Array], tuple[Image16, float, float]]


def off_axis(dn: Image16, cx_px: float, focal_length_px: float) -> float:
    """Direction of the light's centre, right of the boresight [rad]; columns count from 0."""
    light = np.where(dn > 0.25 * dn.max(), dn, 0).sum(axis=0, dtype=np.float64)
    return float((light @ np.arange(dn.shape[1]) / light.sum() - cx_px) / focal_length_px)


def fly(look: Look) -> None:
    """Fly some steps of a second; print hash and direction of each image."""
    position, velocity = np.array(START_M), np.array(VELOCITY_M_S)
    for step in range(STEPS):
        dn, cx_px, focal_length_px = look(START_NS + step * 1_000_000_000, position)
        angle = off_axis(dn, cx_px, focal_length_px)
        print(step, hashlib.blake2b(dn.tobytes(), digest_size=16).hexdigest(), f"{angle:+.6f}")
        velocity[0] = GAIN_M_S * angle
        position = position + velocity
