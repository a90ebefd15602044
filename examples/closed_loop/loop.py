"""The closed loop of truth model, camera and flight software, in steps of one second."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation
from simgl_bridge import BodyPose, DelayLine, Image

from examples.closed_loop import spacecraft
from examples.closed_loop.attitude import Attitude, turned
from examples.closed_loop.camera import Pinhole
from examples.closed_loop.exposure import ExposureControl, Light
from examples.closed_loop.guidance import Phase, Plan
from examples.closed_loop.markers import Board
from examples.closed_loop.navigation import Estimate
from examples.closed_loop.pilot import Drawing, Look, Pilot
from examples.closed_loop.spacecraft import Orbit, relative_state, wandering
from simgl import Scenario
from simgl.arrays import Array, Image16
from simgl.motion.mounts import BodyMount, at_rest
from simgl.motion.trajectory import LvlhAttitude, poses
from simgl.physics.frames import (
    Pose,
    lvlh_angular_velocity,
    quaternion_from_matrix,
)

CAMERA, LAMP = "navcam", "flood"
WING_TIPS = ("wing_tip_left", "wing_tip_right")  # keypoints of the target, as the camera sees them
SMEAR_PX = 0.1  # a target that moves farther during an exposure is drawn moving
BOARD_REACH = 0.45  # [m] from its middle to its outer discs
STEP = 1.0  # [s] of the truth's orbits and of flight software

# What the chaser knows at the start: range and direction from the ground, 1 sigma.
FIRST_RANGE_ERROR = 0.06  # of the range
FIRST_ANGLE_ERROR = np.radians(1.0)
FIRST_SPEED_ERROR = 0.02  # [m s-1]


class TakeImage(Protocol):
    """An image of a state: the bridge's, or one made in this process."""

    def __call__(
        self, tai_ns: int, bodies: Mapping[str, BodyPose], light: Light, moving: bool
    ) -> Image:
        """The image with mid-exposure at an epoch; ``moving`` bodies smear."""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """One run.

    seed : of where it starts and of all random errors of the craft
    duration : at most [s]; it ends sooner, ``settle`` seconds after arrival
    image_period : time between images [s], a whole number of steps
    images : at most; None for no limit
    report_images : how many images are kept for the report
    offset : (3,) where the chaser starts besides the scenario's place, in LVLH [m]
    spread : (6,) how far from there it really starts, 1 sigma [m], [m s-1]
    delay : whether images take the time that the camera says; without, they are there at once
    """

    seed: int = 1
    duration: float = 1100.0
    settle: float = 48.0
    image_period: float = 4.0
    images: int | None = None
    report_images: int = 48
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spread: tuple[float, ...] = (6.0, 1.5, 1.5, 0.02, 0.02, 0.02)
    delay: bool = True
    plan: Plan = field(default_factory=Plan)
    control: ExposureControl = field(default_factory=ExposureControl)


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """What one image brought, when it had arrived; states in LVLH, SI.

    time : of mid-exposure
    true, estimated : (9,) position, velocity, the target's turn; both at mid-exposure
    covariance : (9, 9)
    distance : true, of the camera from the board [m]
    sunlit : share of the Sun's light at the target
    spent : velocity change so far [m s-1]
    pointing : angle between the camera's axis and the board [rad]
    render_time, round_trip, processing : wall time of the server, the bridge with it, and the
        pilot [s]
    """

    time: float
    look: Look
    phase: Phase
    true: Array
    estimated: Array
    covariance: Array
    distance: float
    sunlit: float
    spent: float
    pointing: float
    render_time: float
    round_trip: float
    processing: float

    @property
    def error(self) -> Array:
        """(9,) estimate minus truth."""
        return self.estimated - self.true

    @property
    def sigma(self) -> Array:
        """(9,)"""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, kw_only=True, eq=False)
class ReportImage:
    """An image kept for the report."""

    dn: Image16
    frame: Frame


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight:
    """A finished run.

    final : (3,) of the camera in the board's axes, x along its normal [m]
    misalignment : between the camera's axis and the board's at the end [rad]
    """

    settings: Settings
    frames: list[Frame]
    report_images: list[ReportImage]
    arrived: bool
    final: Array
    misalignment: float


@dataclass(frozen=True, kw_only=True, eq=False)
class _World:
    """The truth at one instant."""

    chaser: Orbit
    target: Orbit
    attitude: Attitude
    turn: Array


