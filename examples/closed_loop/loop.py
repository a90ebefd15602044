"""The loop that ties camera, vision, filter, guidance and truth together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from examples.closed_loop import spacecraft
from examples.closed_loop.guidance import Glideslope
from examples.closed_loop.navigation import Estimate, after_push, predict, sighting, update
from examples.closed_loop.spacecraft import Orbit, relative_state
from examples.closed_loop.vision import (
    SPACE_RIDER_WING,
    Image,
    Pinhole,
    Silhouette,
    find_target,
    locate,
)
from simgl import Scenario
from simgl.physics.frames import Pose
from simgl.scene.mounts import BodyMount, at_rest
from simgl.scene.trajectory import LvlhAttitude, poses

Array = NDArray[np.float64]
TakeImage = Callable[[int, dict[str, Pose]], Image]  # TAI [ns] and poses to DN

WING_TIPS = ("wing_tip_left", "wing_tip_right")  # keypoints of the target, as the camera sees them
BORESIGHT_BODY = np.array([1.0, 0.0, 0.0])

# What the chaser knows at the start: range and direction from the ground, 1 sigma.
FIRST_RANGE_ERROR = 0.1  # of the range: 20 m at 200 m
FIRST_ANGLE_ERROR = np.radians(1.0)
FIRST_SPEED_ERROR = 0.02  # [m s-1]
# Against the truth a tip is found to 0.1 to 0.2 px, but the error is that of shadows and highlights
# on the wing and lasts for many frames: a sighting is worth less than its scatter says.
TIP_ERROR_PX = 0.3
# The drawing: the faces of the panels stand some centimetres in front of the plane of the tips [m].
DRAWING_ERROR = 0.03


@dataclass(frozen=True, kw_only=True)
class Settings:
    """One run.

    step : time between frames [s]; the hops of the plan take whole steps
    pictures : how many frames are kept for the report
    """

    frames: int = 300
    step: float = 3.0
    seed: int = 1
    pictures: int = 8
    plan: Glideslope = field(default_factory=Glideslope)


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """What one frame brought; states are chaser from target in LVLH, m and m s-1.

    time : since the first frame [s]
    true, estimated : (6,)
    position_sigma : (3,) [m]
    measured_range : [m]; None without a measurement
    accepted : the measurement passed the filter's gate
    delta_v : spent so far [m s-1]
    """

    time: float
    true: Array
    estimated: Array
    position_sigma: Array
    range_sigma: float
    measured_range: float | None
    accepted: bool
    delta_v: float

    @property
    def true_range(self) -> float:
        """[m]"""
        return float(np.linalg.norm(self.true[:3]))

    @property
    def estimated_range(self) -> float:
        """[m]"""
        return float(np.linalg.norm(self.estimated[:3]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """One image kept for the report.

    centre : where the filter puts the target's origin (u, v) [px]
    """

    dn: Image
    silhouette: Silhouette | None
    centre: tuple[float, float]
    time: float
    estimated_range: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight:
    """A finished run."""

    settings: Settings
    frames: list[Frame]
    pictures: list[Picture]

    @property
    def miss(self) -> Array:
        """(frame,) true distance from the hold point [m]."""
        hold = np.array([-self.settings.plan.hold, 0.0, 0.0])
        return np.asarray(np.linalg.norm([f.true[:3] - hold for f in self.frames], axis=1))

    @property
    def arrived(self) -> bool:
        """Whether the chaser stayed within 1 m of the hold point for its last 10 frames."""
        return bool(np.all(self.miss[-10:] < 1.0))


def fly(
    scenario: Scenario,
    camera: Pinhole,
    take_image: TakeImage,
    settings: Settings,
    on_frame: Callable[[Frame], None] = lambda _: None,
) -> Flight:
    """Fly the approach of a scenario with ``target``, ``chaser`` and a camera ``navcam`` on it."""
    rng = np.random.default_rng(settings.seed)
    start = poses(scenario.motions, scenario.epoch_tai_ns)
    target = Orbit(position=start["target"].position, velocity=start["target"].velocity)
    chaser = Orbit(position=start["chaser"].position, velocity=start["chaser"].velocity)
    attitude, mount = scenario.motions["target"].attitude, scenario.mounts["navcam"]
    assert isinstance(attitude, LvlhAttitude)
    assert isinstance(mount, BodyMount)
    R_camera_from_body = at_rest(mount)
    keypoints = scenario.models["target"].keypoints
    left, right = (attitude.R_lvlh_from_body @ keypoints[name] for name in WING_TIPS)
    span = float(np.linalg.norm(right - left))

    estimate = first_guess(relative_state(chaser, target), rng)
    spent = 0.0
    push_every = round(settings.plan.hop / settings.step)
    since_push: list[bool] = []
    frames: list[Frame] = []
    pictures: list[Picture] = []
    kept = set(np.linspace(0, settings.frames - 1, settings.pictures).round().astype(int).tolist())
    for index in range(settings.frames):
        # Point at where the filter believes the target to be, and take the image. The chaser's own
        # orbit and attitude come from GNSS and star tracker; only the relative state is unknown.
        R_lvlh_from_icrf = target.R_lvlh_from_icrf
        commanded = spacecraft.pointing_attitude(
            chaser, BORESIGHT_BODY, R_lvlh_from_icrf.T @ -estimate.mean[:3]
        )
        R_icrf_from_chaser = spacecraft.jittered(commanded, spacecraft.POINTING_ERROR, rng)
        R_icrf_from_target = R_lvlh_from_icrf.T @ attitude.R_lvlh_from_body
        time = index * settings.step
        dn = take_image(
            scenario.epoch_tai_ns + round(time * 1e9),
            {
                "chaser": spacecraft.pose(chaser, R_icrf_from_chaser),
                "target": spacecraft.pose(target, R_icrf_from_target),
            },
        )

        # See.
        known = spacecraft.jittered(R_icrf_from_chaser, spacecraft.ATTITUDE_KNOWLEDGE_ERROR, rng)
        R_lvlh_from_body = R_lvlh_from_icrf @ known
        R_lvlh_from_camera = R_lvlh_from_body @ R_camera_from_body.T
        camera_from_chaser = R_lvlh_from_body @ mount.position_body
        silhouette = find_target(dn, camera, SPACE_RIDER_WING)
        seen = None
        if silhouette is not None:
            seen = locate(silhouette, camera, R_lvlh_from_camera, (left, right))

        # Know.
        accepted, measured_range = False, None
        if seen is not None:
            sighted = sighting(
                seen - camera_from_chaser,
                tip_error=TIP_ERROR_PX / camera.focal_length,
                span=span,
                drawing_error=DRAWING_ERROR,
            )
            measured_range = sighted.range
            estimate, accepted = update(estimate, sighted)

        frame = Frame(
            time=time,
            true=relative_state(chaser, target),
            estimated=estimate.mean,
            position_sigma=estimate.position_sigma,
            range_sigma=estimate.range_sigma,
            measured_range=measured_range,
            accepted=accepted,
            delta_v=spent,
        )
        frames.append(frame)
        on_frame(frame)
        if index in kept:
            origin = R_lvlh_from_camera.T @ -(estimate.mean[:3] + camera_from_chaser)
            pictures.append(
                Picture(
                    dn=dn,
                    silhouette=silhouette,
                    centre=camera.project(origin),
                    time=time,
                    estimated_range=estimate.range,
                )
            )

        # Act, but never on what is only remembered.
        since_push.append(accepted)
        if index and index % push_every == 0 and any(since_push):
            since_push.clear()
            delta_v = settings.plan.push(estimate.mean, target.mean_motion)
            spent += float(np.linalg.norm(delta_v))
            chaser = spacecraft.pushed(chaser, R_lvlh_from_icrf.T @ delta_v, rng)
            estimate = after_push(estimate, delta_v)

        # And time goes on.
        disturbance = spacecraft.DISTURBANCE * rng.standard_normal(3)
        estimate = predict(estimate, target.mean_motion, settings.step)
        chaser, target = (
            chaser.advanced(settings.step, disturbance),
            target.advanced(settings.step),
        )
    return Flight(settings=settings, frames=frames, pictures=pictures)


def first_guess(true: Array, rng: np.random.Generator) -> Estimate:
    """What the ground tells the chaser: the true relative state, with errors of the stated size."""
    distance = float(np.linalg.norm(true[:3]))
    sideways = FIRST_ANGLE_ERROR * distance
    sigma = np.array([FIRST_RANGE_ERROR * distance, sideways, sideways, *[FIRST_SPEED_ERROR] * 3])
    return Estimate(mean=true + sigma * rng.standard_normal(6), covariance=np.diag(sigma**2))
