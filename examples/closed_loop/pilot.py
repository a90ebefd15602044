"""Flight software: images in, pushes, attitude, exposure and lamp out. It never sees the truth.

What it knows besides images: its own attitude (star tracker), the target's orbit and nominal
attitude, the drawings of target and board, its own camera. Times are seconds since the start.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from examples.closed_loop.attitude import ATTITUDE_KNOWLEDGE_ERROR
from examples.closed_loop.camera import Pinhole
from examples.closed_loop.exposure import ExposureControl, Light
from examples.closed_loop.guidance import Phase, Plan
from examples.closed_loop.markers import Board, Sighting, board_level, find_markers
from examples.closed_loop.navigation import Estimate, Filter, Fix, far_fix
from examples.closed_loop.pose import BoardPose, locate, solve_pose
from examples.closed_loop.silhouette import SPACE_RIDER_WING, Silhouette, find_target
from simgl.arrays import Array, Image16

# Against the truth a tip is found to 0.1 to 0.2 px, but the error is that of shadows and highlights
# on the wing and lasts for many frames: a fix is worth less than its scatter says.
TIP_ERROR_PX = 0.4
# The drawing: the faces of the panels stand some centimetres in front of the plane of the tips [m].
DRAWING_ERROR = 0.04
# Markers are looked for from here on [m], and wings no nearer than they fit into the image.
MARKERS_FROM = 22.0
WINGS_TO = 12.0
# Besides the scatter of the markers: how well the board is built and mounted, the lens known.
BUILD_ERROR = 0.001  # [m]
BUILD_TURN = np.radians(0.02)
# Thrusters fire after an image of the same second is taken [s].
AFTER_SHUTTER = 1e-6
# Exposures that a craft on its own begins with, in sunlight.
FIRST_LIGHT = Light(exposure=5e-5, lamp=False)


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawing:
    """What is known of both craft beforehand.

    R_lvlh_from_target : nominal (3, 3)
    tips : (3,) left and right wing tip on the target [m]
    board_position : (3,) of the board's origin on the target [m]
    R_target_from_board : (3, 3)
    camera_position : (3,) on the chaser [m]
    R_camera_from_body : (3, 3)
    """

    R_lvlh_from_target: Array
    tips: tuple[Array, Array]
    board: Board
    board_position: Array
    R_target_from_board: Array
    camera_position: Array
    R_camera_from_body: Array

    @property
    def board_lvlh(self) -> Array:
        """(3,) nominal place of the board from the target's origin [m]."""
        return self.R_lvlh_from_target @ self.board_position

    @property
    def R_lvlh_from_board(self) -> Array:
        """(3, 3) nominal."""
        return self.R_lvlh_from_target @ self.R_target_from_board


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """What one image told; None where it told nothing.

    time : of its mid-exposure
    age : until flight software had it [s]
    brightness : of white on the target, share of full scale
    accepted : the filter believed the fix
    predicted : (n, 2) where the board's discs were expected [px]
    """

    time: float
    age: float
    light: Light
    brightness: float
    silhouette: Silhouette | None = None
    sighting: Sighting | None = None
    pose: BoardPose | None = None
    fix: Fix | None = None
    accepted: bool = False
    predicted: Array | None = None