def fly(
    scenario: Scenario,
    camera: Pinhole,
    take_image: TakeImage,
    settings: Settings,
    on_frame: Callable[[Frame], None] = lambda _: None,
) -> Flight:
    """Fly a scenario with ``target``, ``board``, ``chaser``, a ``navcam`` and a lamp on it."""
    rng = np.random.default_rng(settings.seed)
    drawing = _drawing(scenario)
    start_turn = spacecraft.TARGET_ATTITUDE_ERROR * rng.standard_normal(3)
    world = _start(scenario, settings, start_turn, rng)
    pilot = Pilot(
        camera,
        drawing,
        _first_guess(relative_state(world.chaser, world.target), rng),
        world.target.mean_motion,
        settings.plan,
        settings.control,
    )
    line = DelayLine()
    taken: dict[int, tuple[_World, float, float]] = {}
    frames: list[Frame] = []
    candidates: list[ReportImage] = []
    spent, seconds, arrived_at = 0.0, 0, None
    limit = settings.images or 10**9
    count = 0
    while seconds <= settings.duration and (count < limit or len(line)):
        now = float(seconds)
        tai_ns = scenario.epoch_tai_ns + seconds * 10**9
        R_lvlh_from_icrf = world.target.R_lvlh_from_icrf
        if seconds % round(settings.image_period) == 0 and count < limit:
            count += 1
            known = world.attitude.known(rng).R_icrf_from_body
            light = pilot.shutter(now, R_lvlh_from_icrf @ known)
            began = clock.perf_counter()
            moving = _smear(world, drawing, camera, light.exposure) > SMEAR_PX
            image = take_image(tai_ns, _bodies(world, drawing), light, moving)
            taken[image.tai_ns] = (world, clock.perf_counter() - began, spent)
            line.post(image if settings.delay else replace(image, available_tai_ns=tai_ns))
        for image in line.due(tai_ns):
            frame = _look(scenario, drawing, pilot, image, taken.pop(image.tai_ns), now)
            frames.append(frame)
            on_frame(frame)
            _collect(candidates, ReportImage(dn=image.dn, frame=frame), settings.report_images)
        if pilot.phase is Phase.HOLD and arrived_at is None:
            arrived_at = now
        if arrived_at is not None and now >= arrived_at + settings.settle:
            break

        R_lvlh_from_body = R_lvlh_from_icrf @ world.attitude.R_icrf_from_body
        delta_v = pilot.push(now, R_lvlh_from_body)
        spent += float(np.linalg.norm(delta_v))
        world = _pushed(world, delta_v, rng)
        seconds += round(STEP)
        aim = pilot.attitude(now, R_lvlh_from_body)
        world = _advanced(world, drawing, aim, start_turn, float(seconds), rng)
    final, misalignment = _before_the_board(world, drawing)
    return Flight(
        settings=settings,
        frames=frames,
        report_images=_spread(candidates, settings.report_images),
        arrived=arrived_at is not None,
        final=final,
        misalignment=misalignment,
    )


def _pushed(world: _World, delta_v: Array, rng: np.random.Generator) -> _World:
    """The truth after a push of the thrusters, (3,) LVLH [m s-1]."""
    size = float(np.linalg.norm(delta_v))
    if size == 0.0:
        return world
    R_icrf_from_lvlh = world.target.R_lvlh_from_icrf.T
    return replace(
        world,
        chaser=spacecraft.pushed(world.chaser, R_icrf_from_lvlh @ delta_v, rng),
        attitude=world.attitude.kicked(size, rng),
    )


def _before_the_board(world: _World, drawing: Drawing) -> tuple[Array, float]:
    """The camera in the board's axes (3,) [m], and the angle between their axes [rad]."""
    R_board_from_icrf, place = _board(world, drawing)
    camera_position = (
        world.chaser.position + world.attitude.R_icrf_from_body @ drawing.camera_position
    )
    axis = world.attitude.R_icrf_from_body @ drawing.R_camera_from_body[2]
    angle = float(np.arccos(np.clip(-(R_board_from_icrf @ axis)[0], -1.0, 1.0)))
    return R_board_from_icrf @ (camera_position - place), angle


