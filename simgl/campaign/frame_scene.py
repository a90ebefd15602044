"""The scene of one frame of a campaign: the scenario with the frame's random values."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.campaign.campaign_file import Campaign
from simgl.campaign.random_draws import Distribution, Draw, direction, rotation
from simgl.errors import ConfigError
from simgl.motion.mounts import BodyMount, OrbitingMount, at_joints, at_rest, camera_pose
from simgl.physics.frames import Pose, camera_from_directions, rotation_between, unit
from simgl.scenario.scenario import joint_motions
from simgl.scene.state import CameraState, SceneState

# Impossible frames, such as one with the camera inside the target, are drawn again.
MAX_ATTEMPTS = 1000
_RATES = ("target_rate_deg_s", "camera_rate_deg_s", "relative_speed_m_s")


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameScene:
    """The scene of one frame.

    during : the scene at epochs [TAI ns] while the shutter is open; None where nothing moves
    seed : of the frame's noise
    """

    frame: int
    state: SceneState
    during: Callable[[int], SceneState] | None
    seed: int


def frame_scene(campaign: Campaign, frame: int) -> FrameScene:
    """The scene of a frame, always the same for a campaign and a number.

    Raises ConfigError where no attempt gives a possible scene.
    """
    for attempt in range(MAX_ATTEMPTS):
        draw = Draw(campaign.seed, frame, attempt)
        values = _values(campaign, draw)
        if values is None:
            continue
        state = _state(campaign, draw, values)
        camera = state.cameras[campaign.camera]
        if not any(body.encloses(camera.position) for body in state.bodies.values()):
            during = _during(campaign, draw, values, state)
            return FrameScene(frame=frame, state=state, during=during, seed=draw.word("noise"))
    problem = f"gives no possible scene for frame {frame} in {MAX_ATTEMPTS} attempts"
    raise ConfigError(str(campaign.source), "draw", problem)


@dataclass(frozen=True)
class _Values:
    plain: Mapping[str, float]
    joints: Mapping[str, float]
    lamps: Mapping[str, float]


def _values(campaign: Campaign, draw: Draw) -> _Values | None:
    """The random values; None where one of them lies outside its limits."""

    def drawn(prefix: str, table: Mapping[str, Distribution]) -> dict[str, float]:
        return {name: given.at(draw, prefix + name) for name, given in table.items()}

    tables = {"": campaign.drawn, "joint ": campaign.joints, "lamp ": campaign.lamps}
    drawn_values = [drawn(prefix, table) for prefix, table in tables.items()]
    for values, table in zip(drawn_values, tables.values(), strict=True):
        if any(not table[n].low <= value <= table[n].high for n, value in values.items()):
            return None
    return _Values(*drawn_values)


def _during(
    campaign: Campaign, draw: Draw, values: _Values, state: SceneState
) -> Callable[[int], SceneState] | None:
    """The scene of a frame while its shutter is open; None where no rate is drawn."""
    if not any(values.plain.get(name) for name in _RATES):
        return None
    return lambda tai_ns: _state(campaign, draw, values, 1e-9 * (tai_ns - state.tai_ns))


def _state(campaign: Campaign, draw: Draw, values: _Values, after: float = 0.0) -> SceneState:
    """The scene some time [s] after mid-exposure; Sun, sky and joints as at mid-exposure."""
    scenario, drawn = campaign.scenario, values.plain
    tai_ns = scenario.epoch_tai_ns + round(1e9 * drawn.get("epoch_offset_s", 0.0))
    poses = scenario.poses(tai_ns)
    poses[campaign.target] = _turned(campaign, draw, drawn, poses[campaign.target])
    slides = {joint.name: joint.slides for joint in scenario.models[campaign.target].joints}
    angles = {n: v if slides[n] else math.radians(v) for n, v in values.joints.items()}
    before = scenario.with_poses(tai_ns, poses)
    placed = _placed(campaign, draw, drawn, before)
    mount = at_joints(scenario.mounts[campaign.camera], joint_motions(before.bodies))
    if isinstance(mount, BodyMount) and placed is not before.cameras[campaign.camera]:
        poses[mount.spacecraft] = _carrier(mount, placed, poses[mount.spacecraft])
    if after:
        placed, poses = _coasted(campaign, draw, drawn, placed, poses, after)
    state = scenario.with_poses(tai_ns, poses, joint_angles={campaign.target: angles})
    placed = replace(placed, camera=_camera(placed.camera, drawn))
    lamps = tuple(
        replace(lamp, lamp=replace(lamp.lamp, power=lamp.lamp.power * values.lamps.get(name, 1.0)))
        for name, lamp in zip(scenario.lamps, state.lamps, strict=True)
    )
    return replace(state, cameras={**state.cameras, campaign.camera: placed}, lamps=lamps)


def _turn_rate(draw: Draw, drawn: Mapping[str, float], name: str) -> Array:
    """(3,) in the axes of the rotating body [rad s-1]."""
    return math.radians(drawn.get(name, 0.0)) * direction(draw, f"{name} axis")


def _coasted(
    campaign: Campaign,
    draw: Draw,
    drawn: Mapping[str, float],
    camera: CameraState,
    poses: Mapping[str, Pose],
    after: float,
) -> tuple[CameraState, dict[str, Pose]]:
    """The camera and all spacecraft, moved for some time [s]."""
    target = poses[campaign.target]
    moved = {n: replace(p, position=p.position + after * p.velocity) for n, p in poses.items()}
    turn = Rotation.from_rotvec(after * _turn_rate(draw, drawn, "target_rate_deg_s")).as_matrix()
    R_icrf_from_body = target.R_icrf_from_body @ turn
    moved[campaign.target] = replace(moved[campaign.target], R_icrf_from_body=R_icrf_from_body)
    past = drawn.get("relative_speed_m_s", 0.0) * direction(draw, "relative_speed_m_s direction")
    turn = Rotation.from_rotvec(-after * _turn_rate(draw, drawn, "camera_rate_deg_s")).as_matrix()
    moved_camera = replace(
        camera,
        position=camera.position + after * (target.velocity + past),
        R_camera_from_icrf=turn @ camera.R_camera_from_icrf,
    )
    mount = campaign.scenario.mounts[campaign.camera]
    if isinstance(mount, BodyMount):
        # The spacecraft that carries the camera is rigid with it.
        carrier = poses[mount.spacecraft]
        R_then_from_now = moved_camera.R_camera_from_icrf.T @ camera.R_camera_from_icrf
        moved[mount.spacecraft] = replace(
            carrier,
            position=moved_camera.position + R_then_from_now @ (carrier.position - camera.position),
            R_icrf_from_body=R_then_from_now @ carrier.R_icrf_from_body,
        )
    return moved_camera, moved


def _camera(camera: Camera, drawn: Mapping[str, float]) -> Camera:
    return replace(
        camera,
        exposure_time=drawn.get("exposure_time_s", camera.exposure_time),
        lens=replace(camera.lens, f_number=drawn.get("f_number", camera.lens.f_number)),
    )


def _turned(campaign: Campaign, draw: Draw, drawn: Mapping[str, float], pose: Pose) -> Pose:
    """The target's pose with its drawn attitude."""
    if campaign.any_attitude:
        return replace(pose, R_icrf_from_body=rotation(draw, "attitude"))
    if "attitude_error_deg" not in drawn:
        return pose
    angle = math.radians(drawn["attitude_error_deg"])
    error = Rotation.from_rotvec(angle * direction(draw, "attitude axis")).as_matrix()
    return replace(pose, R_icrf_from_body=pose.R_icrf_from_body @ error)


