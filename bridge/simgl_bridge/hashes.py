"""Hashes of a scene, a state and an image, the same on any machine and in any process."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import msgspec

from simgl.content_digest import content_digest
from simgl_bridge.message_parts import CameraImage, SentPose, SentSun
from simgl_bridge.messages import Render, State

if TYPE_CHECKING:
    from simgl.scenario.scenario import Scenario


def state_hash(
    *,
    tai_ns: int,
    bodies: Mapping[str, SentPose],
    sun: SentSun | None,
    cameras: Sequence[tuple[str, float, float]],
    seed: int,
    lamps: Mapping[str, float] = MappingProxyType({}),
    moving: bool = False,
    draw: int = 0,
    thermal_from: str = "",
) -> str:
    """Hash of the state that images show, computed by server and client alike.

    BLAKE2b with 16 bytes in hexadecimal digits, over the MessagePack array
    ``[tai_ns, [[name, position_m, velocity_m_s, q_icrf_from_body_xyzw, [[joint, value], ...]],
    ...], sun position_m or nil, [[camera, exposure_time_s, gain_dn_per_e], ...], seed]``:
    spacecraft as sent, sorted by name, and so are joints; cameras in the order of the request, with
    the values used. Integers, and the lengths of texts and arrays, take the shortest MessagePack
    form that holds them: ``tai_ns`` is always a uint 64, ``seed`` and ``draw`` a positive fixint,
    uint 8, uint 16 or uint 32. Real numbers are float 64, also those that were sent as integers or
    float 32. Names sort by Unicode code points, which is the order of their UTF-8 bytes. Where
    lamps were sent, ``moving`` is set or ``draw`` is not 0, a sixth entry follows: ``[[[lamp,
    share], ...], [[name, angular_velocity_rad_s], ...]]``, lamps and spacecraft sorted by name, the
    second list nil without ``moving``. A ``draw`` that is not 0 is the seventh entry. A
    ``thermal_from`` that is not empty is the last entry, a text.
    """
    sorted_bodies = [
        [
            name,
            [float(v) for v in pose.position_m],
            [float(v) for v in pose.velocity_m_s],
            [float(v) for v in pose.q_icrf_from_body_xyzw],
            [[joint, float(value)] for joint, value in sorted(pose.joints.items())],
        ]
        for name, pose in sorted(bodies.items())
    ]
    sun_position = None if sun is None else [float(v) for v in sun.position_m]
    shots = [[name, float(exposure), float(gain)] for name, exposure, gain in cameras]
    state: list[object] = [int(tai_ns), sorted_bodies, sun_position, shots, int(seed)]
    if lamps or moving or draw:
        rates = [
            [name, [float(v) for v in pose.angular_velocity_rad_s]]
            for name, pose in sorted(bodies.items())
        ]
        shares = [[name, float(share)] for name, share in sorted(lamps.items())]
        state.append([shares, rates if moving else None])
    if draw:
        state.append(int(draw))
    if thermal_from:
        state.append(thermal_from)
    return hashlib.blake2b(msgspec.msgpack.encode(state), digest_size=16).hexdigest()


def shown_state_hash(request: Render | State, images: Sequence[CameraImage], seed: int) -> str:
    """State hash of a request and the images that it was answered with."""
    return state_hash(
        tai_ns=request.tai_ns,
        bodies=request.bodies,
        sun=request.sun,
        cameras=[(i.camera, i.exposure_time_s, i.gain_dn_per_e) for i in images],
        seed=seed,
        lamps=request.lamps,
        moving=request.moving,
        draw=request.draw,
        thermal_from=request.thermal_from if isinstance(request, Render) else "",
    )


def scene_hash(scenario: Scenario) -> str:
    """Hash of everything that a scenario holds except its seed: 32 hexadecimal digits.

    The seed is a separate field of each reply; the folder of the file does not matter.
    """
    return content_digest(replace(scenario, seed=0, source=None), size=16)


def plane_hash(plane: memoryview) -> str:
    """Hash of the content of a plane: BLAKE2b with 16 bytes, in hexadecimal digits.

    plane : bytes as they travel, little-endian and row by row
    """
    return hashlib.blake2b(plane, digest_size=16).hexdigest()
