"""What lies behind a target, as the camera sees it."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from scipy.ndimage import binary_dilation

from simgl.arrays import Array, Mask
from simgl.scene.state import EarthState, SceneState

# Width of the ring of background around the target [pixels].
_RING = 3
# Share of the ring that decides the background; less is mixed.
_NEARLY_ALL = 0.9
# Atmosphere above this tangent height is too thin to be seen beside a sunlit target [m].
LIMB_TOP = 60e3
# Some hundred pixels of the ring represent all of them.
_MAX_RAYS = 400


class TargetBackground(StrEnum):
    """SPACE, the Earth's LIMB, or EARTH behind nearly all of the target's edge; or MIXED."""

    SPACE = "space"
    LIMB = "limb"
    EARTH = "earth"
    MIXED = "mixed"
    NONE = "none"


def ring_around(on_target: Mask, on_spacecraft: Mask) -> Mask:
    """The background pixels next to a target.

    on_target : (height, width); on_spacecraft : the same for all spacecraft
    """
    return binary_dilation(on_target, iterations=_RING) & ~on_spacecraft


def backdrop(
    ring: Mask, state: SceneState, position: Array, R_camera_from_icrf: Array, intrinsics: Array
) -> TargetBackground:
    """The background of the pixels of a ring; NONE where there are none.

    position : (3,) of the pinhole [m]; intrinsics : (3, 3) [pixels]
    """
    rows, columns = np.nonzero(ring)
    if len(rows) == 0:
        return TargetBackground.NONE
    if state.earth is None:
        return TargetBackground.SPACE
    step = max(len(rows) // _MAX_RAYS, 1)
    pixels = np.stack([columns[::step] + 0.5, rows[::step] + 0.5, np.ones(len(rows[::step]))])
    rays = R_camera_from_icrf.T @ np.linalg.solve(intrinsics, pixels)
    height = tangent_heights(state.earth, position, rays.T)
    shares = {
        TargetBackground.EARTH: np.mean(height < 0.0),
        TargetBackground.LIMB: np.mean((height >= 0.0) & (height < LIMB_TOP)),
        TargetBackground.SPACE: np.mean(height >= LIMB_TOP),
    }
    largest = max(shares, key=lambda kind: float(shares[kind]))
    return largest if shares[largest] >= _NEARLY_ALL else TargetBackground.MIXED


def tangent_heights(earth: EarthState, position: Array, rays_icrf: Array) -> Array:
    """(n,) lowest height of rays above the ground [m]; negative if they hit it.

    earth : of the scene's state
    position : (3,) origin of the rays in GCRF [m]
    rays_icrf : (n, 3) directions of any length

    Computed in axes in which the ellipsoid is a sphere; the relative error of heights is 0.3 %.
    """
    radii = np.array(earth.earth.radii)
    scale = radii[0] / radii
    start = scale * (earth.R_itrf_from_icrf @ (position - earth.position))
    along = scale * (rays_icrf @ earth.R_itrf_from_icrf.T)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # A ray that leads away is lowest where it starts.
    lowest = np.maximum(-along @ start, 0.0)
    closest = np.linalg.norm(start + lowest[:, None] * along, axis=1)
    return closest - radii[0]
