"""From features to geometry: a position from two rays, a pose from markers on a board."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from examples.closed_loop.camera import Pinhole
from examples.closed_loop.silhouette import Silhouette
from simgl.arrays import Array

CONSISTENT = 3.0  # [px] rays of both tips must meet the two tips within this
MIN_MARKERS = 8  # a pose has 6 unknowns, each marker gives 2 equations
STEPS = 60
SETTLED = 1e-7  # [m, rad] a thousandth of what any camera sees
OUTLIER = 4.0  # of the residuals' own deviation
# The least scatter of a marker [px]: the pixels' own noise.
MARKER_ERROR_PX = 0.03
# What all markers get wrong together, image after image [px]: discs of few pixels, light that falls
# off across the board, the lens. No number of markers averages it away.
COMMON_ERROR_PX = 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class BoardPose:
    """Where a board is before the camera.

    position : (3,) of its origin in camera axes [m]
    covariance : (6, 6) of that position [m] and of a small turn about camera axes [rad]
    residual_px : rms over the markers, both directions
    markers : how many were used
    """

    position: Array
    R_camera_from_board: Array
    covariance: Array
    residual_px: float
    markers: int


def solve_pose(
    camera: Pinhole, markers: Array, points: Array, start: tuple[Array, Array]
) -> BoardPose | None:
    """The pose that puts markers where they were seen: least squares of the reprojection error.

    markers : (n, 3) on the board, in its axes [m]
    points : (n, 2) where they were seen [px]
    start : R_camera_from_board (3, 3) and position (3,), roughly

    returns None where markers are few or the search runs off
    """
    solution = _refined_pose(camera, markers, points, start)
    if solution is None:
        return None
    rotation, position, _, errors = solution
    sizes = np.linalg.norm(errors, axis=1)
    # The median of the length of a normal error in two dimensions is 1.18 sigma.
    good = sizes < OUTLIER * max(float(np.median(sizes)) / 1.18, MARKER_ERROR_PX)
    if not np.all(good):
        solution = _refined_pose(camera, markers[good], points[good], (rotation, position))
        if solution is None:
            return None
    rotation, position, normal, errors = solution
    freedom = errors.size - 6
    sigma = max(float(np.sqrt(np.sum(errors**2) / freedom)), MARKER_ERROR_PX)
    covariance = np.asarray(sigma**2 * np.linalg.inv(normal), dtype=np.float64)
    covariance += np.diag(_common_error(camera, markers, float(position[2])) ** 2)
    return BoardPose(
        position=position,
        R_camera_from_board=rotation,
        covariance=covariance,
        residual_px=float(np.sqrt(np.mean(errors**2))),
        markers=len(errors),
    )


def _common_error(camera: Pinhole, markers: Array, distance: float) -> Array:
    """(6,) what ``COMMON_ERROR_PX`` does to place [m] and turn [rad] of a board that faces us.

    With angles e = error / focal length and a board that reaches a off its middle: e d across,
    e d^2 / a in distance, e d / a in roll. Tilt shows only in how much larger the near side looks,
    by a^2 / d^2 of the tilt: e d^2 / a^2.
    """
    e = COMMON_ERROR_PX / camera.focal_length
    reach = float(np.sqrt(np.mean(np.sum((markers - markers.mean(axis=0)) ** 2, axis=1))))
    across, tilt = e * distance, e * (distance / reach) ** 2
    return np.array([across, across, across * distance / reach, tilt, tilt, across / reach])


def _refined_pose(
    camera: Pinhole, markers: Array, points: Array, start: tuple[Array, Array]
) -> tuple[Array, Array, Array, Array] | None:
    """Rotation, position, normal matrix (6, 6) and errors (n, 2) [px], by Levenberg-Marquardt.

    Gauss-Newton alone swings to and fro where a board far off faces the camera: then its tilt
    hardly shows.
    """
    if len(markers) < MIN_MARKERS:
        return None
    rotation, position = start
    arms = markers @ rotation.T
    if np.any(arms[:, 2] + position[2] <= 0.0):
        return None
    errors = points - camera.project_all(arms + position)
    damping = 1e-3
    for _ in range(STEPS):
        slopes = _slopes(camera, arms + position, arms).reshape(-1, 6)
        normal, downhill = slopes.T @ slopes, slopes.T @ errors.ravel()
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), downhill)
        turned = Rotation.from_rotvec(step[3:]).as_matrix() @ rotation
        moved = position + step[:3]
        swung = markers @ turned.T
        if np.any(swung[:, 2] + moved[2] <= 0.0):
            return None
        left = points - camera.project_all(swung + moved)
        better = float(np.sum(left**2)) <= float(np.sum(errors**2))
        if better:
            rotation, position, arms, errors = turned, moved, swung, left
        if np.max(np.abs(step)) < SETTLED:
            return rotation, position, normal, errors
        damping = max(0.1 * damping, 1e-9) if better else 10.0 * damping
    return None


def _slopes(camera: Pinhole, places: Array, arms: Array) -> Array:
    """(n, 2, 6) change of a point of the image [px] with position [m] and turn [rad]."""
    x, y, z = places.T
    f = camera.focal_length
    by_place = np.zeros((len(places), 2, 3))
    by_place[:, 0, 0] = by_place[:, 1, 1] = f / z
    by_place[:, 0, 2] = -f * x / z**2
    by_place[:, 1, 2] = -f * y / z**2
    # A turn t moves an arm a by t x a = -[a] t.
    a, b, c = arms.T
    zero = np.zeros_like(a)
    turned = np.array([[zero, c, -b], [-c, zero, a], [b, -a, zero]]).transpose(2, 0, 1)
    return np.concatenate([by_place, by_place @ turned], axis=2)


def locate(
    silhouette: Silhouette,
    camera: Pinhole,
    R_lvlh_from_camera: Array,
    tips_lvlh: tuple[Array, Array],
) -> Array | None:
    """(3,) position of the camera from the target's origin in LVLH [m], from two rays.

    tips_lvlh : (3,) left and right wing tip from the target's origin in LVLH axes [m]
    returns None where a tip is not seen, or the rays do not fit the tips
    """
    if silhouette.left_tip is None or silhouette.right_tip is None:
        return None
    # A camera at r sees the tip p along d: (I - d d^T)(p - r) = 0. Two tips: least squares for r.
    weights, sums = np.zeros((3, 3)), np.zeros(3)
    rays = [R_lvlh_from_camera @ camera.ray(t) for t in (silhouette.left_tip, silhouette.right_tip)]
    across = [np.eye(3) - np.outer(d, d) for d in rays]
    for flat, tip in zip(across, tips_lvlh, strict=True):
        weights += flat
        sums += flat @ tip
    position = np.asarray(np.linalg.solve(weights, sums), dtype=np.float64)
    misses = [
        np.linalg.norm(flat @ (tip - position)) / np.linalg.norm(tip - position)
        for flat, tip in zip(across, tips_lvlh, strict=True)
    ]
    return position if max(misses) * camera.focal_length < CONSISTENT else None