def _placed(
    campaign: Campaign, draw: Draw, drawn: Mapping[str, float], state: SceneState
) -> CameraState:
    """The camera at its random place and pointing; unchanged where neither is drawn."""
    camera = state.cameras[campaign.camera]
    moving = {"range_m", "azimuth_deg", "phase_angle_deg", "roll_deg", "offset_x", "offset_y"}
    if not campaign.sphere and not moving & drawn.keys():
        return camera
    target = state.bodies[campaign.target].pose
    line = camera.position - target.position
    position = target.position + drawn.get("range_m", float(np.linalg.norm(line))) * _outward(
        campaign, draw, drawn, state, line
    )
    up = -camera.R_camera_from_icrf[1]
    R = camera_from_directions(target.position - position, up)
    roll = math.radians(drawn.get("roll_deg", 0.0))
    R = Rotation.from_rotvec([0.0, 0.0, roll]).as_matrix() @ R
    d, f = camera.camera.detector, camera.camera.focal_length_px
    seen = np.array(
        [
            0.5 * d.width * drawn.get("offset_x", 0.0) / f,
            0.5 * d.height * drawn.get("offset_y", 0.0) / f,
            1.0,
        ]
    )
    R = rotation_between([0.0, 0.0, 1.0], seen) @ R
    return replace(camera, position=position, R_camera_from_icrf=R)


def _outward(
    campaign: Campaign,
    draw: Draw,
    drawn: Mapping[str, float],
    state: SceneState,
    line: Array,
) -> Array:
    """(3,) unit, from the target to the camera."""
    target = state.bodies[campaign.target].pose
    if campaign.sphere:
        return direction(draw, "direction")
    if "phase_angle_deg" in drawn:
        sun = state.sun.seen_from(target.position).direction_icrf
        phase, turn = math.radians(drawn["phase_angle_deg"]), draw.uniforms("clock angle", 1)[0]
        across, upward, _ = camera_from_directions(sun, state.cameras[campaign.camera].position)
        around = math.cos(2.0 * math.pi * turn) * across + math.sin(2.0 * math.pi * turn) * upward
        return math.cos(phase) * sun + math.sin(phase) * around
    if "azimuth_deg" in drawn:
        mount = OrbitingMount(
            target=campaign.target,
            azimuth=math.radians(drawn["azimuth_deg"]),
            elevation=math.radians(drawn.get("elevation_deg", 0.0)),
            range=1e6,
        )
        position, _ = camera_pose(campaign.camera, mount, {campaign.target: target})
        return unit(position - target.position)
    return unit(line)


def _carrier(mount: BodyMount, camera: CameraState, pose: Pose) -> Pose:
    """The pose of the spacecraft that holds a camera at its place."""
    R_icrf_from_body = camera.R_camera_from_icrf.T @ at_rest(mount)
    position = camera.position - R_icrf_from_body @ mount.position_body
    return replace(pose, position=position, R_icrf_from_body=R_icrf_from_body)
