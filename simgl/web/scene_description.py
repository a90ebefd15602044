"""What the 3-D view shows of a scene, as plain data: numbers that JSON holds, in ICRF axes and SI.

Positions are Earth-centred and float64 as everywhere; the page subtracts the point that its eye
circles before it rounds them.
"""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import numpy as np

from simgl.arrays import Array, Image8, UIntArray
from simgl.display_images import srgb_from_linear
from simgl.motion.joints import body_from_stored
from simgl.motion.orbits import keplerian_orbit
from simgl.physics.constants import EARTH_MU
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import Pose, cross, rotation_about, unit
from simgl.scenario.scenario import Scenario
from simgl.scene.posed_mesh import groups_of_parts, rigid_groups
from simgl.scene.sights import reach, sights
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import CameraState, SceneState

# Points of an orbit that is drawn, and of an edge of a camera's field.
_ORBIT_POINTS = 181
_EDGE_POINTS = 5
# Where no orbit says how long a scene goes on, the slider has this length [s].
_DEFAULT_SPAN = 5400.0

Description = dict[str, Any]


def scenario_description(scenario: Scenario) -> Description:
    """What stays while a scenario is shown: names, sizes, and how far the time slider reaches."""
    state = scenario.at(scenario.epoch_tai_ns)
    return {
        "name": scenario.name,
        "epoch_utc": utc_from_tai_ns(scenario.epoch_tai_ns),
        "span_s": span(state),
        "spacecraft": {
            name: {"radius_m": reach(model), "triangles": len(model.mesh.triangles)}
            for name, model in scenario.models.items()
        },
        "cameras": {
            name: {
                "width_px": camera.detector.width,
                "height_px": camera.detector.height,
                "exposure_time_s": camera.exposure_time,
            }
            for name, camera in scenario.cameras.items()
        },
        "earth_radii_m": None if scenario.earth is None else list(scenario.earth.radii),
    }


def span(state: SceneState) -> float:
    """Length of the time slider [s]: one revolution of the first spacecraft that orbits."""
    for body in state.bodies.values():
        if (period := _period(state, body.pose)) is not None:
            return period
    return _DEFAULT_SPAN


def scene_description(state: SceneState) -> Description:
    """Where everything is at an instant."""
    return {
        "epoch_utc": utc_from_tai_ns(state.tai_ns),
        "spacecraft": {
            name: {
                "position_m": body.pose.position.tolist(),
                "R_icrf_from_body": body.pose.R_icrf_from_body.tolist(),
                "joints": _joint_transforms(body.model),
                "sunlit_share": state.sunlit_share(body.pose.position),
                "sun_direction": state.sun.seen_from(body.pose.position).direction_icrf.tolist(),
            }
            for name, body in state.bodies.items()
        },
        "cameras": {name: _camera(state, placed) for name, placed in state.cameras.items()},
        "earth": _earth(state),
        "orbits": {
            name: orbit
            for name, body in state.bodies.items()
            if (orbit := orbit_points(state, body.pose)) is not None
        },
    }


def _camera(state: SceneState, placed: CameraState) -> Description:
    """A camera: its place, the directions of its image's edge, and how it sees the spacecraft."""
    R_icrf_from_camera = placed.R_camera_from_icrf.T
    edge = field_edge(placed)
    return {
        "position_m": placed.position.tolist(),
        "boresight": R_icrf_from_camera[:, 2].tolist(),
        "up": (-R_icrf_from_camera[:, 1]).tolist(),
        "field_edge": (edge @ placed.R_camera_from_icrf).tolist(),
        "sees": {
            name: {"range_m": distance, "phase_angle_deg": math.degrees(phase)}
            for name, distance, phase in sights(state, placed)
        },
    }


