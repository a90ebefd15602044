"""When the rows of an image are exposed, and where what moves meanwhile is at its row's own time.

Times are counted from the middle of a part of the exposure, in halves of its length: rows from the
part's first to its last see times from -1 to 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from simgl.arrays import Array
from simgl.camera.camera import Camera
from simgl.camera.pinhole_fields import PinholeField
from simgl.camera.row_curve import row_curve, rows_on
from simgl.motion.joints import relative_motion
from simgl.scene.posed_mesh import PosedMesh
from simgl.scene.state import BodyState, CameraState

# Steps of Newton's method, from an error of half the motion within the rows.
_STEPS = 4
# Rows far from the part's own are not followed farther than this.
_FARTHEST = 2.0
# Least rate at which a row's time runs ahead of what moves along with the rows.
_SLOWEST = 0.25
# Rates, per metre and radian, below which places of bodies are no more than rounded.
_STILL = 1e-7
# Deviation of the image of an edge, whose ends are right, from a straight line [px].
_BENT = 0.02
# When the camera's place is looked at from which triangles may be seen.
_CAMERA_TIMES = (-1.0, -0.5, 0.0, 0.5, 1.0)
# Length of the edges by which that is told [px], and their directions.
_SHORT_PX = 16.0
_WAYS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if way > (0.0, 0.0, 0.0)])
_WAYS /= np.linalg.norm(_WAYS, axis=1, keepdims=True)


@dataclass(frozen=True)
class RowClock:
    """The rows of a part of the image, exposed one after the other.

    first, end : of the rows
    """

    first: int
    end: int

    @property
    def middle(self) -> float:
        """Row coordinate of the part's middle."""
        return 0.5 * (self.first + self.end)

    def curve(self, camera: Camera, field: PinholeField) -> Array:
        """The time as a polynomial of the line of sight, as ``row_curve`` has the row."""
        curve = row_curve(camera, field).copy()
        curve[0] -= self.middle
        return np.asarray(curve * (2.0 / (self.end - self.first)))

    def line(self, camera: Camera) -> tuple[float, float]:
        """Slope and offset of the time over y / z of a line of sight, camera axes."""
        per_row = 2.0 / (self.end - self.first)
        _, focal, middle = camera.intrinsics[1]
        return per_row * focal, per_row * (middle - self.middle)


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseMotion:
    """How a spacecraft moves before the camera during a part of an exposure.

    pose, rate, change, third : (4, 4), camera_from_body is pose + time (rate + time (change + time
        third))
    light_turn : (3,) rotation vector, camera axes: by so much a time turns directions that stand
        still in space [rad]
    line : slope and offset of a row's time over y / z of its lines of sight, by a pinhole
    curve : coefficients of the time as ``row_curve`` has those of the row; None for a pinhole
    joint_rates : (groups, 4, 4) rate of places of the rigid groups, body axes; None where no joint
        moves
    turn : between the images of two rows, of edges against each other [rad]
    bulge : how far it is off an even motion at the times -1 and 1 [px]
    bend : largest length of an edge whose image stays straight [m]
    """

    pose: Array
    rate: Array
    change: Array
    third: Array
    light_turn: Array
    line: tuple[float, float]
    curve: Array | None
    joint_rates: Array | None
    turn: float
    bulge: float
    bend: float

    @property
    def moves(self) -> bool:
        """Whether it does."""
        largest = max(float(np.abs(self.rate).max()), float(np.abs(self.change).max()))
        return self.joint_rates is not None or largest > _STILL

    @property
    def variant(self) -> tuple[str, ...]:
        """What shaders of this motion are defined by."""
        return ("MOVING",) if self.curve is None else ("MOVING", "BENT_ROWS")

    def at(self, time: float) -> Array:
        """(4, 4) camera_from_body at a time."""
        return self.pose + time * (self.rate + time * (self.change + time * self.third))

    @property
    def camera_in_body(self) -> tuple[Array, float]:
        """Places (n, 3) of the camera while the rows are exposed, body axes, and how far it is off
        straight lines between them [m]."""
        poses = np.array([self.at(time) for time in _CAMERA_TIMES])
        places = -np.linalg.solve(poses[:, :3, :3], poses[:, :3, 3:])[..., 0]
        # An arc leaves its chords by an eighth of its second difference; twice that where it is
        # uneven.
        bends = np.linalg.norm(places[2:] - 2.0 * places[1:-1] + places[:-2], axis=1)
        return places, 0.25 * float(bends.max())

    def sag(self, camera: Camera, extent: float) -> float:
        """How far an outline may bulge between points of it that are far apart [px].

        extent : of the outline [px]
        """
        uneven = _FARTHEST**2 * self.bulge
        return 1.0 + 0.25 * self.turn * min(extent, camera.detector.height) ** 2 + uneven

    def row_times(self, places: Array) -> Array:
        """(n,) when the rows are exposed that places (n, 3), body axes [m], are seen in then."""
        still, rate, change, third = self._of(places)
        slope, _ = self.line
        times = np.zeros(len(places))
        for _ in range(_STEPS):
            t = times[:, None]
            places_seen = still + t * (rate + t * (change + t * third))
            _, y, z = places_seen.T
            _, v, w = (rate + t * (2.0 * change + 3.0 * t * third)).T
            z = np.maximum(z, 1e-3)
            runs = 1.0 - slope * (v * z - y * w) / (z * z)
            seen = self.times_of(places_seen)
            step = (seen - times) / np.maximum(runs, _SLOWEST)
            times = np.clip(times + step, -_FARTHEST, _FARTHEST)
        return times

    def times_of(self, sights: Array) -> Array:
        """(n,) when the rows are exposed that lines of sight (n, 3) end in, camera axes."""
        if self.curve is not None:
            return rows_on(self.curve, sights)
        slope, offset = self.line
        return np.asarray(slope * sights[:, 1] / np.maximum(sights[:, 2], 1e-3) + offset)

    def moved(self, places: Array) -> Array:
        """(n, 3) places, body axes [m], each at its row's own time, camera axes [m]."""
        t = self.row_times(places)[:, None]
        still, rate, change, third = self._of(places)
        return np.asarray(still + t * (rate + t * (change + t * third)))

    def _of(self, places: Array) -> list[Array]:
        """What places (n, 3), body axes, are in camera axes: (n, 3) for each power of the time."""
        body = np.column_stack([places, np.ones(len(places))])
        return [body @ m[:3].T for m in (self.pose, self.rate, self.change, self.third)]


