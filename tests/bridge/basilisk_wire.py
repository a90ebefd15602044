"""Messages as Basilisk sends them, written by field number."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import zmq
from PIL import Image
from simgl_bridge.basilisk.endpoint import varint
from simgl_bridge.basilisk.viz_scene import matrix_from_mrp

from simgl.arrays import Array, Image8
from tests.patience import limit

AU = 149597870700.0
SIGMA_CB = (0.1, -0.2, 0.3)
PLACE = (9.0e6, 0.0, 0.0)
# The server's own files.
SCENARIO = """
[epoch]
utc = "2026-06-01T12:00:00"
[earth]
albedo = 0.5
atmosphere = "none"
[sky]
stars = false
[spacecraft.target]
model = { sphere = { radius_m = 0.5, material = { reflectance = 0.5 } } }
position_icrf_m = [8e6, 0.0, 0.0]
[render]
samples_per_pixel = 16
"""
SHEET = """
preset = "ideal"
exposure_time_s = 0.00005
"""


def number(field: int, value: int) -> bytes:
    return varint(field << 3) + varint(value)


def double(field: int, value: float) -> bytes:
    return varint(field << 3 | 1) + struct.pack("<d", value)


def block(field: int, data: bytes) -> bytes:
    return varint(field << 3 | 2) + varint(len(data)) + data


def text(field: int, value: str) -> bytes:
    return block(field, value.encode())


def doubles(field: int, values: Sequence[float]) -> bytes:
    return block(field, struct.pack(f"<{len(values)}d", *values))


def body(name: str, position: Sequence[float], radius_km: float = 0.0) -> bytes:
    """A CelestialBody whose fixed axes are those of J2000."""
    fixed = doubles(4, np.eye(3).ravel().tolist())
    shape = double(6, radius_km) + double(7, 1.0)
    return block(2, text(1, name) + doubles(2, position) + doubles(3, [0.0] * 3) + fixed + shape)


def craft(name: str, position: Sequence[float], sigma_BN: Sequence[float]) -> bytes:
    return block(
        3, text(1, name) + doubles(2, position) + doubles(3, [0.0] * 3) + doubles(4, sigma_BN)
    )


def camera(
    *,
    id: int = 1,
    parent: str = "chaser",
    fov_deg: float = 40.0,
    resolution: tuple[int, int] = (64, 48),
    direction_B: Sequence[float],
    position_B: Sequence[float] = (0.0, 0.0, 0.0),
    render_mode: int = 0,
) -> bytes:
    packed = varint(resolution[0]) + varint(resolution[1])
    return block(
        4,
        number(1, id)
        + text(2, parent)
        + double(3, fov_deg)
        + block(4, packed)
        + doubles(7, position_B)
        + doubles(8, direction_B)
        + number(16, render_mode),
    )


def epoch(year: int = 2026) -> bytes:
    return block(8, number(1, year) + number(2, 6) + number(3, 1) + number(4, 12))


def instant(seconds: float, frame: int = 1) -> bytes:
    return block(1, number(1, frame) + double(2, seconds * 1e9))


def mrp_sum(first: Sequence[float], second: Sequence[float]) -> list[float]:
    """The rotation by ``first``, then by ``second`` (Schaub and Junkins, eq. 3.157)."""
    a, b = np.asarray(first), np.asarray(second)
    aa, bb = float(a @ a), float(b @ b)
    below = 1.0 + aa * bb - 2.0 * float(a @ b)
    total = ((1.0 - aa) * b + (1.0 - bb) * a - 2.0 * np.cross(b, a)) / below
    return [float(v) for v in total]


def direction_from_sigma(sigma_CB: Sequence[float]) -> list[float]:
    """What Basilisk sends for a camera's attitude sigma_CB."""
    return mrp_sum(sigma_CB, (1 / 3, 1 / 3, -1 / 3))


def sigma_from_matrix(R_b_from_a: Array) -> list[float]:
    """Modified Rodrigues parameters sigma_ba of a rotation, by its unit quaternion."""
    w = 0.5 * np.sqrt(1.0 + float(np.trace(R_b_from_a)))
    v = np.array(
        [
            R_b_from_a[1, 2] - R_b_from_a[2, 1],
            R_b_from_a[2, 0] - R_b_from_a[0, 2],
            R_b_from_a[0, 1] - R_b_from_a[1, 0],
        ]
    ) / (4.0 * w)
    return [float(x) for x in v / (1.0 + w)]


def looking_at_earth(position: Sequence[float], sigma_CB: Sequence[float]) -> list[float]:
    """sigma_BN that turns a camera on a craft to the origin, its x as near +y as can be."""
    z = -np.asarray(position) / np.linalg.norm(position)
    y = np.cross(z, [0.0, 1.0, 0.0])
    y /= np.linalg.norm(y)
    R_camera_from_icrf = np.stack([np.cross(y, z), y, z])
    return sigma_from_matrix(matrix_from_mrp(sigma_CB).T @ R_camera_from_icrf)


def scene(
    *,
    seconds: float = 1.0,
    frame: int = 1,
    central: bytes | None = None,
    sun: Sequence[float] | None = (AU, 0.0, 0.0),
    place: tuple[float, float, float] = PLACE,
    more: bytes = b"",
    at: bytes | None = None,
    **of_camera: Any,
) -> bytes:
    """A state whose camera looks at the origin from ``place``; ``at`` is its epoch."""
    message = instant(seconds, frame) + (epoch() if at is None else at)
    message += body("earth", (0.0, 0.0, 0.0), 6378.1366) if central is None else central
    if sun is not None:
        message += body("sun", sun, 695700.0)
    message += craft("chaser", place, looking_at_earth(place, SIGMA_CB))
    return message + camera(direction_B=direction_from_sigma(SIGMA_CB), **of_camera) + more


def pixels(png: bytes) -> Image8:
    """An image that was received."""
    picture = np.asarray(Image.open(io.BytesIO(png)))
    assert picture.dtype == np.uint8
    return picture


class Peer:
    """A REQ socket, as vizInterface has one, that waits no longer than 20 s."""

    def __init__(self, address: str) -> None:
        self._context: zmq.Context[Any] = zmq.Context()
        self.socket = self._context.socket(zmq.REQ)
        self.socket.connect(address)

    def ask(self, *frames: bytes) -> list[bytes]:
        self.socket.send_multipart(frames)
        assert self.socket.poll(round(limit(20_000))), "no reply"
        return self.socket.recv_multipart()

    def update(self, message: bytes) -> list[bytes]:
        return self.ask(b"SIM_UPDATE", b"", b"", message)

    def image(self, id: int = 1) -> bytes:
        size, png = self.ask(f"REQUEST_IMAGE_{id}".encode())
        assert struct.unpack(">i", size) == (len(png),)
        return png

    def close(self) -> None:
        self._context.destroy(linger=0)