def field_edge(placed: CameraState) -> Array:
    """(n, 3) unit directions around the edge of a camera's image, camera axes.

    From the top left corner clockwise. Where the lens sees nothing in a corner, that is left out.
    """
    detector = placed.camera.detector
    steps = np.linspace(0.0, 1.0, _EDGE_POINTS)[:-1]
    zeros, ones = np.zeros_like(steps), np.ones_like(steps)
    x = np.concatenate([steps, ones, 1.0 - steps, zeros]) * detector.width
    y = np.concatenate([zeros, steps, ones, 1.0 - steps]) * detector.height
    rays = placed.camera.rays(np.stack([x, y], axis=-1))
    rays = rays[~np.isnan(rays).any(axis=-1)]
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def orbit_points(state: SceneState, pose: Pose) -> list[list[float]] | None:
    """One revolution of the osculating two-body orbit [m]; None where there is none."""
    if state.earth is None:
        return None
    try:
        orbit = keplerian_orbit(pose.position, pose.velocity, state.tai_ns)
    except ValueError:
        return None
    pole = unit(cross(pose.position, pose.velocity))
    to_perigee = rotation_about(pole, -orbit.true_anomaly) @ unit(pose.position)
    # Equal steps of the eccentric anomaly from where the spacecraft is; its tangent half angle
    # formula: Vallado, 4th ed., eq. 2-13.
    a, e = orbit.semi_major_axis, orbit.eccentricity
    start = 2.0 * math.atan(math.tan(0.5 * orbit.true_anomaly) * math.sqrt((1.0 - e) / (1.0 + e)))
    anomaly = start + np.linspace(0.0, 2.0 * math.pi, _ORBIT_POINTS)[:, None]
    across = a * math.sqrt(1.0 - e * e) * cross(pole, to_perigee)
    points = a * (np.cos(anomaly) - e) * to_perigee + np.sin(anomaly) * across
    return points.tolist()


def _period(state: SceneState, pose: Pose) -> float | None:
    """Of the osculating orbit [s]; None without an Earth or a closed orbit outside it."""
    if state.earth is None:
        return None
    try:
        axis = keplerian_orbit(pose.position, pose.velocity, state.tai_ns).semi_major_axis
    except ValueError:
        return None
    return 2.0 * math.pi * math.sqrt(axis**3 / EARTH_MU)


def _earth(state: SceneState) -> Description | None:
    if state.earth is None:
        return None
    sun = state.sun.seen_from(state.earth.position)
    return {
        "position_m": state.earth.position.tolist(),
        "radii_m": list(state.earth.radii),
        "R_icrf_from_itrf": state.earth.R_itrf_from_icrf.T.tolist(),
        "sun_direction": sun.direction_icrf.tolist(),
    }


def _joint_transforms(model: SpacecraftModel) -> list[list[list[float]]]:
    """(4, 4) transforms of the rigid groups, in the order of ``model_bytes``; none if unmoved."""
    if not model.angles:
        return []
    motion = body_from_stored(model.joints, model.angles)
    return [motion[group.index].tolist() for group in rigid_groups(model.mesh, model.joints)]


def model_bytes(model: SpacecraftModel) -> bytes:
    """A model's shape for the page: sizes as JSON, then little-endian arrays.

    A uint32 has the length of the JSON, padded to four bytes, with ``vertices``, ``triangles`` and
    the ``groups``: how many triangles each rigid group has. Then float32 positions (n, 3) [m] and
    normals (n, 3) in body axes, uint8 reflectance R, G, B and 255 (n, 4) in sRGB code, and uint32
    vertices (m, 3) of the triangles, sorted by group.
    """
    mesh = model.mesh
    counts, triangles = _by_group(model)
    header = {"vertices": len(mesh.positions), "triangles": len(triangles), "groups": counts}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    arrays = (
        mesh.positions.astype("<f4"),
        mesh.normals.astype("<f4"),
        _colours(model),
        triangles.astype("<u4"),
    )
    content = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
    return struct.pack("<I", len(text)) + text + content


def _by_group(model: SpacecraftModel) -> tuple[list[int], UIntArray]:
    mesh = model.mesh
    if not model.joints:
        return [len(mesh.triangles)], mesh.triangles
    of_triangle = groups_of_parts(mesh, model.joints)[mesh.part][mesh.triangles[:, 0]]
    order = np.argsort(of_triangle, kind="stable")
    groups = rigid_groups(mesh, model.joints)
    return [len(group.triangles) for group in groups], mesh.triangles[order]


def _colours(model: SpacecraftModel) -> Image8:
    """(n, 4) uint8 sRGB code of the vertices' reflectance without images."""
    of_material = np.array([m.reflectance[:3] for m in model.materials], dtype=np.float32)
    linear = of_material[model.mesh.material]
    if model.mesh.colour is not None:
        linear = linear * model.mesh.colour[:, :3]
    code = srgb_from_linear(linear)
    return np.concatenate([code, np.full((len(code), 1), 255, np.uint8)], axis=1)
