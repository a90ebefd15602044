"""How many snapshots of an exposure it takes, each swept along its ways (``exposure_parts``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from simgl.arrays import Array
from simgl.camera.rolling_shutter import MAX_PARTS
from simgl.scene.spacecraft import SpacecraftModel
from simgl.scene.state import SceneState
from simgl.view.image_motion import (
    LARGEST_STEP,
    Pair,
    joints_against_bodies,
    shades,
    turn_of_bodies,
    turn_of_body,
    turn_of_joints,
)
from simgl.view.lamp_steps import steps_of_lamps
from simgl.view.row_clock import camera_from_body
from simgl.view.small_targets import outline_area
from simgl.view.turned_faces import snapshots_of_faces

# Turn of a joint whose parts are lit as at its middle [rad]. The light then comes from within half
# a degree of where it should, as from the Sun's own disc.
LARGEST_TURN = float(np.radians(1.0))
# Turn of a body in one snapshot [rad]. Its shading points have shadows of times spread over the
# turn (``light_spread``), but go along the whole way. The light between its surfaces is that of the
# middle: a cosine's mean over the turn is less by a 24th of its square, 0.2 %; and where a surface
# begins to be lit just then, by a 16th of it, 1.3 % of its full light.
LONGEST_TURN = float(np.radians(12.0))
# Turn over which lobes are averaged, of a body with the narrowest ones [rad]: of what flashes up
# for less time the streak is as long as its way in that turn.
_GLOSSY_TURN = float(np.radians(2.5))
# Snapshots that are enough for what passes through the beam of a lamp, and for what hides something
# else, or shades it, and goes farther than that many times ``LARGEST_STEP``. Each shows where both
# are in its middle: edges come in so many steps, with the right mean.
_ENOUGH_STEPS = 8.0
# The longest way along which one snapshot is swept [px].
LONGEST_WAY = 400.0
# The same where rows have their own times: the samples of slanting edges leave 0.016 px in each row
# of a snapshot, and longer ways show other sides of what comes past. Several snapshots even it out.
LONGEST_WAY_IN_ROWS = 60.0
# How far the ends of a way may be off an even motion through its middle to be swept as one: so many
# pixels in all, or one in so many of the way. A way that turns back is none from end to end.
MIN_BEND, BENDS = 0.25, 4.0
# The longest way of what is farther off [px]. It is not at the middle of its way in the middle of
# the exposure, when a snapshot shows other sides than are seen in the mean.
LONGEST_UNEVEN = 250.0
# Misplacement of the mean of an outline over the exposure, rms over its sides [px]. Half of the
# 0.02 px that places of rows may be off.
_MISPLACED = 0.01
# How far an arc may leave the parabola through its ends and its middle [px].
_OFF_ARC = 0.05
_ARC = 125.0
# Numbers of snapshots whose edges and middles are among the times at which outlines are compared.
_COUNTS = (1, 2, 3, 4, 6, 8, 9, 12, 18, 24, 36)
_STEPS = 144
# Every so many of these times faces are looked at.
_STRIDE = 6
# Sides of an outline, off the rows and columns of the image.
_ANGLES = 0.3 + np.arange(16) * (np.pi / 8.0)
_SIDES = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])
# More of them, to find the corners of an outline.
_FINE = np.arange(64) * (np.pi / 32.0)
_FINE_SIDES = np.stack([np.cos(_FINE), np.sin(_FINE)])
# Corners of a hull that stand for all of it.
_CORNERS = 64
# Turns before the camera below which outlines keep their corners [rad].
_MIN_TURN = 5e-3


def snapshot_count(
    states: Sequence[SceneState],
    name: str,
    exposed: float,
    blur: float,
    *,
    rows: bool,
    names: frozenset[str],
) -> tuple[int, int]:
    """Of spacecraft, and in how many parts of its time the light of each is told.

    states : at even times from the start of what rows see to its end
    exposed : share of that time in which a row sees them
    blur : how far anything moves in that share, at most [px]
    rows : whether they have their own times
    names : of the spacecraft that they show
    """
    first, middle, last = states[0], states[len(states) // 2], states[-1]
    shown = [
        replace(one, bodies={each: one.bodies[each] for each in one.bodies if each in names})
        for one in states
    ]
    lit = exposed * sum(_turn_of_light(one, other) for one, other in pairwise(shown))
    turns = exposed * sum(_turn_of_lobes(one, other) for one, other in pairwise(shown))
    way = blur / (LONGEST_WAY_IN_ROWS if rows else LONGEST_WAY)
    uneven, turning = 1.0, 1.0
    for body in shown[0].bodies:
        uneven = max(uneven, _uneven((first, middle, last), name, body, exposed))
        turning = max(turning, _of_outline(states, name, body, exposed))
    against = max(_steps_against(states, name, names), steps_of_lamps(states, names))
    steps = min(exposed * against, _ENOUGH_STEPS)
    wanted = max(lit, way, steps, uneven, turning)
    count = int(np.clip(np.ceil(wanted), 1, MAX_PARTS))
    return count, int(np.ceil(max(turns / count, 1.0)))


def _steps_against(states: Sequence[SceneState], name: str, names: frozenset[str]) -> float:
    """In so many steps what is hidden by others, or lies in their shadows, has to be told."""
    steps = joints_against_bodies(states, name, names) / LARGEST_STEP
    for one, other in combinations(states[0].bodies, 2):
        if not names & {one, other}:
            continue
        pair = Pair.of(states, name, one, other)
        hides = names >= {one, other} and pair.may_overlap
        shaded = ((one, other) if on == other else (other, one) for on in names & {one, other})
        if hides or any(shades(state, by, on) for by, on in shaded for state in states):
            steps = max(steps, pair.against / LARGEST_STEP)
    return steps


def count_behind(states: Sequence[SceneState], name: str, way: float) -> int:
    """Of what is behind spacecraft.

    states : from the start to the end
    way : how far it moves in that time, at most [px]
    """
    cameras = [state.cameras[name] for state in states]
    turns = Rotation.from_matrix([one.R_camera_from_icrf for one in cameras])
    turn = np.abs((turns[1:] * turns[:-1].inv()).as_rotvec()).sum(axis=0)
    d, focal = cameras[0].camera.detector, cameras[0].camera.focal_length_px
    # Third derivatives of a corner's way about the boresight, and of a tangent on the boresight.
    third = 0.5 * float(np.hypot(d.width, d.height)) * turn[2] ** 3
    third += 2.0 * focal * float(np.hypot(turn[0], turn[1])) ** 3
    count = max(way / LONGEST_WAY, float(np.cbrt(third / (_ARC * _OFF_ARC))))
    return int(np.clip(np.ceil(count), 1, MAX_PARTS))


def outline(state: SceneState, name: str, body: str) -> Array:
    """(n, 2) of the corners of a body's hull [px]."""
    placed, seen = state.cameras[name], state.bodies[body]
    matrix = camera_from_body(placed, seen)
    hull = seen.model.posed_mesh.hull @ matrix[:3, :3].T + matrix[:3, 3]
    return placed.camera.project(hull)


