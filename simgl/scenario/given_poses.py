"""What a program gives for the spacecraft and cameras of a scene, checked by name and value."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping

import numpy as np

from simgl.errors import ConfigError, did_you_mean
from simgl.physics.frames import Pose, is_rotation


def check_given(
    bodies: Mapping[str, Pose],
    joints: Iterable[str],
    exposures: Iterable[str],
    spacecraft: Collection[str],
    cameras: Collection[str],
) -> None:
    """Raise ConfigError for a name that the scenario does not have, or for an impossible pose.

    joints, exposures : spacecraft with joint angles, and cameras with exposure times
    spacecraft, cameras : of the scenario
    """
    for kind, given, known in (
        ("bodies", bodies, spacecraft),
        ("joint_angles", joints, spacecraft),
        ("exposure_times", exposures, cameras),
    ):
        for name in given:
            if name not in known:
                raise ConfigError("given", kind, f'has no "{name}"; {did_you_mean(name, known)}')
    for name, pose in bodies.items():
        problem = _problem(pose)
        if problem is not None:
            raise ConfigError("given", f"bodies.{name}.{problem[0]}", problem[1])


def _problem(pose: Pose) -> tuple[str, str] | None:
    """The field of a pose that cannot be, and why."""
    for name, shape in (("position", (3,)), ("velocity", (3,)), ("R_icrf_from_body", (3, 3))):
        value = getattr(pose, name)
        if not isinstance(value, np.ndarray) or value.shape != shape:
            given = value.shape if isinstance(value, np.ndarray) else type(value).__name__
            return name, f"must be an array of shape {shape}, got {given}"
        if not math.isfinite(value.sum()):
            return name, f"must be finite, got {value.tolist()}"
    if not is_rotation(pose.R_icrf_from_body):
        return "R_icrf_from_body", f"must be a rotation, got {pose.R_icrf_from_body.tolist()}"
    return None
