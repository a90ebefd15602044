"""The keys that change what is shown, and what the window says of each change."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.physics.frames import direction_icrf
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState
from simgl.viewer.orbit_camera import range_limits
from simgl.viewer.view_settings import CAMERA_VIEWS, ORBIT_VIEWS, ViewSettings

# An arrow key moves time by this many seconds of playing.
_STEP = 10
# A key moves the Sun by this much [deg].
_SUN_STEP = 5.0
# Limits of exposure and gain: a factor of a thousand either way.
_MAX_THIRDS = 30

Effect = Callable[[ViewSettings, Scenario], ViewSettings]
Says = Callable[[ViewSettings, Scenario], str]


def chosen_state(scenario: Scenario, settings: ViewSettings) -> SceneState:
    """The scene as it was chosen; raises ConfigError where a trajectory has no data."""
    sun = None
    if settings.sun_deg is not None:
        angles = (math.radians(angle) for angle in settings.sun_deg)
        sun = ASTRONOMICAL_UNIT * direction_icrf(*angles)
    exposure_times = {}
    if settings.camera is not None:
        exposure_times[settings.camera] = exposure_time(scenario, settings)
    state = scenario.with_poses(settings.tai_ns, {}, exposure_times, sun=sun)
    if settings.camera is None or settings.gain_thirds == 0:
        return state
    placed = state.cameras[settings.camera]
    detector = placed.camera.detector
    gain = detector.gain_dn_per_e * settings.gain_factor
    camera = replace(placed.camera, detector=replace(detector, gain_dn_per_e=gain))
    return replace(
        state, cameras={**state.cameras, settings.camera: replace(placed, camera=camera)}
    )


def exposure_time(scenario: Scenario, settings: ViewSettings) -> float:
    """Of the chosen camera [s]."""
    assert settings.camera is not None
    return scenario.cameras[settings.camera].exposure_time * 2.0**settings.exposure_value


def exposure_text(settings: ViewSettings, scenario: Scenario) -> str:
    """The exposure time, or the brightness of the display."""
    if settings.camera is None:
        return f"display {settings.exposure_value:+.1f} EV"
    seconds = exposure_time(scenario, settings)
    return f"exposure {1e3 * seconds:.4g} ms ({settings.exposure_value:+.1f} EV)"


def gain_text(settings: ViewSettings, scenario: Scenario) -> str:
    """The conversion gain."""
    if settings.camera is None:
        return "gain: look through a camera (c)"
    gain = scenario.cameras[settings.camera].detector.gain_dn_per_e * settings.gain_factor
    return f"gain {gain:.4g} DN/e- (x {settings.gain_factor:.3g})"


def time_text(settings: ViewSettings, scenario: Scenario) -> str:
    """How far from the scenario's epoch, and whether time runs."""
    seconds = 1e-9 * (settings.tai_ns - scenario.epoch_tai_ns)
    return f"{seconds:+.1f} s, {'playing' if settings.playing else 'paused'} x {settings.speed:g}"


def sun_text(settings: ViewSettings, _scenario: Scenario) -> str:
    """Where the Sun was put."""
    if settings.sun_deg is None:
        return "Sun as in the scenario"
    return f"Sun at right ascension {settings.sun_deg[0]:.0f}, declination " + (
        f"{settings.sun_deg[1]:.0f} deg"
    )


def camera_text(settings: ViewSettings, scenario: Scenario) -> str:
    """Through what one looks."""
    if settings.camera is None:
        orbit = settings.orbit
        angles = f"{math.degrees(orbit.azimuth):.0f}, {math.degrees(orbit.elevation):.0f} deg"
        return f"circles {settings.target} at {angles}"
    detector = scenario.cameras[settings.camera].detector
    return f"camera {settings.camera}, {detector.width} x {detector.height}"


def _next_target(settings: ViewSettings, scenario: Scenario) -> ViewSettings:
    """The next spacecraft, seen from the same side and as large."""
    names = list(scenario.models)
    name = names[(names.index(settings.target) + 1) % len(names)]
    nearest, farthest = range_limits(scenario.models[name])
    distance = settings.orbit.range * nearest / settings.orbit.nearest
    orbit = replace(
        settings.orbit, range=min(distance, farthest), nearest=nearest, farthest=farthest
    )
    return replace(settings, target=name, orbit=orbit, camera=None)


def _camera_by_number(number: int) -> Effect:
    def effect(settings: ViewSettings, scenario: Scenario) -> ViewSettings:
        names = [None, *scenario.cameras]
        return replace(settings, camera=names[number]) if number < len(names) else settings

    return effect


def _next_camera(settings: ViewSettings, scenario: Scenario) -> ViewSettings:
    names = [None, *scenario.cameras]
    return replace(settings, camera=names[(names.index(settings.camera) + 1) % len(names)])


def _next_view(settings: ViewSettings, _scenario: Scenario) -> ViewSettings:
    names = list(ORBIT_VIEWS if settings.camera is None else CAMERA_VIEWS)
    name = names[(names.index(settings.shown[0]) + 1) % len(names)]
    if settings.camera is None:
        return replace(settings, orbit_view=name)
    return replace(settings, camera_view=name)


def _brighter(thirds: int) -> Effect:
    def effect(settings: ViewSettings, _: Scenario) -> ViewSettings:
        wanted = settings.exposure_thirds + thirds
        return replace(settings, exposure_thirds=min(max(wanted, -_MAX_THIRDS), _MAX_THIRDS))

    return effect


