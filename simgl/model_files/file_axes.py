"""Units and axes of users' model files: from the file's numbers to body axes in metres."""

from __future__ import annotations

from typing import Literal

import numpy as np

from simgl.arrays import Array

# Metres in each.
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048, "km": 1e3}
Unit = Literal["m", "mm", "cm", "in", "ft", "km"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
AXES = ("x", "y", "z", "-x", "-y", "-z")

# What looks ahead where only the way up is given: z ahead with y up, as glTF has it; else x, or z.
_USUAL_AHEAD = {"x": "z", "y": "z", "z": "x"}


def body_from_file(unit_m: float, up: str | None, forward: str | None) -> Array:
    """(3, 3) body metres from a file's coordinates.

    unit_m : metres per unit of the file
    up, forward : the file's axes, of ``AXES``, that become body -z and body x; without ``up`` the
        file's axes are the body's

    Raises ValueError where the two are not square to each other.
    """
    if up is None:
        if forward is not None:
            raise ValueError("goes with up_axis")
        return unit_m * np.eye(3)
    ahead = forward or _USUAL_AHEAD[up[-1]]
    if ahead[-1] == up[-1]:
        raise ValueError(f"must not lie along up_axis, got {ahead} and {up}")
    x, z = _axis(ahead), -_axis(up)
    return unit_m * np.stack([x, np.cross(z, x), z])


def _axis(name: str) -> Array:
    sign = -1.0 if name[0] == "-" else 1.0
    return sign * np.eye(3)["xyz".index(name[-1])]
