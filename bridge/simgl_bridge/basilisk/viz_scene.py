"""From Basilisk's state to a scene and a camera of simgl.

Positions are relative to the planet that looks largest; attitudes are modified Rodrigues parameters
sigma (Schaub and Junkins, Analytical Mechanics of Space Systems, 4th ed., eq. 3.150).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.presets import read_camera
from simgl.errors import ConfigError, SimglError
from simgl.physics.ephemeris import sun_position, tai_ns_from_utc
from simgl.physics.frames import Pose
from simgl.physics.lunar_model import moon_from_icrf
from simgl.scenario.loader import scenario_from_dict
from simgl.scenario.scenario import EphemerisSun, Scenario
from simgl.scene.state import CameraState, SceneState
from simgl_bridge.basilisk.camera_overrides import CameraOverrides, auto_exposed
from simgl_bridge.basilisk.planets import (
    NoImageError,
    central_body,
    globe_of,
    plain_name,
    rotation_of,
    vector_of,
)
from simgl_bridge.basilisk.viz_messages import (
    CameraConfig,
    CelestialBody,
    Epoch,
    SpacecraftState,
    Update,
)

Warn = Callable[[str], None]

# Of each side of an image.
MAX_PIXELS = 8192


def bare_scenario() -> Scenario:
    """The scenario used without a file: Earth, Sun and stars, no spacecraft model."""
    return scenario_from_dict({"epoch": {"utc": "2000-01-01T12:00:00"}}, name="basilisk")


def check_base(scenario: Scenario) -> None:
    """Raises ConfigError for a scenario that contradicts what Basilisk sends."""
    where = str(scenario.source or scenario.name)
    if not isinstance(scenario.sun, EphemerisSun):
        problem = "fixes the Sun by hand, and Basilisk sends its place"
        raise ConfigError(f"{where} [sun]", "direction_icrf", problem)
    if scenario.earth is None:
        raise ConfigError(f"{where} [earth]", "shape", 'is "none", and Basilisk sends an Earth')


def matrix_from_mrp(sigma: ArrayLike) -> Array:
    """R_b_from_a (3, 3) of the modified Rodrigues parameters sigma_ba, or of their shadow set."""
    s = np.asarray(sigma, dtype=np.float64)
    square = float(s @ s)
    tilde = np.array([[0.0, -s[2], s[1]], [s[2], 0.0, -s[0]], [-s[1], s[0], 0.0]])
    R_b_from_a = (
        np.eye(3) + (8.0 * tilde @ tilde - 4.0 * (1.0 - square) * tilde) / (1.0 + square) ** 2
    )
    return np.asarray(R_b_from_a)


# From Basilisk's camera axes (z boresight, x right, y down) to the axes of its viewer.
R_viewer_from_camera = matrix_from_mrp((1.0 / 3.0, 1.0 / 3.0, -1.0 / 3.0))


def camera_from_body(direction_B: ArrayLike) -> Array:
    """R_camera_from_body (3, 3) of the parameters sent as ``cameraDir_B``."""
    return R_viewer_from_camera.T @ matrix_from_mrp(direction_B)


def scene_of(
    update: Update, camera_id: int, base: Scenario, overrides: CameraOverrides, warn: Warn
) -> SceneState:
    """The scene of one camera, whose name in it is ``camera_name(camera_id)``.

    base : has the Earth, the stars, the Sun's light, and models by the spacecraft's names
    overrides : camera parameters that the wire does not carry
    warn : gets one line for each thing that is asked for and not drawn

    Raises NoImageError.
    """
    config = _config(update, camera_id)
    spacecraft = {s.name: s for s in update.spacecraft}
    if config.parent not in spacecraft:
        names = ", ".join(f'"{name}"' for name in spacecraft) or "none"
        problem = f'is on the unknown spacecraft "{config.parent}"; there: {names}'
        raise _no_image(camera_id, problem)
    camera = _camera(config, overrides)
    tai_ns = _tai_ns(update, base, warn)
    _warn_of_omissions(update, base, warn)
    parent = _pose(spacecraft[config.parent], np.zeros(3), np.zeros(3))
    bodies = {plain_name(b): b for b in update.bodies}
    central = central_body(update.bodies, parent.position)
    origin = parent.position if central is None else vector_of(central.position, central.name)
    origin_velocity = np.zeros(3)
    if central is not None and central.velocity:
        origin_velocity = vector_of(central.velocity, central.name)
    _warn_of_other_planets(bodies, central, warn)
    sun = _sun_position(bodies, central, origin, base, tai_ns, warn)
    poses = {name: _pose(s, origin, origin_velocity) for name, s in spacecraft.items()}
    state = _with_models(base, tai_ns, poses, sun)
    pose = poses[config.parent]
    camera_position_body = vector_of(config.position_B, "cameraPos_B")
    direction = vector_of(config.direction_B, "cameraDir_B")
    moon = bodies.get("moon")
    globe = None if central is None else globe_of(central, base, tai_ns)
    if overrides.auto_exposed:
        camera = auto_exposed(camera, state.sun, globe)
        target = "white" if central is None else f'"{central.name}"'
        warn(
            f"camera {camera_id} has no exposure_time_s: it has {camera.exposure_time:.2g} s, "
            f"for {target} in full sunlight"
        )
    return replace(
        state,
        earth=globe,
        moon=None if moon is None else vector_of(moon.position, "moon") - origin,
        R_moon_from_icrf=None if moon is None else rotation_of(moon, moon_from_icrf(tai_ns)),
        cameras={
            camera.name: CameraState(
                camera=camera,
                position=pose.position + pose.R_icrf_from_body @ camera_position_body,
                R_camera_from_icrf=camera_from_body(direction) @ pose.R_icrf_from_body.T,
                velocity=pose.velocity,
            )
        },
    )


def camera_name(camera_id: int) -> str:
    """Name of a camera in a scene."""
    return f"camera {camera_id}"


def _no_image(camera_id: int, problem: str) -> NoImageError:
    return NoImageError(f"camera {camera_id} {problem}")


def _config(update: Update, camera_id: int) -> CameraConfig:
    for config in update.cameras:
        if config.id == camera_id:
            break
    else:
        ids = ", ".join(str(c.id) for c in update.cameras) or "none"
        raise _no_image(camera_id, f"is not in the message; cameras there: {ids}")
    if config.render_mode == 1:
        raise _no_image(camera_id, "asks for depth (renderMode 1), which has no image here")
    size = config.resolution
    if len(size) != 2 or not all(1 <= n <= MAX_PIXELS for n in size):
        raise _no_image(camera_id, f"must have 1 to {MAX_PIXELS} pixels a side, got {list(size)}")
    if not 1e-3 <= config.field_of_view_deg <= 170.0:
        problem = f"must have a field of view of 0.001 to 170 deg, got {config.field_of_view_deg:g}"
        raise _no_image(camera_id, problem)
    return config


@lru_cache(maxsize=64)
def _camera(config: CameraConfig, overrides: CameraOverrides) -> Camera:
    """The camera of a file with the field of view and the pixels of the wire."""
    width, height = config.resolution
    name = camera_name(config.id)
    table = structs.replace(overrides.table, width_px=width, height_px=height)
    try:
        pitch = read_camera(
            overrides.where, name, table, overrides.sun_temperature, overrides.base
        ).detector.pixel_pitch
        half = np.tan(0.5 * np.radians(config.field_of_view_deg))
        # Edge to edge along the height.
        focal_length_mm = float(0.5 * height * pitch / half * 1e3)
        table = structs.replace(table, focal_length_mm=focal_length_mm)
        return read_camera(overrides.where, name, table, overrides.sun_temperature, overrides.base)
    except SimglError as error:
        raise _no_image(config.id, f"cannot be built: {error}") from None


def _pose(spacecraft: SpacecraftState, origin: Array, origin_velocity: Array) -> Pose:
    velocity = vector_of(spacecraft.velocity or (0.0, 0.0, 0.0), f'velocity of "{spacecraft.name}"')
    sigma = vector_of(spacecraft.sigma_BN, f'attitude of "{spacecraft.name}"')
    return Pose(
        position=vector_of(spacecraft.position, f'position of "{spacecraft.name}"') - origin,
        velocity=velocity - origin_velocity,
        R_icrf_from_body=matrix_from_mrp(sigma).T,
    )


def _tai_ns(update: Update, base: Scenario, warn: Warn) -> int:
    elapsed = update.instant.sim_time_ns
    if not 0.0 <= elapsed < 2.0**62:
        raise NoImageError(f"simulation time must lie in 0..2^62 ns, got {elapsed:g}")
    if update.epoch is None or update.epoch == Epoch():
        warn("no epoch was sent: stars and Earth are those of the scenario's epoch plus the time")
        return base.epoch_tai_ns + round(elapsed)
    e = update.epoch
    text = f"{e.year:04d}-{e.month:02d}-{e.day:02d}T{e.hours:02d}:{e.minutes:02d}:"
    try:
        return tai_ns_from_utc(f"{text}{e.seconds:012.9f}") + round(elapsed)
    except ValueError as error:
        raise NoImageError(f"the epoch {error}") from None


def _sun_position(
    bodies: dict[str, CelestialBody],
    central: CelestialBody | None,
    origin: Array,
    base: Scenario,
    tai_ns: int,
    warn: Warn,
) -> Array:
    """(3,) position of the Sun from the origin of the scene [m]."""
    assert isinstance(base.sun, EphemerisSun)
    if "sun" in bodies:
        position = vector_of(bodies["sun"].position, "sun") - origin
    elif central is not None and plain_name(central) == "earth":
        warn("no Sun was sent: it stands where the ephemeris has it at the epoch")
        position = sun_position(tai_ns)
    else:
        raise NoImageError("no Sun was sent, and nothing says where its light comes from")
    if float(np.linalg.norm(position)) < 10.0 * base.sun.radius:
        raise NoImageError(f"the Sun must be farther away, got {position.tolist()} m")
    return position


def _with_models(base: Scenario, tai_ns: int, poses: dict[str, Pose], sun: Array) -> SceneState:
    """Spacecraft that were sent, with their joints and lamps, and the stars; without cameras.

    Of what was sent, the scenario's spacecraft count; the others can carry nothing but cameras.
    """
    known = base.motions.keys() | base.models.keys()
    poses = {name: pose for name, pose in poses.items() if name in known}
    sent = replace(
        base,
        earth=None,
        models={name: model for name, model in base.models.items() if name in poses},
        motions={name: motion for name, motion in base.motions.items() if name in poses},
        cameras={},
        mounts={},
        lamps={name: lamp for name, lamp in base.lamps.items() if lamp.spacecraft in poses},
    )
    try:
        return sent.with_poses(tai_ns, poses, sun=sun)
    except ConfigError as error:
        raise NoImageError(str(error)) from None


def _warn_of_omissions(update: Update, base: Scenario, warn: Warn) -> None:
    if update.settings is not None and update.settings.ambient > 0.0:
        warn(
            f"settings.ambient = {update.settings.ambient:g} is REFUSED: no such light exists, "
            "night sides stay dark"
        )
    for name, lights in ((s.name, s.lights) for s in update.spacecraft):
        if name not in base.models:
            warn(f'spacecraft "{name}" is not drawn: the scenario has no model of this name')
        if lights:
            warn(f'lights of "{name}" are not drawn: a [lamp] of the scenario is')
    for config in update.cameras:
        if config.post_processing:
            warn(f"camera {config.id}: post-processing is refused: its file has the lens")


def _warn_of_other_planets(
    bodies: dict[str, CelestialBody], central: CelestialBody | None, warn: Warn
) -> None:
    for name, body in bodies.items():
        if name not in ("sun", "moon") and body is not central:
            warn(f'"{body.name}" is not drawn: of Earth and planets one is, the largest in the sky')