def _more_gain(thirds: int) -> Effect:
    def effect(settings: ViewSettings, _: Scenario) -> ViewSettings:
        if settings.camera is None:
            return settings
        wanted = settings.gain_thirds + thirds
        return replace(settings, gain_thirds=min(max(wanted, -_MAX_THIRDS), _MAX_THIRDS))

    return effect


def _turn_sun(right_ascension: float, declination: float) -> Effect:
    def effect(settings: ViewSettings, scenario: Scenario) -> ViewSettings:
        if settings.sun_deg is None:
            # From where it stands, on the grid of steps.
            state = scenario.at(settings.tai_ns)
            x, y, z = state.sun.seen_from(
                state.bodies[settings.target].pose.position
            ).direction_icrf
            a, d = math.degrees(math.atan2(y, x)), math.degrees(math.asin(z))
        else:
            a, d = settings.sun_deg
        a = _SUN_STEP * round((a + right_ascension) / _SUN_STEP) % 360.0
        d = _SUN_STEP * round((d + declination) / _SUN_STEP)
        return replace(settings, sun_deg=(a, min(max(d, -90.0), 90.0)))

    return effect


def _as_scenario(settings: ViewSettings, _scenario: Scenario) -> ViewSettings:
    return replace(settings, exposure_thirds=0, gain_thirds=0, sun_deg=None)


@dataclass(frozen=True)
class Command:
    """A key's effect on what is shown.

    keys : characters, or names of keys that type none
    says : what the window then shows of the new settings
    """

    keys: tuple[str, ...]
    meaning: str
    effect: Effect
    says: Says


COMMANDS = (
    Command(
        ("space",),
        "play or pause",
        lambda view, _: replace(view, playing=not view.playing),
        time_text,
    ),
    Command(
        ("right",), f"{_STEP} s of playing forward", lambda view, _: view.later(_STEP), time_text
    ),
    Command(("left",), f"{_STEP} s of playing back", lambda view, _: view.later(-_STEP), time_text),
    Command(("]",), "time twice as fast", lambda view, _: view.faster(1), time_text),
    Command(("[",), "time half as fast", lambda view, _: view.faster(-1), time_text),
    Command(("up", "+", "="), "exposure longer by 1/3 EV", _brighter(1), exposure_text),
    Command(("down", "-"), "exposure shorter by 1/3 EV", _brighter(-1), exposure_text),
    Command(("g",), "gain higher by 1/3 EV", _more_gain(1), gain_text),
    Command(("b",), "gain lower by 1/3 EV", _more_gain(-1), gain_text),
    Command(("l",), "Sun east by 5 deg (right ascension)", _turn_sun(_SUN_STEP, 0.0), sun_text),
    Command(("j",), "Sun west by 5 deg", _turn_sun(-_SUN_STEP, 0.0), sun_text),
    Command(("i",), "Sun north by 5 deg (declination)", _turn_sun(0.0, _SUN_STEP), sun_text),
    Command(("k",), "Sun south by 5 deg", _turn_sun(0.0, -_SUN_STEP), sun_text),
    Command(
        ("x",),
        "exposure, gain and Sun as in the scenario",
        _as_scenario,
        lambda *_: "exposure, gain and Sun as in the scenario",
    ),
    Command(("c",), "next camera, then back to the orbit", _next_camera, camera_text),
    *(Command((str(number),), "", _camera_by_number(number), camera_text) for number in range(10)),
    Command(("t",), "next spacecraft", _next_target, camera_text),
    Command(("v",), "next view: DN, radiance, electrons ...", _next_view, lambda s, _: s.shown[0]),
    Command(
        ("n",),
        "histogram of DN",
        lambda view, _: replace(view, histogram=not view.histogram),
        lambda view, _: f"histogram {'on' if view.histogram else 'off'}",
    ),
)
BY_KEY = {key: command for command in COMMANDS for key in command.keys}

# Keys and what they do, in the order in which help lists them.
HELP_OF_SCENARIOS = (
    ("drag", "circle the spacecraft"),
    ("scroll", "nearer or farther"),
    *((" ".join(command.keys), command.meaning) for command in COMMANDS if command.meaning),
    ("1..9 0", "camera by its number; 0: orbit"),
)
HELP_OF_WINDOW = (
    ("mouse", "values of the pixel under it"),
    ("s", "save the image and its data"),
    ("r", "start or end a video"),
    ("o", "show or hide all text"),
    ("h", "show or hide this help"),
    ("q escape", "close"),
)


def title(settings: ViewSettings, fps: float | None = None) -> str:
    """The window's title: subject, time, brightness and speed."""
    orbit = settings.orbit
    azimuth, elevation = math.degrees(orbit.azimuth), math.degrees(orbit.elevation)
    orbit_text = f"{settings.target} az {azimuth:.0f} el {elevation:.0f} deg, {orbit.range:.4g} m"
    parts = [
        settings.camera or orbit_text,
        f"{utc_from_tai_ns(settings.tai_ns)[:21]} UTC",
        f"{settings.exposure_value:+.1f} EV",
        f"{'playing' if settings.playing else 'paused'} x{settings.speed:g}",
    ]
    return " | ".join(["simgl", *parts, *([] if fps is None else [f"{fps:.0f} fps"])])