def _drawing(scenario: Scenario) -> Drawing:
    target = scenario.motions["target"]
    mount = scenario.mounts[CAMERA]
    assert isinstance(target.attitude, LvlhAttitude)
    assert isinstance(mount, BodyMount)
    start = poses(scenario.motions, scenario.epoch_tai_ns)
    R_target_from_icrf = start["target"].R_icrf_from_body.T
    keypoints = scenario.models["target"].keypoints
    left, right = (keypoints[name] for name in WING_TIPS)
    return Drawing(
        R_lvlh_from_target=target.attitude.R_lvlh_from_body,
        tips=(left, right),
        board=Board.from_keypoints(dict(scenario.models["board"].keypoints)),
        board_position=R_target_from_icrf @ (start["board"].position - start["target"].position),
        R_target_from_board=R_target_from_icrf @ start["board"].R_icrf_from_body,
        camera_position=mount.position_body,
        R_camera_from_body=at_rest(mount),
    )


def _start(scenario: Scenario, settings: Settings, turn: Array, rng: np.random.Generator) -> _World:
    start = poses(scenario.motions, scenario.epoch_tai_ns)
    target = Orbit(position=start["target"].position, velocity=start["target"].velocity)
    planned = Orbit(position=start["chaser"].position, velocity=start["chaser"].velocity)
    state = relative_state(planned, target) + np.array(settings.spread) * rng.standard_normal(6)
    state[:3] += settings.offset
    R_icrf_from_lvlh = target.R_lvlh_from_icrf.T
    offset = R_icrf_from_lvlh @ state[:3]
    turning = lvlh_angular_velocity(target.position, target.velocity)
    return _World(
        chaser=Orbit(
            position=target.position + offset,
            velocity=target.velocity + R_icrf_from_lvlh @ state[3:] + np.cross(turning, offset),
        ),
        target=target,
        attitude=Attitude(
            R_icrf_from_body=start["chaser"].R_icrf_from_body,
            rate=start["chaser"].R_icrf_from_body.T @ turning,
            wheels=np.zeros(3),
        ),
        turn=wandering(turn, 0.0),
    )


def _first_guess(true: Array, rng: np.random.Generator) -> Estimate:
    """What the ground tells the chaser: the true relative state, with errors of the stated size."""
    distance = float(np.linalg.norm(true[:3]))
    sideways = FIRST_ANGLE_ERROR * distance
    sigma = np.array([FIRST_RANGE_ERROR * distance, sideways, sideways, *[FIRST_SPEED_ERROR] * 3])
    turn = [1.2 * spacecraft.TARGET_ATTITUDE_ERROR] * 3
    return Estimate(
        mean=np.concatenate([true + sigma * rng.standard_normal(6), np.zeros(3)]),
        covariance=np.diag(np.concatenate([sigma, turn]) ** 2),
    )


def _advanced(
    world: _World,
    drawing: Drawing,
    direction_lvlh: Array,
    start_turn: Array,
    time: float,
    rng: np.random.Generator,
) -> _World:
    """The truth one step later, the chaser's camera turned towards a direction."""
    boresight = drawing.R_camera_from_body[2]
    wanted = spacecraft.pointing_attitude(
        world.chaser, boresight, world.target.R_lvlh_from_icrf.T @ direction_lvlh
    )
    turning = lvlh_angular_velocity(world.chaser.position, world.chaser.velocity)
    disturbance = spacecraft.DISTURBANCE * rng.standard_normal(3)
    return _World(
        chaser=world.chaser.advanced(STEP, disturbance),
        target=world.target.advanced(STEP),
        attitude=turned(world.attitude, wanted, wanted.T @ turning, STEP, rng),
        turn=wandering(start_turn, time),
    )


def _target_attitude(world: _World, drawing: Drawing) -> Array:
    """R_icrf_from_target (3, 3), as it really is."""
    turn = Rotation.from_rotvec(world.turn).as_matrix()
    return world.target.R_lvlh_from_icrf.T @ turn @ drawing.R_lvlh_from_target


def _board(world: _World, drawing: Drawing) -> tuple[Array, Array]:
    """R_board_from_icrf (3, 3) and the place (3,) of the board [m]."""
    R_icrf_from_target = _target_attitude(world, drawing)
    place = world.target.position + R_icrf_from_target @ drawing.board_position
    return (R_icrf_from_target @ drawing.R_target_from_board).T, place


