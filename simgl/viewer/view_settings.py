"""What the user chose to see, as a frozen value, and the keys that change it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from simgl.errors import ConfigError, did_you_mean
from simgl.physics.ephemeris import utc_from_tai_ns
from simgl.scenario.scenario import Scenario
from simgl.viewer.orbit_camera import OrbitCamera, opening_camera, range_limits

# An arrow key moves time by this many seconds of playing.
_STEP = 10
# Limits of the speed, as doublings: 1/64 of real time to an orbit in 1.3 s.
_SLOWEST, _FASTEST = -6, 12


@dataclass(frozen=True, kw_only=True)
class ViewSettings:
    """What the user chose to see.

    tai_ns : instant of the scene
    target, orbit : the spacecraft in the centre and the camera about it
    camera : the scenario camera to look through; None for the orbit camera
    exposure_thirds : brightening of the display in thirds of an EV
    speed_doublings : the scene's seconds for each of the user's are two to this power
    """

    tai_ns: int
    target: str
    orbit: OrbitCamera
    camera: str | None = None
    exposure_thirds: int = 0
    speed_doublings: int = 0
    playing: bool = False

    @property
    def exposure_value(self) -> float:
        """[EV]."""
        return self.exposure_thirds / 3.0

    @property
    def speed(self) -> float:
        """Seconds of the scene for each second of the user."""
        return 2.0**self.speed_doublings

    def later(self, seconds: float) -> ViewSettings:
        """After some seconds of the user's time at the chosen speed."""
        return replace(self, tai_ns=self.tai_ns + round(1e9 * seconds * self.speed))

    def faster(self, doublings: int) -> ViewSettings:
        """At another speed, within its limits."""
        speed = min(max(self.speed_doublings + doublings, _SLOWEST), _FASTEST)
        return replace(self, speed_doublings=speed)

    def same_image(self, other: ViewSettings) -> bool:
        """Whether both need the same radiance."""
        keys = [
            (s.tai_ns, s.camera, None if s.camera else (s.target, s.orbit)) for s in (self, other)
        ]
        return keys[0] == keys[1]


def opening_settings(scenario: Scenario, target: str | None) -> ViewSettings:
    """The first image: the scenario's epoch, a spacecraft in the centre.

    Raises ConfigError for a scenario without spacecraft, or a target that it does not have.
    """
    if not scenario.models:
        raise ConfigError(
            scenario.name, "spacecraft", "is missing; the viewer circles a [spacecraft.NAME]"
        )
    if target is not None and target not in scenario.models:
        problem = f'"{target}" is not in {scenario.name}; {did_you_mean(target, scenario.models)}'
        raise ConfigError("command line", "--target", problem)
    name = next(iter(scenario.models)) if target is None else target
    state = scenario.at(scenario.epoch_tai_ns)
    return ViewSettings(
        tai_ns=scenario.epoch_tai_ns, target=name, orbit=opening_camera(state, name)
    )


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


def _next_camera(settings: ViewSettings, scenario: Scenario) -> ViewSettings:
    names = [None, *scenario.cameras]
    return replace(settings, camera=names[(names.index(settings.camera) + 1) % len(names)])


def _brighter(thirds: int) -> Callable[[ViewSettings, Scenario], ViewSettings]:
    return lambda settings, _: replace(settings, exposure_thirds=settings.exposure_thirds + thirds)


@dataclass(frozen=True)
class Command:
    """A key's effect on what is shown.

    keys : characters, or names of keys that type none
    """

    keys: tuple[str, ...]
    meaning: str
    effect: Callable[[ViewSettings, Scenario], ViewSettings]


COMMANDS = (
    Command(
        ("space",),
        "play or pause",
        lambda view, _: replace(view, playing=not view.playing),
    ),
    Command(("right",), f"{_STEP} s of playing forward", lambda view, _: view.later(_STEP)),
    Command(("left",), f"{_STEP} s of playing back", lambda view, _: view.later(-_STEP)),
    Command(("]",), "time twice as fast", lambda view, _: view.faster(1)),
    Command(("[",), "time half as fast", lambda view, _: view.faster(-1)),
    Command(("up", "+", "="), "brighter by 1/3 EV", _brighter(1)),
    Command(("down", "-"), "darker by 1/3 EV", _brighter(-1)),
    Command(("c",), "next camera of the scenario, then back to the orbit", _next_camera),
    Command(("t",), "next spacecraft", _next_target),
)

HELP = "\n".join(
    f"  {keys:<14}{meaning}"
    for keys, meaning in (
        ("drag", "circle the spacecraft"),
        ("scroll", "nearer or farther"),
        *((" ".join(command.keys), command.meaning) for command in COMMANDS),
        ("s", "save a screenshot in the working directory"),
        ("h", "print this help"),
        ("q escape", "close"),
    )
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
