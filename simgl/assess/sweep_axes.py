"""The axes of a sweep, and the scene and camera of each of its points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgl.camera.camera import Camera
from simgl.errors import ConfigError, did_you_mean
from simgl.physics.frames import unit
from simgl.scene.state import SceneState, SunAtPosition

# Limits of the values of an axis, by its name. Each direction of the Sun needs a rendered frame,
# which all settings of the camera share.
SUN_AXES = {"phase_angle_deg": (0.0, 180.0), "sun_clock_deg": (-360.0, 360.0)}
CAMERA_AXES = {"exposure_time_s": (1e-9, 3600.0), "f_number": (0.5, 1e3)}
_LIMITS = SUN_AXES | CAMERA_AXES
# Values of one axis.
_MAX_VALUES = 1000


@dataclass(frozen=True)
class Axis:
    """Values that one quantity takes in turn, named as on the command line."""

    name: str
    values: tuple[float, ...]


def parse_axes(texts: Sequence[str]) -> tuple[Axis, ...]:
    """The axes of options such as ``f_number=2.8,4`` and ``exposure_time_s=1e-5:1e-3:9:log``.

    Those of the Sun come first. Raises ConfigError.
    """
    axes = [_axis(text) for text in texts]
    for index, axis in enumerate(axes):
        if axis.name in [other.name for other in axes[:index]]:
            raise ConfigError("command line", "--sweep", f"names {axis.name} twice")
    return tuple(sorted(axes, key=lambda axis: list(_LIMITS).index(axis.name)))


def _axis(text: str) -> Axis:
    name, equals, given = text.partition("=")
    where = ("command line", f"--sweep {name.strip()}")
    if not equals:
        problem = f'must be NAME=VALUES, got "{text}"'
        raise ConfigError("command line", "--sweep", problem)
    name = name.strip()
    if name not in _LIMITS:
        raise ConfigError(
            "command line", "--sweep", f'has no "{name}"; {did_you_mean(name, _LIMITS)}'
        )
    values = _span(where, given) if ":" in given else [_number(where, v) for v in given.split(",")]
    low, high = _LIMITS[name]
    for value in values:
        if not low <= value <= high:
            raise ConfigError(*where, f"must lie in {low:g}..{high:g}, got {value:g}")
    if len(set(values)) != len(values):
        raise ConfigError(*where, "names a value twice")
    return Axis(name, tuple(values))


def _span(where: tuple[str, str], given: str) -> list[float]:
    parts = [part.strip() for part in given.split(":")]
    if len(parts) not in (3, 4) or parts[3:] not in ([], ["log"]):
        problem = f'must be FROM:TO:COUNT or FROM:TO:COUNT:log, got "{given}"'
        raise ConfigError(*where, problem)
    start, stop = _number(where, parts[0]), _number(where, parts[1])
    if not parts[2].isdigit() or not 2 <= int(parts[2]) <= _MAX_VALUES:
        raise ConfigError(*where, f'must have a count in 2..{_MAX_VALUES}, got "{parts[2]}"')
    if len(parts) == 3:
        return [float(v) for v in np.linspace(start, stop, int(parts[2]))]
    if min(start, stop) <= 0.0:
        raise ConfigError(*where, f'must have positive ends for log, got "{given}"')
    return [float(v) for v in np.geomspace(start, stop, int(parts[2]))]


def _number(where: tuple[str, str], text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ConfigError(*where, f'must be a number, got "{text.strip()}"') from None
    if not math.isfinite(value):
        raise ConfigError(*where, f'must be finite, got "{text.strip()}"')
    return value


def with_sun(
    state: SceneState, camera: str, target: str, values: Mapping[str, float]
) -> SceneState:
    """The scene with the Sun in another direction, at the same distance and irradiance.

    values : ``phase_angle_deg`` between the directions from the target to the Sun and to the
        camera; ``sun_clock_deg``, of the Sun about the line of sight, clockwise from the top of
        the image. What is not given stays. Earth and Moon stay where they are.
    """
    if not values:
        return state
    seen, place = state.cameras[camera], state.bodies[target].pose.position
    out = unit(seen.position - place)
    R = seen.R_camera_from_icrf
    up = unit(-R[1] - np.dot(-R[1], out) * out)
    right = unit(R[0] - np.dot(R[0], out) * out - np.dot(R[0], up) * up)
    now = state.sun.seen_from(place).direction_icrf
    phase = math.atan2(float(np.linalg.norm(np.cross(out, now))), float(np.dot(out, now)))
    clock = math.atan2(float(np.dot(now, right)), float(np.dot(now, up)))
    phase = math.radians(values.get("phase_angle_deg", math.degrees(phase)))
    clock = math.radians(values.get("sun_clock_deg", math.degrees(clock)))
    across = math.cos(clock) * up + math.sin(clock) * right
    direction = math.cos(phase) * out + math.sin(phase) * across
    sun = state.sun
    if isinstance(sun, SunAtPosition):
        distance = float(np.linalg.norm(sun.position - place))
        return replace(state, sun=replace(sun, position=place + distance * direction))
    return replace(state, sun=replace(sun, direction_icrf=direction))


def with_setting(camera: Camera, values: Mapping[str, float]) -> Camera:
    """The camera with another exposure time or f-number."""
    return replace(
        camera,
        exposure_time=values.get("exposure_time_s", camera.exposure_time),
        lens=replace(camera.lens, f_number=values.get("f_number", camera.lens.f_number)),
    )
