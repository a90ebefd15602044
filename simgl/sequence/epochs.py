"""Epochs of a sequence: regular, at random, or where something begins.

Events are found by looking at the scene in steps and closing in on each change by bisection, so one
that begins and ends within a step is missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgl.errors import ConfigError
from simgl.scenario.scenario import Scenario
from simgl.scene.state import CameraState, SceneState
from simgl.sequence.events import Event

# An event's epoch is this close to the change [ns].
EVENT_TOLERANCE_NS = 1_000_000
# As many frames as one sequence may have: a year at one a minute, twice.
MOST_FRAMES = 1_000_000


def regular(start_ns: int, stop_ns: int, step_ns: int) -> list[int]:
    """Epochs [TAI ns] from start to stop, the stop too where a step ends there."""
    count = (stop_ns - start_ns) // step_ns + 1
    if count > MOST_FRAMES:
        raise ConfigError("sequence", "step", f"gives {count} frames, at most {MOST_FRAMES}")
    return [start_ns + index * step_ns for index in range(count)]


def spread(start_ns: int, stop_ns: int, count: int) -> list[int]:
    """So many epochs [TAI ns] at equal steps, both ends among them."""
    if count == 1:
        return [start_ns]
    return [start_ns + round((stop_ns - start_ns) * i / (count - 1)) for i in range(count)]


def at_random(start_ns: int, stop_ns: int, count: int, seed: int) -> list[int]:
    """So many epochs [TAI ns], uniform between two, in order; equal seeds give equal ones."""
    drawn = np.random.default_rng(seed).integers(start_ns, stop_ns, size=count, endpoint=True)
    return sorted(int(value) for value in drawn)


def events(
    scenario: Scenario,
    kind: Event,
    camera: str,
    target: str,
    start_ns: int,
    stop_ns: int,
    step_ns: int,
) -> list[int]:
    """Epochs [TAI ns] between two at which something begins."""
    begins = _condition(kind, camera, target)

    def holds(tai_ns: int) -> bool:
        return begins(scenario.at(tai_ns))

    found = []
    before, at = start_ns, holds(start_ns)
    # The last step may be shorter than the others.
    looks = dict.fromkeys([*regular(start_ns, stop_ns, step_ns)[1:], stop_ns])
    for now in looks:
        there = holds(now)
        if there and not at:
            found.append(_closed_in(holds, before, now))
        before, at = now, there
    return found


def _closed_in(holds: Callable[[int], bool], before: int, after: int) -> int:
    """The first instant known to hold, between one that does not and one that does."""
    while after - before > EVENT_TOLERANCE_NS:
        middle = (before + after) // 2
        before, after = (before, middle) if holds(middle) else (middle, after)
    return after


def _condition(kind: Event, camera: str, target: str) -> Callable[[SceneState], bool]:
    def sunlight(state: SceneState) -> float:
        return state.sunlit_share(state.bodies[target].pose.position)

    conditions: dict[Event, Callable[[SceneState], bool]] = {
        Event.ECLIPSE_ENTRY: lambda state: sunlight(state) < 0.99,
        Event.UMBRA_ENTRY: lambda state: sunlight(state) < 0.01,
        Event.UMBRA_EXIT: lambda state: sunlight(state) > 0.01,
        Event.ECLIPSE_EXIT: lambda state: sunlight(state) > 0.99,
        Event.SUN_IN_VIEW: lambda state: sun_in_view(state, state.cameras[camera]),
        Event.LIMB_BEHIND_TARGET: lambda state: limb_behind(state, state.cameras[camera], target),
    }
    return conditions[kind]


def sun_in_view(state: SceneState, camera: CameraState) -> bool:
    """Whether the Sun's disc touches the picture; the Earth and spacecraft may still hide it."""
    sun = state.sun.seen_from(camera.position)
    x, y, z = camera.R_camera_from_icrf @ sun.direction_icrf
    if z <= 0.0:
        return False
    detector, focal = camera.camera.detector, camera.camera.focal_length_px
    half = 0.5 * np.array([detector.width, detector.height]) / focal
    nearest = np.array([*np.clip([x / z, y / z], -half, half), 1.0])
    off = np.linalg.norm(np.cross(nearest, [x, y, z])) / np.linalg.norm(nearest)
    return bool(off <= np.sin(sun.angular_radius))


def limb_behind(state: SceneState, camera: CameraState, target: str) -> bool:
    """Whether the Earth's limb lies within the target's bounding sphere, as the camera sees it."""
    if state.earth is None:
        return False
    radii = np.array(state.earth.earth.radii)
    scale = radii[0] / radii
    turn = state.earth.R_itrf_from_icrf
    eye = scale * (turn @ (camera.position - state.earth.position))
    body = state.bodies[target]
    mesh = body.model.posed_mesh
    centre = body.pose.position + body.pose.R_icrf_from_body @ mesh.centre - camera.position
    distance = float(np.linalg.norm(centre))
    if distance <= mesh.radius:
        return False
    # In axes where the Earth is a sphere; its flattening changes an angle by 0.3 % of itself.
    line = scale * (turn @ centre)
    height = float(np.linalg.norm(eye))
    if height <= radii[0]:
        return False
    off_nadir = np.arccos(np.clip(-np.dot(eye, line) / (height * np.linalg.norm(line)), -1.0, 1.0))
    limb = np.arcsin(radii[0] / height)
    return bool(abs(off_nadir - limb) <= np.arcsin(mesh.radius / distance))
