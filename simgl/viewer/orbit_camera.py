"""The orbit camera: circles a spacecraft and looks at it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pyrr

from simgl.arrays import Array
from simgl.physics.frames import Pose, lvlh_from_icrf
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.view.depth_slices import NEAREST

FIELD_OF_VIEW = math.radians(40.0)  # full, vertical

# One turn of the wheel changes the range by this factor.
_ZOOM = 1.1
# At this many radii of the spacecraft it covers less than two pixels of a 640-pixel window.
_FARTHEST = 1000.0

# Camera axes (columns) in orbit axes at azimuth 0, elevation 0: the boresight z along +x, the
# image's right x along +y, its bottom y along +z.
_R_ORBIT_FROM_CAMERA_AT_ZERO = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def _rotation(axis: tuple[float, float, float], angle: float) -> Array:
    """The right-handed rotation about an axis, for column vectors.

    pyrr 0.10.3 builds axis rotations for row vectors (v M), so its matrix is transposed here. Its
    quaternions are not used: ``q * v`` and ``Matrix44.from_quaternion(q) * v`` turn opposite ways.
    """
    return np.asarray(pyrr.matrix33.create_from_axis_rotation(np.array(axis), angle).T)


@dataclass(frozen=True, kw_only=True)
class OrbitCamera:
    """A camera that circles a point and looks at it, in the conventions of ``OrbitingMount``.

    In orbit axes (LVLH of the target: z nadir, y minus the orbit normal), azimuth 0 is at -x,
    azimuth 90 deg at -z (zenith); positive elevation is towards -y. The top of the image points
    along increasing azimuth at elevation 0. No angle is singular, so neither is limited.

    azimuth, elevation : [rad], kept within +-pi
    range : from the point [m]
    nearest, farthest : limits of ``range`` [m]
    """

    azimuth: float
    elevation: float
    range: float
    nearest: float
    farthest: float

    def __post_init__(self) -> None:
        if not 0.0 < self.nearest <= self.range <= self.farthest:
            raise ValueError(
                f"range must lie in {self.nearest:g} to {self.farthest:g} m, got {self.range:g}"
            )

    def dragged(self, right: float, down: float) -> OrbitCamera:
        """The camera after the image was dragged by two angles [rad]: the target follows."""
        # Beyond the orbit normal the image's top points along decreasing azimuth.
        sense = math.copysign(1.0, math.cos(self.elevation))
        return replace(
            self,
            azimuth=math.remainder(self.azimuth + sense * down, 2.0 * math.pi),
            elevation=math.remainder(self.elevation + right, 2.0 * math.pi),
        )

    def zoomed(self, steps: float) -> OrbitCamera:
        """The camera nearer by a number of steps of 10 %, within its limits."""
        wanted = self.range * _ZOOM**-steps
        return replace(self, range=min(max(wanted, self.nearest), self.farthest))

    def pose(self, centre_icrf: Array, R_icrf_from_orbit: Array) -> tuple[Array, Array]:
        """Position (3,) [m] and R_camera_from_icrf about a centre (3,) [m]."""
        R_orbit_from_camera = (
            _rotation((0.0, -1.0, 0.0), self.azimuth)
            @ _rotation((0.0, 0.0, 1.0), self.elevation)
            @ _R_ORBIT_FROM_CAMERA_AT_ZERO
        )
        R_icrf_from_camera = R_icrf_from_orbit @ R_orbit_from_camera
        return centre_icrf - self.range * R_icrf_from_camera[:, 2], R_icrf_from_camera.T


def orbit_axes(pose: Pose) -> Array:
    """R_icrf_from_orbit: LVLH where the spacecraft has an orbit, else ICRF with z to the south.

    In the latter the celestial north takes the place of the zenith.
    """
    if np.linalg.norm(np.cross(pose.position, pose.velocity)) == 0.0:
        return np.diag([1.0, -1.0, -1.0])
    return lvlh_from_icrf(pose.position, pose.velocity).T


def opening_camera(state: SceneState, target: str) -> OrbitCamera:
    """A camera above and beside a spacecraft, on that of four sides which the Sun lights best."""
    body = state.bodies[target]
    nearest, farthest = range_limits(body.model)
    centre, axes = body.pose.position, orbit_axes(body.pose)
    sun_direction = state.sun.seen_from(centre).direction_icrf
    # The bounding sphere fills six tenths of the image's height.
    distance = nearest / math.sin(0.6 * 0.5 * FIELD_OF_VIEW)
    azimuth, side = math.radians(20.0), math.radians(25.0)
    cameras = [
        OrbitCamera(azimuth=a, elevation=e, range=distance, nearest=nearest, farthest=farthest)
        for a, e in (
            (azimuth, side),
            (azimuth, -side),
            (-azimuth, math.pi - side),
            (-azimuth, side - math.pi),
        )
    ]

    def sunlit(camera: OrbitCamera) -> float:
        position, _ = camera.pose(np.zeros(3), axes)
        return float(np.dot(position, sun_direction))

    return max(cameras, key=sunlit)


def range_limits(model: SpacecraftModel) -> tuple[float, float]:
    """Nearest and farthest range from the body origin [m], outside the bounding sphere."""
    reach = float(np.linalg.norm(model.posed_mesh.centre)) + model.posed_mesh.radius
    return 1.02 * reach + NEAREST, _FARTHEST * reach