def _bodies(world: _World, drawing: Drawing) -> dict[str, BodyPose]:
    """What the image server needs to know, rates included: exposures by lamplight are long."""
    R_icrf_from_target = _target_attitude(world, drawing)
    R_board_from_icrf, place = _board(world, drawing)
    turning = lvlh_angular_velocity(world.target.position, world.target.velocity)
    arm = place - world.target.position
    target = Pose(
        position=world.target.position,
        velocity=world.target.velocity,
        R_icrf_from_body=R_icrf_from_target,
    )
    board = Pose(
        position=place,
        velocity=world.target.velocity + np.cross(turning, arm),
        R_icrf_from_body=R_board_from_icrf.T,
    )
    chaser = Pose(
        position=world.chaser.position,
        velocity=world.chaser.velocity,
        R_icrf_from_body=world.attitude.R_icrf_from_body,
    )
    return {
        "target": _sent(target, R_icrf_from_target.T @ turning),
        "board": _sent(board, R_board_from_icrf @ turning),
        "chaser": _sent(chaser, world.attitude.rate),
    }


def _smear(world: _World, drawing: Drawing, camera: Pinhole, exposure: float) -> float:
    """How far the board moves across the image during an exposure [px]."""
    _, place = _board(world, drawing)
    turning = lvlh_angular_velocity(world.chaser.position, world.chaser.velocity)
    R_icrf_from_body = world.attitude.R_icrf_from_body
    slew = float(np.linalg.norm(world.attitude.rate - R_icrf_from_body.T @ turning))
    state = relative_state(world.chaser, world.target)
    offset = world.target.R_lvlh_from_icrf @ (place - world.chaser.position)
    distance = float(np.linalg.norm(offset))
    closing = float(state[3:] @ offset) / distance
    crossing = float(np.linalg.norm(state[3:] - closing * offset / distance))
    # What closes in grows: its edge moves outwards.
    growing = abs(closing) * BOARD_REACH / distance
    return (slew + (crossing + growing) / distance) * exposure * camera.focal_length


def _sent(pose: Pose, rate: Array) -> BodyPose:
    return BodyPose(
        position_m=pose.position,
        velocity_m_s=pose.velocity,
        q_icrf_from_body_xyzw=quaternion_from_matrix(pose.R_icrf_from_body),
        angular_velocity_rad_s=rate,
    )


def _look(
    scenario: Scenario,
    drawing: Drawing,
    pilot: Pilot,
    image: Image,
    taken: tuple[_World, float, float],
    now: float,
) -> Frame:
    """Hand an image to the pilot, and set what it made of it against the truth."""
    world, round_trip, spent = taken
    time = (image.tai_ns - scenario.epoch_tai_ns) / 1e9
    began = clock.perf_counter()
    look = pilot.see(image.dn, time, now)
    processing = clock.perf_counter() - began
    estimate = pilot.filter.at(time)
    _, place = _board(world, drawing)
    R_icrf_from_body = world.attitude.R_icrf_from_body
    offset = place - world.chaser.position - R_icrf_from_body @ drawing.camera_position
    distance = float(np.linalg.norm(offset))
    axis = R_icrf_from_body @ drawing.R_camera_from_body[2]
    state = scenario.at(image.tai_ns)
    return Frame(
        time=time,
        look=look,
        phase=pilot.phase,
        true=np.concatenate([relative_state(world.chaser, world.target), world.turn]),
        estimated=estimate.mean,
        covariance=estimate.covariance,
        distance=distance,
        sunlit=state.sunlit_share(world.target.position),
        spent=spent,
        pointing=float(np.arccos(np.clip(axis @ offset / distance, -1.0, 1.0))),
        render_time=image.render_time_s,
        round_trip=round_trip,
        processing=processing,
    )


def _collect(candidates: list[ReportImage], image: ReportImage, wanted: int) -> None:
    """Append an image; if there are too many, drop every other one."""
    candidates.append(image)
    if len(candidates) > 4 * wanted:
        del candidates[1::2]


def _spread(candidates: list[ReportImage], wanted: int) -> list[ReportImage]:
    """So many of the images, evenly over the logarithm of the distance, the last included."""
    if len(candidates) <= wanted:
        return candidates
    far, near = np.log(candidates[0].frame.distance), np.log(candidates[-1].frame.distance)
    way = [np.log(p.frame.distance) for p in candidates]
    chosen = {int(np.argmin(np.abs(np.array(way) - x))) for x in np.linspace(far, near, wanted)}
    return [candidates[i] for i in sorted(chosen | {len(candidates) - 1})]
