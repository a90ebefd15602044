"""What the lamps of a scene are to one camera, and what their shadow maps hold.

Lamp axes: z along the beam, x and y across. A map is a perspective image from the lamp, cut to
the part of the beam in which there are spacecraft; it holds 1 / z, which is linear over the map
for every plane and keeps its digits at any distance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simgl.arrays import Array, Array32
from simgl.physics.frames import camera_from_directions, moved
from simgl.scene.lamps import Lamp, LampState
from simgl.scene.state import BodyState, CameraState, SceneState
from simgl.view.lamp_steps import from_lamp
from simgl.view.shadow_views import Caster, steady_pose

# Texels along a map's edge: 5 mm on a spacecraft of 5 m.
MAP_SIZE = 1024
# Nothing closer to a lamp than this casts: it would be the lamp's own housing [m].
_NEAREST = 0.01
# Parts of the carrier closer than so many radii of the aperture cast hard shadows.
_HARD_RADII = 12.5
# The filter looks two texels beyond a receiver.
_MARGIN = 1.0 + 8.0 / MAP_SIZE
# Maps are no wider to either side [rad].
_WIDEST = 1.5
# Motion below which a lamp stands still before the camera [m and rad].
_STILL = 1e-7


@dataclass(frozen=True, kw_only=True, eq=False)
class LampMotion:
    """How a lamp moves before the camera while the rows of a part of an image are exposed.

    place : (2, 3) float32, a time and its square (``row_clock``) add so much to its place [m]
    axis : (2, 3) float32, and to the axis of its beam, before that is made unit again
    """

    place: Array32
    axis: Array32


@dataclass(frozen=True, kw_only=True, eq=False)
class LampView:
    """A lamp that lights something, in camera axes.

    key : equal keys mean equal maps
    place : (3,) float32 [m]
    axis : (3,) float32 unit, of the beam
    column, row : (4,) float32 x, y, z, w of the map's texel at v from the lamp:
        v @ (x, y, z) / (v @ axis) + w
    intensity : (4,) float32 [W sr-1]
    hard_near : casters of a larger 1 / z cast hard shadows [m-1]; 0 where all do, for the aperture
        blurs none by a texel; no larger than the nearest caster needs
    motion : None where it stands still for all rows
    """

    lamp: Lamp
    key: bytes
    casters: tuple[Caster, ...]
    place: Array32
    axis: Array32
    column: Array32
    row: Array32
    intensity: Array32
    hard_near: float
    motion: LampMotion | None = None


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """A body in the beam: its box in tangents of angles off the axis, and its depths.

    cut : whether a part of it is too close to the lamp to cast
    """

    body: BodyState
    R_lamp_from_body: Array
    offset: Array
    low: Array
    high: Array
    nearest: float
    far: float
    cut: bool


def lamp_views(
    state: SceneState,
    camera: CameraState,
    ends: Sequence[tuple[SceneState, CameraState]] = (),
) -> tuple[LampView, ...]:
    """The lamps that light some spacecraft of the scene.

    ends : the same at the times -1 and 1 of the rows that are exposed; none where all see the state
    """
    views = []
    for index, lamp in enumerate(state.lamps):
        if not lamp.lamp.power.any():
            continue
        carrier = state.bodies[lamp.lamp.spacecraft].pose.R_icrf_from_body
        others = [one.lamps[index] for one, _ in ends]
        drift = 0.0
        for other, (end, _) in zip(others, ends, strict=True):
            drift = max(drift, _drift(lamp, state, other, end))
        view = lamp_view(lamp, carrier, state, camera, drift)
        if view is not None:
            cameras = [one for _, one in ends]
            views.append(replace(view, motion=_motion(lamp, camera, others, cameras)))
    return tuple(views)


def _drift(lamp: LampState, state: SceneState, other: LampState, end: SceneState) -> float:
    """How far spacecraft come towards the axis of a beam between two states, or leave it [rad]."""
    ways = [0.0]
    for name, body in state.bodies.items():
        before, after = from_lamp(lamp, body)[0], from_lamp(other, end.bodies[name])[0]
        ways.append(float(np.abs(after - before).max()))
    return max(ways)


def _motion(
    lamp: LampState,
    camera: CameraState,
    others: Sequence[LampState],
    cameras: Sequence[CameraState],
) -> LampMotion | None:
    """Through three places and directions; none where there are no others, or it stands still.

    others, cameras : at the times -1 and 1
    """
    if not others:
        return None
    (before, after), (camera_before, camera_after) = others, cameras
    seen = (camera_before, before), (camera, lamp), (camera_after, after)
    places = [c.R_camera_from_icrf @ (one.position - c.position) for c, one in seen]
    axes = [c.R_camera_from_icrf @ one.direction for c, one in seen]
    place, axis = (
        np.array([0.5 * (last - first), 0.5 * (last + first) - middle])
        for first, middle, last in (places, axes)
    )
    if max(np.abs(place).max(), np.abs(axis).max()) < _STILL:
        return None
    return LampMotion(place=_float32(place), axis=_float32(axis))


def lamp_view(
    lamp: LampState, carrier: Array, state: SceneState, camera: CameraState, drift: float = 0.0
) -> LampView | None:
    """A lamp before a camera; None where it lights no spacecraft of the scene.

    carrier : (3, 3) R_icrf_from_body of what carries it
    drift : so far from the beam spacecraft may come into it meanwhile [rad]
    """
    # Any turn about the axis serves; one tied to the carrier keeps the map while both stand still.
    # Rounded, for of two axes that are both across the beam the first serves.
    up = carrier[:, int(np.argmin(np.round(np.abs(carrier.T @ lamp.direction), 6)))]
    R_lamp_from_icrf = camera_from_directions(lamp.direction, up)
    near = max(_NEAREST, lamp.lamp.radius)
    carrying = state.bodies.get(lamp.lamp.spacecraft)
    seen = []
    for body in state.bodies.values():
        # The aperture of a lamp that looks along its carrier would lie half within it.
        soft_from = _HARD_RADII * lamp.lamp.radius if body is carrying else near
        in_beam = _in_beam(body, lamp, R_lamp_from_icrf, near, soft_from, drift)
        if in_beam is not None:
            seen.append(in_beam)
    if not seen:
        return None
    low = np.min([s.low for s in seen], axis=0)
    high = np.max([s.high for s in seen], axis=0)
    middle, half = 0.5 * (low + high), 0.5 * _MARGIN * (high - low)
    far = max(s.far for s in seen) * 1.001
    # As near as the casters allow: depth is as fine in 1 / z as the range is short.
    near = max(near, 0.999 * min(s.nearest for s in seen))
    clip_from_lamp = np.zeros((4, 4))
    clip_from_lamp[0, [0, 2]] = 1.0 / half[0], -middle[0] / half[0]
    clip_from_lamp[1, 1:3] = 1.0 / half[1], -middle[1] / half[1]
    clip_from_lamp[2, 2:] = (far + near) / (far - near), -2.0 * far * near / (far - near)
    clip_from_lamp[3, 2] = 1.0
    casters = tuple(_caster(s, clip_from_lamp) for s in seen)
    R_camera_from_lamp = camera.R_camera_from_icrf @ R_lamp_from_icrf.T
    texels = 0.5 * MAP_SIZE / half
    first = 0.5 * MAP_SIZE * (1.0 - middle / half)
    hard_near = 1.001 / min(s.nearest for s in seen)
    if any(s.body is carrying for s in seen):
        hard_near = min(hard_near, 1.0 / (_HARD_RADII * lamp.lamp.radius))
    # Between the nearest and the farthest body, as seen from the two ends of the aperture.
    depths = hard_near - 1.0 / far
    if lamp.lamp.radius * depths * texels.max() < 1.0:
        hard_near = 0.0
    return LampView(
        lamp=lamp.lamp,
        hard_near=hard_near,
        key=b"".join((*(c.key for c in casters), np.float32(hard_near).tobytes())),
        casters=casters,
        place=_float32(camera.R_camera_from_icrf @ (lamp.position - camera.position)),
        axis=_float32(R_camera_from_lamp[:, 2]),
        column=_float32(np.append(R_camera_from_lamp[:, 0] * texels[0], first[0])),
        row=_float32(np.append(R_camera_from_lamp[:, 1] * texels[1], first[1])),
        intensity=_float32(lamp.lamp.intensity),
    )


def _float32(values: Array) -> Array32:
    return np.asarray(values, dtype=np.float32)


def _in_beam(
    body: BodyState,
    lamp: LampState,
    R_lamp_from_icrf: Array,
    near: float,
    soft_from: float,
    drift: float,
) -> _Seen | None:
    """A body that the lamp lights, or that shades some of the aperture for what it lights.

    soft_from : what is nearer than this casts hard shadows [m]
    drift : what is so far from the beam counts as within it [rad]
    """
    R, offset = steady_pose(body.pose, R_lamp_from_icrf, lamp.position)
    mesh = body.model.posed_mesh
    points = hull = moved(mesh.hull, R, offset)
    front = hull[:, 2] >= near
    if not front.any():
        return None
    cut = not front.all()
    if cut:
        # Where edges of the hull cross the nearest plane.
        edges = mesh.hull_edges[front[mesh.hull_edges].sum(axis=1) == 1]
        start, end = hull[edges[:, 0]], hull[edges[:, 1]]
        share = (near - start[:, 2:]) / (end[:, 2:] - start[:, 2:])
        points = np.concatenate([hull[front], start + share * (end - start)])
    tangents = points[:, :2] / points[:, 2:]
    nearest, far = float(points[:, 2].min()), float(max(points[:, 2].max(), 2.0 * near))
    outer = lamp.lamp.half_angle + lamp.lamp.edge
    widest = float(np.tan(max(outer, min(outer + drift, _WIDEST))))
    if far > soft_from:
        # Lines from what is lit to the aperture leave the beam by so much.
        widest += lamp.lamp.radius / max(nearest, soft_from)
    low = np.maximum(tangents.min(axis=0), -widest)
    high = np.minimum(tangents.max(axis=0), widest)
    if np.any(high <= low):
        return None
    return _Seen(
        body=body,
        R_lamp_from_body=R,
        offset=offset,
        low=low,
        high=high,
        nearest=nearest,
        far=far,
        cut=cut,
    )


def _caster(seen: _Seen, clip_from_lamp: Array) -> Caster:
    lamp_from_body = np.eye(4)
    lamp_from_body[:3, :3], lamp_from_body[:3, 3] = seen.R_lamp_from_body, seen.offset
    clip = _float32(clip_from_lamp @ lamp_from_body)
    model = seen.body.model
    # Light that comes from within a solid, or from where it is cut, meets its walls from behind.
    return Caster(model=model, clip_from_body=clip, both_sides=model.open_sheets or seen.cut)
