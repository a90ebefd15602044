"""How many snapshots it takes until the light of lamps on spacecraft that move is right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from simgl.arrays import Array
from simgl.scene.lamps import LampState
from simgl.scene.state import BodyState, SceneState

# Points go so much of the width of a beam's edge in one snapshot. Their light is that of its middle
# meanwhile: where half a cosine leads from 1 to 0 over a width e, the mean over a way w is off by
# (pi w / e)^2 / 48 of the full light, 0.02.
_OF_EDGE = 0.3
# And of their distance: an inverse square is off by (w / d)^2 / 4, 0.005.
_OF_DISTANCE = 0.14
# Corners of a hull that stand for all of it.
_CORNERS = 64


def steps_of_lamps(states: Sequence[SceneState], names: Iterable[str]) -> float:
    """In so many snapshots light of lamps has to be told on spacecraft that come into their beams,
    leave them, or come nearer.

    states : at even times
    names : of the spacecraft
    """
    steps = 0.0
    for lamps in zip(*(one.lamps for one in states), strict=True):
        if lamps[0].lamp.power.any():
            for name in names:
                bodies = [one.bodies[name] for one in states]
                steps = max(steps, _steps_of(lamps, bodies))
    return steps


def _steps_of(lamps: Sequence[LampState], bodies: Sequence[BodyState]) -> float:
    seen = [from_lamp(lamp, body) for lamp, body in zip(lamps, bodies, strict=True)]
    angles, distances = (np.array(values) for values in zip(*seen, strict=True))
    inner = lamps[0].lamp.half_angle
    outer = inner + lamps[0].lamp.edge
    mesh = bodies[0].model.posed_mesh
    # The first is the middle of the sphere around the body.
    width = np.arcsin(np.minimum(mesh.radius / np.maximum(distances[:, 0], 1e-9), 1.0))
    width[distances[:, 0] <= mesh.radius] = np.pi
    nearest = np.maximum(angles[:, 0] - width, 0.0).min()
    if nearest > outer:
        return 0.0
    near = np.maximum(distances.min(axis=0), 1e-2 * mesh.radius)
    steps = float((np.abs(np.diff(distances, axis=0)).sum(axis=0) / near).max()) / _OF_DISTANCE
    if angles.max() > inner:
        way = float(np.abs(np.diff(angles, axis=0)).sum(axis=0).max())
        steps = max(steps, way / (_OF_EDGE * lamps[0].lamp.edge))
    return steps


def from_lamp(lamp: LampState, body: BodyState) -> tuple[Array, Array]:
    """(n,) angles of points of a body from the axis of a beam [rad], and their distances [m]."""
    mesh, pose = body.model.posed_mesh, body.pose
    hull = mesh.hull[:: int(np.ceil(len(mesh.hull) / _CORNERS))]
    # Corners alone would miss what passes the axis between them.
    corners = np.vstack([mesh.centre, hull, 0.5 * (hull + mesh.centre)])
    points = corners @ pose.R_icrf_from_body.T + (pose.position - lamp.position)
    along = points @ lamp.direction
    across = np.linalg.norm(points - along[:, None] * lamp.direction, axis=1)
    return np.arctan2(across, along), np.linalg.norm(points, axis=1)
