"""What the viewers of a scenario chose: a frozen value, and the commands that change it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from simgl.errors import ConfigError
from simgl.physics.constants import ASTRONOMICAL_UNIT
from simgl.physics.frames import direction_icrf
from simgl.scenario.scenario import Scenario
from simgl.scene.state import SceneState

_PAGE = "browser view"
# Range of the exposure slider about the scenario's time, and of the speed.
_SHORTEST, _LONGEST = 1e-7, 100.0
_FASTEST = 1000.0
# A time further from the scenario's epoch is refused [s]: ten years.
_FARTHEST = 3.2e8


@dataclass(frozen=True, kw_only=True)
class WebSettings:
    """What all viewers of a scenario see.

    time : since the scenario's epoch [s]
    speed : seconds of the scene for each second of the viewer
    exposure_times : by camera [s], where it differs from the scenario's
    sun : right ascension and declination [rad]; None where the scenario has it
    """

    time: float = 0.0
    playing: bool = False
    speed: float = 1.0
    exposure_times: Mapping[str, float] = field(default_factory=dict)
    sun: tuple[float, float] | None = None

    def as_json(self) -> dict[str, Any]:
        """For the page."""
        sun = None if self.sun is None else [math.degrees(angle) for angle in self.sun]
        return {
            "time_s": self.time,
            "playing": self.playing,
            "speed": self.speed,
            "sun_deg": sun,
        }


def chosen_state(scenario: Scenario, settings: WebSettings) -> SceneState:
    """The scene as it was chosen; raises ConfigError where a trajectory has no data."""
    tai_ns = scenario.epoch_tai_ns + round(settings.time * 1e9)
    sun = None if settings.sun is None else ASTRONOMICAL_UNIT * direction_icrf(*settings.sun)
    return scenario.with_poses(tai_ns, {}, settings.exposure_times, sun=sun)


def changed(
    settings: WebSettings, scenario: Scenario, kind: str, values: Mapping[str, Any]
) -> WebSettings:
    """The settings after a command of a viewer.

    Raises ConfigError for an unknown command, and for a value that is missing or out of range.
    """
    if kind.startswith("exposure "):
        kind = "exposure"
    if kind not in _COMMANDS:
        raise ConfigError(_PAGE, kind, f"is not a command; there are {', '.join(_COMMANDS)}")
    return _COMMANDS[kind](settings, scenario, values)


def _number(values: Mapping[str, Any], key: str, low: float, high: float) -> float:
    value = values.get(key)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not low <= float(value) <= high:  # type: ignore[arg-type]
        raise ConfigError(_PAGE, key, f"must lie in {low:g}..{high:g}, got {value!r:.40}")
    return float(value)  # type: ignore[arg-type]


def _with_time(s: WebSettings, _scenario: Scenario, values: Mapping[str, Any]) -> WebSettings:
    return replace(s, time=_number(values, "time_s", -_FARTHEST, _FARTHEST))


def _with_play(s: WebSettings, _scenario: Scenario, values: Mapping[str, Any]) -> WebSettings:
    return replace(s, playing=values.get("playing") is True)


def _with_speed(s: WebSettings, _scenario: Scenario, values: Mapping[str, Any]) -> WebSettings:
    return replace(s, speed=_number(values, "speed", -_FASTEST, _FASTEST))


def _with_exposure(s: WebSettings, scenario: Scenario, values: Mapping[str, Any]) -> WebSettings:
    camera = values.get("camera")
    if not isinstance(camera, str) or camera not in scenario.cameras:
        names = ", ".join(scenario.cameras) or "none"
        raise ConfigError(_PAGE, "camera", f"must be one of {names}, got {camera!r:.40}")
    seconds = _number(values, "exposure_time_s", _SHORTEST, _LONGEST)
    return replace(s, exposure_times={**s.exposure_times, camera: seconds})


def _with_sun(s: WebSettings, _scenario: Scenario, values: Mapping[str, Any]) -> WebSettings:
    if values.get("as_scenario") is True:
        return replace(s, sun=None)
    right_ascension = _number(values, "right_ascension_deg", -360.0, 360.0)
    declination = _number(values, "declination_deg", -90.0, 90.0)
    return replace(s, sun=(math.radians(right_ascension), math.radians(declination)))


_COMMANDS: dict[str, Callable[[WebSettings, Scenario, Mapping[str, Any]], WebSettings]] = {
    "time": _with_time,
    "play": _with_play,
    "speed": _with_speed,
    "exposure": _with_exposure,
    "sun": _with_sun,
}
