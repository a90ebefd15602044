"""What a program gives for the spacecraft and cameras of a scene, checked by name and value."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from simgl.arrays import Array
from simgl.errors import ConfigError, did_you_mean
from simgl.physics.frames import Pose

# Of the entries of R R^T from those of the identity: as far off as a quaternion whose norm is 1e-4
# off makes them.
_SLACK = 2e-4


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
    if not _turns(pose.R_icrf_from_body):
        return "R_icrf_from_body", f"must be a rotation, got {pose.R_icrf_from_body.tolist()}"
    return None


def _turns(R: Array) -> bool:
    """Whether a matrix (3, 3) is a rotation: its rows are unit, perpendicular and right-handed.

    In Python's floats: a tenth of numpy's time for so few of them.
    """
    x, y, z = R.tolist()
    lengths = max(abs(_dot(row, row) - 1.0) for row in (x, y, z))
    angles = max(abs(_dot(x, y)), abs(_dot(y, z)), abs(_dot(z, x)))
    across = (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0])
    return max(lengths, angles) <= _SLACK and _dot(x, across) > 0.0


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