def camera_from_body(camera: CameraState, body: BodyState) -> Array:
    """(4, 4) from body axes to camera axes [m]."""
    matrix = np.eye(4)
    matrix[:3, :3] = camera.R_camera_from_icrf @ body.pose.R_icrf_from_body
    matrix[:3, 3] = camera.R_camera_from_icrf @ (body.pose.position - camera.position)
    return matrix


def pose_motion(
    clock: RowClock,
    camera: Camera,
    field: PinholeField | None,
    seen: Sequence[tuple[CameraState, BodyState]],
) -> PoseMotion:
    """The motion of a body through its states at the times -1, 0 and 1.

    camera, field : whose rows they are, and the part of its field that is drawn; None for all of a
        pinhole's
    seen : through that part's pinhole
    """
    pose, (rate, change, third) = camera_from_body(*seen[1]), _powers(seen)
    meshes = [body.model.posed_mesh for _, body in seen]
    joint_rates = _joint_rates(*meshes)
    nearest = _nearest(pose, meshes[1])
    turn = float(np.linalg.norm(rate[:3, :3], 2)) + float(np.linalg.norm(rate[:3, 3])) / nearest
    joint_turn = 0.0
    if joint_rates is not None:
        joint_turn = float(np.linalg.norm(joint_rates[:, :3, :3], 2, axis=(1, 2)).max())
    turn += joint_turn
    count = clock.end - clock.first
    per_row = max(2.0 * turn / count, 1e-12)
    # What goes with the square of the time [px]: over n rows a middle stays behind by the square of
    # the share of them.
    bulge = float(np.linalg.norm(change[:3, 3]))
    bulge += meshes[1].radius * float(np.linalg.norm(change[:3, :3], 2))
    bulge = max(bulge * camera.focal_length_px / nearest, 1e-12)
    motion = PoseMotion(
        pose=pose,
        rate=rate,
        change=change,
        third=third,
        light_turn=_Turn.through([one.R_camera_from_icrf for one, _ in seen]).rate,
        line=clock.line(camera if field is None else field.pinhole),
        curve=None if field is None else clock.curve(camera, field),
        joint_rates=joint_rates,
        turn=per_row,
        bulge=bulge,
        bend=np.inf,
    )
    pinhole = camera if field is None else field.pinhole
    bent = _bent(motion, pinhole, _box(clock, pinhole, field, meshes[1], pose), meshes[1])
    # Over n rows the middle of what turns stays behind by a quarter of the turn times n^2.
    bent += 0.5 * joint_turn / count * (camera.focal_length_px / nearest) ** 2
    return replace(motion, bend=float(np.sqrt(_BENT / max(bent, 1e-12))))


def _box(
    clock: RowClock, pinhole: Camera, field: PinholeField | None, mesh: PosedMesh, pose: Array
) -> tuple[Array, Array]:
    """Columns and rows of a pinhole's image between which a body is seen there [px].

    pose : (4, 4) camera_from_body
    """
    low, high = np.zeros(2), np.array([pinhole.detector.width, pinhole.detector.height], float)
    if field is None:
        low[1], high[1] = clock.first, clock.end
    hull = pinhole.project(mesh.hull @ pose[:3, :3].T + pose[:3, 3])
    if np.isfinite(hull).all():
        low, high = (np.clip(one, low, high) for one in (hull.min(axis=0), hull.max(axis=0)))
    return low, high