def _turn_of_light(first: SceneState, second: SceneState) -> float:
    """In so many snapshots shadows, and the light between surfaces, have to be told."""
    joints = turn_of_joints(first, second) / LARGEST_TURN
    return max(joints, turn_of_bodies(first, second) / LONGEST_TURN)


def _turn_of_lobes(first: SceneState, second: SceneState) -> float:
    """In so many parts of the time what lobes turn to the viewer has to be told."""
    turns = [
        turn_of_body(before, second.bodies[name]) / _largest_turn(before.model)
        for name, before in first.bodies.items()
    ]
    return max(turns, default=0.0)


def _largest_turn(model: SpacecraftModel) -> float:
    """Over which lobes are averaged [rad]: no more than the width of its narrowest one."""
    widths = [LONGEST_TURN]
    for material in model.materials:
        if material.roughness is not None:
            widths.append(0.0 if material.maps.law is not None else material.roughness**2)
        if material.coat is not None:
            widths.append(material.coat.roughness**2)
    return max(min(widths), _GLOSSY_TURN)


def _uneven(
    states: tuple[SceneState, SceneState, SceneState], name: str, body: str, exposed: float
) -> float:
    """How many snapshots it takes until a body moves nearly evenly in each, or not far.

    states : from the start to the end
    """
    first, middle, last = (outline(state, name, body) for state in states)
    bend = exposed**2 * np.abs(last + first - 2.0 * middle).max()
    if not np.isfinite(bend):
        return 1.0
    way = exposed * np.abs((last - first).mean(axis=0)).max()
    longest = 2.0 * exposed * max(np.abs(end - middle).max() for end in (first, last))
    even = min(np.sqrt(bend / MIN_BEND), BENDS * bend / max(way, 1e-6))
    return float(min(even, longest / LONGEST_UNEVEN))


