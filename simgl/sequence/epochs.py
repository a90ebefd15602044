"""Epochs of a sequence: regular, at random, or where an event begins.

Events are found by evaluating the scene in steps and bisecting each change, so one that begins and
ends within a step is missed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simgl.config.validation import exactly_one
from simgl.errors import ConfigError, did_you_mean
from simgl.physics.ephemeris import tai_ns_from_utc
from simgl.scenario.scenario import Scenario
from simgl.scene.state import CameraState, SceneState
from simgl.sequence.epoch_options import EpochOptions, Event, EventOptions, SpanOptions
from simgl.value_checks import LARGEST_TIME, check_choice, check_integer

_COMMAND_LINE = "command line"

# An event's epoch is this close to the change [ns].
EVENT_TOLERANCE_NS = 1_000_000
# All years that a scenario may lie in [s].
LONGEST_SPAN = 4.1e9
# Of one sequence: a year at one a minute, twice.
MAX_FRAMES = 1_000_000


def epoch_at(scenario: Scenario, at: str | None) -> int:
    """TAI ns of the option ``--at`` in UTC, or the scenario's own epoch; raises ConfigError."""
    return scenario.epoch_tai_ns if at is None else _time("--at", at)


def span(scenario: Scenario, options: SpanOptions) -> tuple[int, int]:
    """First and last instant [TAI ns]; raises ConfigError where the options contradict."""
    start = scenario.epoch_tai_ns if options.start is None else _time("--from", options.start)
    ends = {"--to": options.stop, "--duration": options.duration}
    exactly_one(ends, _COMMAND_LINE, "a trajectory")
    if options.stop is not None:
        stop = _time("--to", options.stop)
    else:
        assert options.duration is not None
        if not 0.0 <= options.duration <= LONGEST_SPAN:
            problem = f"must lie in 0..{LONGEST_SPAN:g} s, got {options.duration:g}"
            raise ConfigError(_COMMAND_LINE, "--duration", problem)
        stop = start + round(options.duration * 1e9)
    if stop < start:
        raise ConfigError(_COMMAND_LINE, "--to", "must not be earlier than the start")
    return start, stop


def epochs(
    scenario: Scenario, options: EpochOptions, camera: str, event: EventOptions = EventOptions()
) -> list[int]:
    """The epochs asked for [TAI ns], in order.

    camera : whose view an event is about
    Raises ConfigError where the options contradict each other, or the event does not occur.
    """
    ways = {
        "--step": options.step,
        "--count": options.count,
        "--random": options.random,
        "--event": event.event,
    }
    exactly_one(ways, _COMMAND_LINE, "a trajectory")
    start, stop = span(scenario, options)
    for name, value in (("--count", options.count), ("--random", options.random)):
        if value is not None and not 1 <= value <= MAX_FRAMES:
            problem = f"must lie in 1..{MAX_FRAMES}, got {value}"
            raise ConfigError(_COMMAND_LINE, name, problem)
    if options.count is not None:
        return spread(start, stop, options.count)
    if options.random is not None:
        return at_random(start, stop, options.random, options.seed)
    if options.step is not None:
        return regular(start, stop, step_ns("--step", options.step))
    assert event.event is not None
    step = step_ns("--search-step", event.search_step)
    target = _target(scenario, event.target)
    begins = event_epochs(scenario, event.event, camera, target, start, stop, step)
    if not begins:
        problem = f"begins nowhere in the span: {event.event.value}"
        raise ConfigError(_COMMAND_LINE, "--event", problem)
    return begins


def _time(option: str, utc: str) -> int:
    try:
        return tai_ns_from_utc(utc)
    except ValueError as error:
        raise ConfigError(_COMMAND_LINE, option, str(error)) from None


def step_ns(option: str, seconds: float) -> int:
    """Nanoseconds of an option that is a step between epochs; raises ConfigError."""
    if not seconds >= 1e-6:
        raise ConfigError(_COMMAND_LINE, option, f"must be at least 1e-6 s, got {seconds:g}")
    if seconds > LONGEST_SPAN:
        problem = f"must be at most {LONGEST_SPAN:g} s, got {seconds:g}"
        raise ConfigError(_COMMAND_LINE, option, problem)
    return round(seconds * 1e9)


def _target(scenario: Scenario, target: str | None) -> str:
    names = list(scenario.models)
    if target is None:
        if not names:
            raise ConfigError(str(scenario.source), "spacecraft", "is missing; an event needs one")
        return names[0]
    if target not in names:
        problem = f'"{target}" is not in the scenario; {did_you_mean(target, names)}'
        raise ConfigError(_COMMAND_LINE, "--target", problem)
    return target


def regular(start_ns: int, stop_ns: int, step_ns: int) -> list[int]:
    """Epochs [TAI ns] from start to stop, including the stop where a step ends there."""
    count = (stop_ns - start_ns) // step_ns + 1
    if count > MAX_FRAMES:
        raise ConfigError("sequence", "step", f"gives {count} frames, at most {MAX_FRAMES}")
    return [start_ns + index * step_ns for index in range(count)]


def spread(start_ns: int, stop_ns: int, count: int) -> list[int]:
    """Epochs [TAI ns] at equal steps, including both ends."""
    if count == 1:
        return [start_ns]
    return [start_ns + round((stop_ns - start_ns) * i / (count - 1)) for i in range(count)]


def at_random(start_ns: int, stop_ns: int, count: int, seed: int) -> list[int]:
    """Epochs [TAI ns] uniform between two, in order; equal seeds give equal epochs."""
    drawn = np.random.default_rng(seed).integers(start_ns, stop_ns, size=count, endpoint=True)
    return sorted(int(value) for value in drawn)


def event_epochs(
    scenario: Scenario,
    kind: Event,
    camera: str,
    target: str,
    start_ns: int,
    stop_ns: int,
    step_ns: int,
) -> list[int]:
    """Epochs [TAI ns] between two at which the event begins.

    scenario : whose laws of motion apply
    kind : of the event
    camera, target : names of the camera and of the spacecraft that the event is about
    start_ns, stop_ns : first and last time that is tested [TAI ns]
    step_ns : between two tests of the condition; an event that ends sooner may be missed

    Raises ConfigError for a camera or target that the scenario does not have; ValueError for what
    is no event, for times that are no integers, and for a stop before the start.
    """
    check_choice("kind", kind, tuple(Event))
    check_integer("start_ns", start_ns, 0, LARGEST_TIME)
    check_integer("stop_ns", stop_ns, start_ns, LARGEST_TIME)
    check_integer("step_ns", step_ns, 1, LARGEST_TIME)
    for name, known in ((camera, scenario.cameras), (target, scenario.models)):
        if name not in known:
            raise ConfigError(
                scenario.name, f'"{name}"', f"is unknown; {did_you_mean(name, known)}"
            )
    condition = _condition(kind, camera, target)

    def holds(tai_ns: int) -> bool:
        return condition(scenario.at(tai_ns))

    begins = []
    previous, held = start_ns, holds(start_ns)
    # The last step may be shorter than the others.
    for tai_ns in dict.fromkeys([*regular(start_ns, stop_ns, step_ns)[1:], stop_ns]):
        holds_now = holds(tai_ns)
        if holds_now and not held:
            begins.append(_bisect(holds, previous, tai_ns))
        previous, held = tai_ns, holds_now
    return begins


def _bisect(holds: Callable[[int], bool], before: int, after: int) -> int:
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
    """Whether the Sun's disc touches the image; the Earth and spacecraft may still hide it."""
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