def _bent(motion: PoseMotion, pinhole: Camera, box: tuple[Array, Array], mesh: PosedMesh) -> float:
    """How far the middle of an edge's image is off the line through its ends, at most, for the
    square of the edge's length [px m-2].

    Of short edges in many directions, at several places of an image and depths of a body.

    box : that is seen of the image [px]
    """
    depths = mesh.hull @ motion.pose[2, :3] + motion.pose[2, 3]
    nearest = max(float(depths.min()), 0.1 * mesh.radius)
    shares = np.stack(np.meshgrid(*3 * [[0.0, 0.5, 1.0]], indexing="ij"), axis=-1).reshape(-1, 3)
    sights = pinhole.rays(box[0] + shares[:, :2] * (box[1] - box[0]))
    depth = nearest + shares[:, 2] * (max(float(depths.max()), nearest) - nearest)
    seen = sights * (depth / sights[:, 2])[:, None]
    back = np.linalg.inv([motion.at(time) for time in motion.times_of(seen)])
    places = np.einsum("nij,nj->ni", back[:, :3, :3], seen) + back[:, :3, 3]
    half = 0.5 * _SHORT_PX / pinhole.focal_length_px * depth
    ways = np.einsum("nij,kj->kni", back[:, :3, :3], _WAYS) * half[:, None]
    ends = [motion.moved((places + side * ways).reshape(-1, 3)) for side in (-1.0, 0.0, 1.0)]
    a, b, c = (pinhole.focal_length_px * p[:, :2] / np.maximum(p[:, 2:], 1e-3) for p in ends)
    along, off = c - a, b - a
    # Of edges that are seen end on, no more than from their middle.
    area = np.abs(along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0])
    sag = area / np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    sag = np.minimum(sag, np.linalg.norm(off - 0.5 * along, axis=1))
    return float((sag / np.tile((2.0 * half) ** 2, len(_WAYS))).max())


@dataclass(frozen=True)
class _Turn:
    """A turn (3, 3) through three at the times -1, 0 and 1, about axes that change evenly.

    rate, change : rotation vector of a time, and of its square [rad]
    """

    middle: Array
    rate: Array
    change: Array

    @classmethod
    def through(cls, turns: Sequence[Array]) -> _Turn:
        before, middle, after = turns
        back, on = (Rotation.from_matrix(R @ middle.T).as_rotvec() for R in (before, after))
        return cls(middle, 0.5 * (on - back), 0.5 * (on + back))

    def at(self, time: float) -> Array:
        vector = time * (self.rate + time * self.change)
        return np.asarray(Rotation.from_rotvec(vector).as_matrix() @ self.middle)


def _powers(seen: Sequence[tuple[CameraState, BodyState]]) -> tuple[Array, Array, Array]:
    """What the time, its square and its cube add to a body's pose before a camera, (4, 4) each.

    Fitted, as both turn, from -1 to 1: of turns of 30 deg the next powers leave 5e-5 rad.
    """
    turns = _Turn.through([camera.R_camera_from_icrf for camera, _ in seen])
    of_body = _Turn.through([body.pose.R_icrf_from_body for _, body in seen])
    first, offset, last = (body.pose.position - camera.position for camera, body in seen)
    speed, bend = 0.5 * (last - first), 0.5 * (last + first) - offset

    def at(time: float) -> Array:
        matrix = np.eye(4)
        matrix[:3, :3] = of_body.at(time)
        matrix[:3, 3] = offset + time * (speed + time * bend)
        turn = np.eye(4)
        turn[:3, :3] = turns.at(time)
        return np.asarray(turn @ matrix)

    # Odd and even parts at half the time and at its end.
    odd = [0.5 * (at(t) - at(-t)) for t in (0.5, 1.0)]
    even = [0.5 * (at(t) + at(-t)) - at(0.0) for t in (0.5, 1.0)]
    third = (odd[1] - 2.0 * odd[0]) / 0.75
    return odd[1] - third, (even[1] + 0.25 * even[0]) / (1.0 + 0.25**2), third


def _joint_rates(before: PosedMesh, mesh: PosedMesh, after: PosedMesh) -> Array | None:
    if before.motion is None and mesh.motion is None and after.motion is None:
        return None
    rest = np.tile(np.eye(4), (len(mesh.joints) + 1, 1, 1))
    first, middle, last = (rest if m.motion is None else m.motion for m in (before, mesh, after))
    rates = 0.5 * (relative_motion(middle, last) - relative_motion(middle, first))
    return rates if rates.any() else None


def _nearest(pose: Array, mesh: PosedMesh) -> float:
    """Depth of a body's surface before the camera, at least [m]."""
    depths = mesh.hull @ pose[2, :3] + pose[2, 3]
    # Where the camera is within its hull, a tenth of its radius stands for how near it may be.
    return max(float(depths.min()), 0.1 * mesh.radius)