class Pilot:
    """The chaser's software. It is told of time by its calls, which run forward."""

    def __init__(
        self,
        camera: Pinhole,
        drawing: Drawing,
        start: Estimate,
        mean_motion: float,
        plan: Plan,
        control: ExposureControl,
    ) -> None:
        self._camera, self._drawing, self._plan, self._control = camera, drawing, plan, control
        self._mean_motion = mean_motion
        self.filter = Filter(start, mean_motion)
        self.phase = Phase.APPROACH
        self.light = FIRST_LIGHT
        self._last_fix = -np.inf
        self._held = 0
        self._next_push = plan.far.hop
        # At each opening of the shutter: attitude (3, 3) into LVLH, and the light.
        self._taken: dict[float, tuple[Array, Light]] = {}

    def attitude(self, time: float, R_lvlh_from_body: Array) -> Array:
        """(3,) where the camera should look: from its own place to the board, in LVLH [m].

        R_lvlh_from_body : (3, 3) of the chaser now
        """
        state = self.filter.at(time).mean
        place, _ = self._board(state)
        return place - state[:3] - R_lvlh_from_body @ self._drawing.camera_position

    def _board(self, state: Array) -> tuple[Array, Array]:
        """Place (3,) [m] and R_lvlh_from_board of the board from the target, by the filter."""
        turn = Rotation.from_rotvec(state[6:]).as_matrix()
        drawing = self._drawing
        return turn @ drawing.board_lvlh, turn @ drawing.R_lvlh_from_board

    def shutter(self, time: float, R_lvlh_from_body: Array) -> Light:
        """An image is taken now, in the attitude (3, 3) that the star tracker tells."""
        self._taken[time] = (R_lvlh_from_body, self.light)
        return self.light

    def see(self, dn: Image16, time: float, now: float) -> Look:
        """An image of an earlier time has arrived."""
        R_lvlh_from_body, light = self._taken.pop(time)
        state = self.filter.at(time)
        look = Look(time=time, age=now - time, light=light, brightness=0.0)
        near = state.range < MARKERS_FROM
        if near:
            look = self._see_markers(dn, look, state, R_lvlh_from_body)
        if look.fix is None and state.range > WINGS_TO:
            look = self._see_wings(dn, look, R_lvlh_from_body, near)
        if look.fix is not None:
            look = replace(look, accepted=self.filter.fix(time, look.fix))
        if look.accepted:
            self._last_fix = time
        self._held = self._held + 1 if look.accepted and look.pose is not None else 0
        self.light = self._control.after(self.light, light, look.brightness)
        return look

    def _see_wings(self, dn: Image16, look: Look, R_lvlh_from_body: Array, near: bool) -> Look:
        camera, drawing = self._camera, self._drawing
        silhouette = find_target(dn, camera, SPACE_RIDER_WING)
        if silhouette is None:
            return look
        if not near:
            look = replace(look, brightness=silhouette.level / camera.full_scale_dn)
        left, right = (drawing.R_lvlh_from_target @ tip for tip in drawing.tips)
        R_lvlh_from_camera = R_lvlh_from_body @ drawing.R_camera_from_body.T
        seen = locate(silhouette, camera, R_lvlh_from_camera, (left, right))
        if seen is None:
            return replace(look, silhouette=silhouette)
        middle = 0.5 * (left + right)
        fix = far_fix(
            seen - R_lvlh_from_body @ drawing.camera_position - middle,
            middle,
            tip_error=TIP_ERROR_PX / camera.focal_length,
            span=float(np.linalg.norm(right - left)),
            drawing_error=DRAWING_ERROR,
        )
        return replace(look, silhouette=silhouette, fix=fix)

    def _see_markers(
        self, dn: Image16, look: Look, state: Estimate, R_lvlh_from_body: Array
    ) -> Look:
        camera, drawing = self._camera, self._drawing
        R_camera_from_lvlh = drawing.R_camera_from_body @ R_lvlh_from_body.T
        place, R_lvlh_from_board = self._board(state.mean)
        camera_position = state.mean[:3] + R_lvlh_from_body @ drawing.camera_position
        position = R_camera_from_lvlh @ (place - camera_position)
        rotation = R_camera_from_lvlh @ R_lvlh_from_board
        if position[2] < 0.3:
            return look
        predicted = camera.project_all(drawing.board.centres @ rotation.T + position)
        scale = camera.focal_length / float(position[2])
        look = replace(
            look,
            predicted=predicted,
            brightness=board_level(dn, camera, predicted) / camera.full_scale_dn,
        )
        search = 3.0 * scale * float(np.max(state.position_sigma)) + 0.35 * scale * 0.12 + 2.0
        sighting = find_markers(dn, camera, drawing.board, predicted, scale, search)
        if sighting is None:
            return look
        look = replace(look, sighting=sighting)
        markers = drawing.board.centres[sighting.index]
        pose = solve_pose(camera, markers, sighting.points, (rotation, position))
        if pose is None:
            return look
        return replace(look, pose=pose, fix=self._marker_fix(pose, R_lvlh_from_body))

    def _marker_fix(self, pose: BoardPose, R_lvlh_from_body: Array) -> Fix:
        """The chaser from the board, and the board's turn, in LVLH."""
        drawing = self._drawing
        R_lvlh_from_camera = R_lvlh_from_body @ drawing.R_camera_from_body.T
        R_lvlh_from_board = R_lvlh_from_camera @ pose.R_camera_from_board
        turn = Rotation.from_matrix(R_lvlh_from_board @ drawing.R_lvlh_from_board.T).as_rotvec()
        # The place is minus the board's before the camera, and so is its error.
        into = np.zeros((6, 6))
        into[:3, :3], into[3:, 3:] = -R_lvlh_from_camera, R_lvlh_from_camera
        covariance = into @ pose.covariance @ into.T
        distance = float(np.linalg.norm(pose.position))
        blur = (ATTITUDE_KNOWLEDGE_ERROR * distance) ** 2 + BUILD_ERROR**2
        covariance[:3, :3] += blur * np.eye(3)
        covariance[3:, 3:] += (ATTITUDE_KNOWLEDGE_ERROR**2 + BUILD_TURN**2) * np.eye(3)
        return Fix(
            point=drawing.board_lvlh,
            position=-R_lvlh_from_camera @ pose.position
            - R_lvlh_from_body @ drawing.camera_position,
            turn=np.asarray(turn),
            covariance=covariance,
        )

    def push(self, time: float, R_lvlh_from_body: Array) -> Array:
        """(3,) velocity change to be made now in LVLH [m s-1]; zeros for none.

        R_lvlh_from_body : (3, 3) of the chaser now
        """
        if time < self._next_push:
            return np.zeros(3)
        state = self.filter.at(time)
        aim = self._aim(state.mean, R_lvlh_from_body)
        self._change_phase(state.mean, aim)
        leg = self._plan.leg(self.phase)
        self._next_push = time + leg.hop
        aim = self._aim(state.mean, R_lvlh_from_body)
        if time - self._last_fix > self._plan.patience:
            # Never towards what is only remembered: stand still where it is.
            aim = state.mean[:3]
        delta_v = self._plan.push(leg, state.mean, aim, self._mean_motion)
        if np.any(delta_v):
            self.filter.push(time + AFTER_SHUTTER, delta_v)
        return delta_v

    def _aim(self, state: Array, R_lvlh_from_body: Array) -> Array:
        """(3,) where the present leg wants the chaser: its camera on the board's axis."""
        place, R_lvlh_from_board = self._board(state)
        camera = place + self._plan.leg(self.phase).distance * R_lvlh_from_board[:, 0]
        return camera - R_lvlh_from_body @ self._drawing.camera_position

    def _change_phase(self, state: Array, aim: Array) -> None:
        off = float(np.linalg.norm(state[:3] - aim))
        near_enough = off < 2.0
        if self.phase is Phase.APPROACH and near_enough and self._held >= self._plan.held_fixes:
            self.phase = Phase.FINAL
        elif self.phase is Phase.FINAL and off < self._plan.arrived:
            self.phase = Phase.HOLD
