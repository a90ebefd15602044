"""How light on a spacecraft changes over the part of an exposure for which a snapshot stands.

The snapshot is shaded once, with the mean of what its lobes turn to the viewer at several times.
Each of its shading points has shadows of a time of its own; these times spread evenly over the part
(``shaders/common/light_spread.glsl``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.scene.state import BodyState, CameraState
from simgl.view.row_clock import camera_from_body

# Turns within which the light of one time is enough: as far as the edge of the Sun's own disc is
# from its middle [rad].
_STILL = 4.65e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class LightSpread:
    """From the middle of a part of an exposure to its end.

    turn : (3,) rotation vector of the body before the camera, camera axes [rad]
    turn_in_space : (3,) the same against the stars
    shift : (3,) of the body's origin, camera axes [m]
    focal_px : of the pinhole [px]
    cells : along the edge of a pixel
    """

    turn: Array
    turn_in_space: Array
    shift: Array
    focal_px: float
    cells: float = 1.0

    @property
    def farthest(self) -> float:
        """Angle of the larger turn [rad]."""
        return max(float(np.linalg.norm(turn)) for turn in (self.turn, self.turn_in_space))


def light_spread(seen: Sequence[tuple[CameraState, BodyState]], share: float) -> LightSpread | None:
    """None where it turns so little that one light is enough.

    seen : from the start to the end of what rows see, and in the middle between
    share : of that time, which one row sees
    """
    (first, before), (camera, _), (last, after) = seen
    start, end = camera_from_body(first, before), camera_from_body(last, after)
    half = 0.5 * share
    turn = half * Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()
    turned = after.pose.R_icrf_from_body @ before.pose.R_icrf_from_body.T
    in_space = half * Rotation.from_matrix(turned).as_rotvec()
    if float(np.linalg.norm(in_space)) < _STILL:
        return None
    return LightSpread(
        turn=turn,
        turn_in_space=camera.R_camera_from_icrf @ in_space,
        shift=half * (end[:3, 3] - start[:3, 3]),
        focal_px=camera.camera.focal_length_px,
    )
