"""The mean of the Sun's light over an exposure in which a spacecraft enters or leaves a shadow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from simgl.arrays import Array
from simgl.scene.state import SceneState

# In low Earth orbit sunlight falls from 0.9 to 0.1 in 8 to 12 s. Over shorter exposures than this
# the light of the middle is that of the mean to 3e-5 of full sunlight [s].
_SHORT = 0.2
# Parts of longer ones, each with Gauss's weights at three times [s]; and the largest number of
# these.
_PART, _MAX_PARTS = 2.0, 64
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def with_mean_sunlight(
    state: SceneState,
    camera: str,
    at: Callable[[float], SceneState],
    moment: float,
    length: float,
) -> SceneState:
    """A state whose spacecraft, and camera, have the mean of the Sun's light over a time.

    state : in the middle of it
    at : the scene at a time [s]
    moment : of the state, in the same time
    length : of all of it [s]
    """
    if length < _SHORT or state.earth is None:
        return state
    parts = min(int(np.ceil(length / _PART)), _MAX_PARTS)
    nodes = (np.arange(parts)[:, None] + 0.5 * (_NODES + 1.0)).ravel() / parts - 0.5
    weights = np.tile(0.5 * _WEIGHTS / parts, parts)
    states = [at(moment + float(node) * length) for node in nodes]

    means: dict[bytes, Array] = {}
    for places in zip(*(_places(one, camera) for one in (state, *states)), strict=True):
        shares = np.array([one.sunlight(p) for one, p in zip(states, places[1:], strict=True)])
        if np.ptp(shares, axis=0).any():
            means[places[0].tobytes()] = weights @ shares
    return replace(state, mean_sunlight=means) if means else state


def _places(state: SceneState, camera: str) -> list[Array]:
    """Of the camera and all spacecraft, (3,) each [m]."""
    bodies = [body.pose.position for body in state.bodies.values()]
    return [state.cameras[camera].position, *bodies]