def _of_outline(states: Sequence[SceneState], name: str, body: str, exposed: float) -> float:
    """How many snapshots it takes until the outline of a body that turns is where it should be.

    On each side the outline is the farthest corner of the hull. A snapshot takes the corners of its
    middle's outline along parabolas through their places at both ends; meanwhile others come out
    farther, arcs leave their parabolas, and faces come into view.
    """
    poses = np.array([camera_from_body(one.cameras[name], one.bodies[body]) for one in states])
    turns = Rotation.from_matrix(poses[:, :3, :3])
    if (turns[1:] * turns[:-1].inv()).magnitude().sum() * exposed < _MIN_TURN:
        return 1.0
    times = np.linspace(-1.0, 1.0, len(states))
    within = exposed * np.linspace(-1.0, 1.0, _STEPS + 1)
    posed = states[len(states) // 2].bodies[body].model.posed_mesh
    hull = posed.hull[:: int(np.ceil(len(posed.hull) / _CORNERS))]
    seen = np.tile(np.eye(4), (len(within), 1, 1))
    seen[:, :3, :3] = Slerp(times, turns)(within).as_matrix()
    seen[:, :3, 3] = np.vander(within, len(times)) @ np.linalg.solve(
        np.vander(times, len(times)), poses[:, :3, 3]
    )
    camera = states[0].cameras[name].camera
    turned = np.einsum("tij,pj->tpi", seen[:, :3, :3], hull) + seen[:, None, :3, 3]
    places = camera.project(turned.reshape(-1, 3)).reshape(*turned.shape[:2], 2)
    size = np.array([camera.detector.width, camera.detector.height])
    area, behind = float(size.prod()), not np.isfinite(places).all()
    if not behind:
        area = min(area, outline_area(places[_STEPS // 2]))
    wanted = snapshots_of_faces(posed, camera, seen[::_STRIDE], area)
    if behind:
        return wanted
    in_view = np.all((places > 0.0) & (places < size), axis=-1)
    wanted = max(wanted, _of_arcs(places, in_view))
    for count in _COUNTS:
        if np.sqrt(np.mean(_misplaced(places, in_view, count) ** 2)) < _MISPLACED:
            return max(float(count), wanted)
    return float(MAX_PARTS)


def _of_arcs(places: Array, in_view: Array) -> float:
    """How many snapshots it takes until corners leave the parabolas of their ways by little.

    The third derivative d of a place leaves (t^3 - t / 4) d / 6 of t from -1/2 to 1/2, d over
    ``_ARC`` at most, and the cube of their number less of that in each of several snapshots.
    """
    step = _STEPS // 12
    third = np.linalg.norm(np.diff(places[::step], n=3, axis=0), axis=-1) * 12.0**3
    seen = in_view[::step][: len(third)]
    return float(np.cbrt((third * seen).max() / (_ARC * _OFF_ARC)))


def _misplaced(places: Array, in_view: Array, count: int) -> Array:
    """How far the means of the sides of an outline are off in so many snapshots, (sides,) [px].

    places : (times, corners, 2) [px]
    in_view : (times, corners), whether they are in the image
    """
    step = _STEPS // count
    outermost = (places @ _SIDES).max(axis=1)
    error = np.zeros(_SIDES.shape[1])
    for start in range(0, _STEPS, step):
        middle = start + step // 2
        corners = np.unique((places[middle] @ _FINE_SIDES).argmax(axis=0))
        seen = in_view[middle, (places[middle] @ _SIDES).argmax(axis=0)]
        times = np.arange(start, start + step + 1)
        share = ((times - middle) / step)[:, None, None]
        first, still, last = (places[time, corners] for time in (start, middle, start + step))
        paths = still + share * (last - first) + 2.0 * share**2 * (last + first - 2.0 * still)
        missed = outermost[times] - (paths @ _SIDES).max(axis=1)
        # Both ends count half.
        missed[[0, -1]] *= 0.5
        error += seen * missed.sum(axis=0) / _STEPS
    return error
